// Curves of a panel on a canvas: axes, the design before as a ghost, ranges in which a mode grows, values under the mouse.
import { begin, frame, line, stroke, ticks } from "rotorsim-live";

const BOX = { left: 58, right: 20, top: 10, bottom: 38 }; // CSS pixels
const MORE = { light: ["#56B4E9", "#9a6a00"], dark: ["#c9d36a", "#d55e00"] };
const short = (v) => (Math.abs(v) >= 1e5 || (v && Math.abs(v) < 1e-3) ? v.toExponential(0).replace("e+", "e") : String(Number(v.toPrecision(4))));

export class Chart {
  constructor(canvas) {
    this.canvas = canvas;
    this.cursor = null;
  }
  draw(answer, before, cursor = this.cursor) {
    this.last = [answer, before];
    this.cursor = cursor;
    const view = begin(this.canvas);
    if (!view || !answer || !answer.curves) return;
    const { g, w, h, colours } = view;
    const box = { x: BOX.left, y: BOX.top, w: w - BOX.left - BOX.right, h: h - BOX.top - BOX.bottom };
    const x = scale(answer.x, answer, before, "x"), y = scale(answer.y, answer, before, "y");
    const map = {
      px: (v) => box.x + x.share(v) * box.w,
      py: (v) => box.y + (answer.y.down ? y.share(v) : 1 - y.share(v)) * box.h,
    };
    g.save();
    g.beginPath();
    g.rect(box.x, box.y, box.w, box.h);
    g.clip();
    g.fillStyle = "#b0484833";
    for (const [a, b] of answer.bands || []) g.fillRect(map.px(a), box.y, map.px(b) - map.px(a), box.h);
    g.restore();
    frame(view, box, map, marks(x, Math.max(box.w / 70, 2)), marks(y, Math.max(box.h / 34, 2)), answer.x.label, answer.y.label, 48);
    g.save();
    g.beginPath();
    g.rect(box.x, box.y, box.w, box.h);
    g.clip();
    g.globalAlpha = 0.45;
    for (const one of (before && before.curves) || []) if (one.colour >= 0) curve(g, map, one, colours.ink, 1, [2, 3]);
    g.globalAlpha = 1;
    for (const one of answer.curves) {
      curve(g, map, one, shade(colours, one.colour), one.colour < 0 ? 1 : 1.8, one.dash ? [6, 4] : []);
      senses(g, map, one, shade(colours, one.colour));
    }
    g.restore();
    rings(g, box, map, answer.rings, colours.ink);
    if (cursor !== null) this.values(g, colours, box, map, x, answer);
  }
  again(cursor) {
    if (this.last) this.draw(...this.last, cursor);
  }
  values(g, colours, box, map, x, answer) {
    const share = Math.min(Math.max((this.cursor - box.x) / box.w, 0), 1), at = x.value(share);
    g.strokeStyle = colours.ink;
    g.lineWidth = 1;
    stroke(g, map.px(at), box.y, map.px(at), box.y + box.h);
    const lines = [[`${answer.x.label.split(" [")[0]} ${short(at)}`, colours.ink]];
    for (const one of answer.curves) {
      if (one.colour < 0) continue;
      const y = between(one, at);
      if (y !== null) lines.push([`${one.name}: ${Number(y.toPrecision(4))}`, shade(colours, one.colour)]);
    }
    const wide = Math.max(...lines.map(([text]) => g.measureText(text).width)) + 12;
    const left = share > 0.5 ? map.px(at) - wide - 6 : map.px(at) + 6;
    g.fillStyle = colours.paper;
    g.globalAlpha = 0.92;
    g.fillRect(left, box.y + 4, wide, 14 * lines.length + 6);
    g.globalAlpha = 1;
    g.textAlign = "left";
    g.textBaseline = "top";
    lines.forEach(([text, colour], k) => {
      g.fillStyle = colour;
      g.fillText(text, left + 6, box.y + 8 + 14 * k);
    });
  }
}

