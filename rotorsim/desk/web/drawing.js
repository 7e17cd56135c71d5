// Places in pixels of a side view that is given in mm: to scale in both directions, with rows of dimensions below.
const ROOM = { left: 74, right: 26, above: 26, row: 26 };
const TALL = 300; // CSS pixels that the machine may take

export function layout(view, width) {
  const long = view.end - view.start, across = Math.max(width - ROOM.left - ROOM.right, 80);
  const scale = Math.min(across / long, TALL / (2 * view.top));
  const left = ROOM.left + (across - scale * long) / 2, middle = ROOM.above + scale * view.top;
  const px = (z) => left + scale * (z - view.start), py = (y) => middle - scale * y;
  const below = middle + scale * view.top + 16;
  return {
    width, height: below + ROOM.row * view.rows.length + 8, scale, start: px(view.start) - 20, end: px(view.end) + 20, middle,
    shapes: view.shapes.map(([part, kind, corners], key) => ({
      key, part, kind, points: corners.map(([z, y]) => `${px(z).toFixed(2)},${py(y).toFixed(2)}`).join(" "),
    })),
    marks: view.marks.map(([part, kind, z, y], key) => ({ key, part, kind, x: px(z), y: kind === "probe" ? 12 : py(y) })),
    diameters: view.diameters
      .map(([a, b, text], key) => ({ key, text, x: (px(a) + px(b)) / 2, wide: px(b) - px(a), y: middle }))
      .filter((one) => one.wide > 7 * one.text.length),
    rows: view.rows.map(([name, places, texts], k) => {
      const y = below + ROOM.row * (k + 0.6);
      const spans = texts.map((text, i) => ({ key: i, text, x: (px(places[i]) + px(places[i + 1])) / 2, wide: px(places[i + 1]) - px(places[i]) }));
      return { name, y, ticks: places.map(px), spans: spans.filter((one) => one.wide > 6.5 * one.text.length + 4) };
    }),
  };
}
