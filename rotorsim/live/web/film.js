// The film's pressure, unrolled: angle along, bearing length up.
import { cividis } from "./colours.js";
import { axes, begin, colourBar } from "./plot.js";

const image = document.createElement("canvas");

export function span(film) {
  let low = Infinity, high = -Infinity;
  for (const p of film) { if (p < low) low = p; if (p > high) high = p; }
  return [low, Math.max(high, low + 1)];
}

export function drawFilm(canvas, film, rig) {
  const view = begin(canvas);
  if (!view) return;
  const { g, w, h } = view, box = { x: 52, y: 6, w: w - 118, h: h - 44 };
  const n = rig.theta.length, m = rig.z.length, [low, high] = span(film);
  image.width = n;
  image.height = m;
  const pen = image.getContext("2d"), cells = pen.createImageData(n, m);
  for (let i = 0; i < n; i++) for (let j = 0; j < m; j++) {
    cells.data.set([...cividis((film[i * m + j] - low) / (high - low)), 255], 4 * ((m - 1 - j) * n + i));
  }
  pen.putImageData(cells, 0, 0);
  g.imageSmoothingEnabled = true;
  g.drawImage(image, box.x, box.y, box.w, box.h);
  const step = rig.theta[1] - rig.theta[0];
  axes({ g, colours: { ...view.colours, faint: "#8884" } }, box, [rig.theta[0] - step / 2, rig.theta[n - 1] + step / 2],
    [rig.z[0], rig.z[m - 1]], "angle from x [deg]", "z [mm]");
  colourBar(view, { x: box.x + box.w + 8, y: box.y, w: 10, h: box.h }, low, high, "kPa gauge");
}