export function shade(colours, k) {
  const more = MORE[document.body.classList.contains("body--dark") ? "dark" : "light"], all = [...colours.lines, ...more];
  return k < 0 ? colours.ink : all[k % all.length];
}

// Map between values and shares of an axis, with its ticks: the range that is given, or that of all curves.
function scale(axis, answer, before, name) {
  let [low, high] = axis.range || extent([...answer.curves, ...((before && before.curves) || [])], name);
  if (axis.zero) [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  if (!(high > low)) [low, high] = [low - 0.5, low + 0.5];
  if (!axis.range) [low, high] = [low - 0.04 * (high - low) * (low !== 0 || !axis.zero), high + 0.06 * (high - low)];
  if (!axis.log) return { share: (v) => (v - low) / (high - low), value: (s) => low + s * (high - low), low, high, log: false };
  const [a, b] = [Math.log10(low), Math.log10(high)];
  return { share: (v) => (Math.log10(v) - a) / (b - a), value: (s) => 10 ** (a + s * (b - a)), low: a, high: b, log: true };
}

function extent(curves, name) {
  let low = Infinity, high = -Infinity;
  for (const one of curves) for (const v of one[name]) if (v !== null) { if (v < low) low = v; if (v > high) high = v; }
  return high >= low ? [low, high] : [0, 1];
}

function marks(axis, most) {
  const found = ticks(axis.low, axis.high, most);
  if (!axis.log) return found.map((v) => [v, short(v)]);
  const whole = found.filter((v) => Number.isInteger(Number(v.toFixed(9))));
  if (whole.length > 2) return whole.map((v) => [10 ** v, `1e${Math.round(v)}`]);
  const decades = Array.from({ length: Math.floor(axis.high) - Math.floor(axis.low) + 1 }, (_, k) => 10 ** (Math.floor(axis.low) + k));
  const inside = (v) => Math.log10(v) >= axis.low - 1e-9 && Math.log10(v) <= axis.high + 1e-9;
  return decades.flatMap((v) => [v, 2 * v, 5 * v]).filter(inside).map((v) => [v, short(v)]);
}

function curve(g, map, one, colour, width, dash) {
  g.setLineDash(dash);
  line(g, map, (i) => one.x[i], one.y, colour, width);
  g.setLineDash([]);
}

// Triangles up for forward whirl, down for backward, dots for mixed.
function senses(g, map, one, colour) {
  g.fillStyle = colour;
  for (let i = 0; i < (one.marks || "").length; i++) {
    if (one.y[i] === null) continue;
    const x = map.px(one.x[i]), y = map.py(one.y[i]), up = one.marks[i] === "f" ? -1 : one.marks[i] === "b" ? 1 : 0;
    g.beginPath();
    if (up) { g.moveTo(x - 3.2, y - 2.4 * up); g.lineTo(x + 3.2, y - 2.4 * up); g.lineTo(x, y + 3.6 * up); }
    else g.arc(x, y, 2, 0, 7);
    g.fill();
  }
}

function rings(g, box, map, found, colour) {
  if (!found) return;
  g.strokeStyle = colour;
  g.lineWidth = 1.6;
  for (let i = 0; i < found[0].length; i++) {
    if (map.py(found[1][i]) < box.y) continue;
    g.beginPath();
    g.arc(map.px(found[0][i]), map.py(found[1][i]), 5.5, 0, 7);
    g.stroke();
  }
}

// Value of a curve at a place, on a straight line between its points; null outside and in gaps.
function between(one, at) {
  for (let i = 1; i < one.x.length; i++) {
    const [a, b] = [one.x[i - 1], one.x[i]];
    if (a === null || b === null || one.y[i - 1] === null || one.y[i] === null || at < a || at > b || a === b) continue;
    return one.y[i - 1] + ((at - a) / (b - a)) * (one.y[i] - one.y[i - 1]);
  }
  return null;
}
