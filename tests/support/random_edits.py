"""Seeded random edits as a designer makes them: values good and bad, parts added, copied and deleted, undo and redo."""

MOST = 40
"""Parts of a design from which more are deleted than are added."""
WORDS = ("", "0", "-3", "abc", "1e400", "7 bananas", "12 mm", "0.5", "[x]", 'a"b', "25", "1 in")


def edits(rng, design, count):
    """Random acts on a design: name and values of each, from what is on it at that moment."""
    from rotorsim.desk.design import NEW
    from rotorsim.desk.parts import listed

    for number in range(count):
        parts = [part for group in listed(design) for part in group["parts"]]
        fields = [field for part in parts for field in part["fields"]]
        removed = ["delete"] * (1 if len(parts) < MOST else 5)
        kind = rng.choice(["set"] * 12 + ["add", "copy", "undo", "redo", "split", "mirror", "keep", "swap"] + removed)
        if kind == "set":
            field = fields[rng.integers(len(fields))]
            yield "set", {"path": field["path"], "text": _text(rng, field), "burst": str(number // 2)}
        elif kind == "add":
            yield "add", {"kind": str(rng.choice(list(NEW)))}
        elif kind == "split":
            yield "split", {"path": f"shaft.sections.{rng.integers(4)}"}
        elif kind in ("copy", "delete", "mirror"):
            yield kind, {"path": str(rng.choice([part["path"] for part in parts if part["many"]]))}
        else:
            yield str(kind), {}


def _text(rng, field):
    """A value near the one that is there, or one of the words."""
    text = field["text"] or field["holds"]
    try:
        value = float(text)
    except ValueError:
        return str(rng.choice(WORDS))
    return str(rng.choice(WORDS)) if rng.random() < 0.3 else f"{value * rng.uniform(0.7, 1.4):.4g}"
