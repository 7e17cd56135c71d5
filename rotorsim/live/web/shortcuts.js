// Keys of the whole page: space, x, y, r, wherever the focus is but in a field.
const KEYS = [" ", "x", "y", "r"], FIELDS = "input:not([type=button]):not([type=range]), textarea, select, [contenteditable=true]";

const BUTTONS = "button, [role=button], [role=tab], [role=radio]";

// A button that was clicked with the mouse gives the focus back: the next space would press it again. One that was reached
// with the keyboard keeps it, and space presses it.
function leaveButton() {
  const focus = document.activeElement; // of a toggle it is a part of the button
  if (focus && focus.closest(BUTTONS)) focus.blur();
}

export function shortcuts(act) {
  const listening = new AbortController(), { signal } = listening;
  document.addEventListener("click", ({ detail }) => {
    if (detail > 0) setTimeout(leaveButton);
  }, { signal, capture: true });
  document.addEventListener("keydown", (event) => {
    const focus = document.activeElement, { key } = event;
    if (event.repeat || event.ctrlKey || event.altKey || event.metaKey || !KEYS.includes(key)) return;
    if (focus && focus.matches(FIELDS)) return;
    if (key === " " && focus && focus.closest(BUTTONS)) return;
    if (key === " ") event.preventDefault();
    act(key);
  }, { signal });
  return listening;
}
