// Spectrum with an order cursor, and a waterfall of the spectra of the last seconds.
import { cividis } from "./colours.js";
import { axes, begin, colourBar, line, stroke } from "./plot.js";

const FLOOR = 0.01, CEILING = 100, ROWS = 120, EVERY = 0.1;
const share = (size) => Math.log10(Math.max(size, FLOOR) / FLOOR) / Math.log10(CEILING / FLOOR);
const ORDERS = [0.5, 1, 2, 3];

export function drawSpectrum(canvas, spectrum, speed, cursor) {
  const view = begin(canvas), { g, w, h, colours } = view, last = spectrum.length - 1;
  const box = { x: 52, y: 14, w: w - 62, h: h - 52 };
  const map = axes(view, box, [0, last], [Math.log10(FLOOR), Math.log10(CEILING)], "frequency [Hz]", "disc [um 0-pk]",
    (v) => (Number.isInteger(v) ? String(Number((10 ** v).toPrecision(1))) : ""));
  g.textAlign = "center";
  g.textBaseline = "bottom";
  for (const order of ORDERS) {
    const at = (order * Math.abs(speed)) / 60;
    if (at < 1 || at > last) continue;
    g.strokeStyle = colours.y;
    g.setLineDash([3, 3]);
    stroke(g, map.px(at), box.y, map.px(at), box.y + box.h);
    g.setLineDash([]);
    g.fillStyle = colours.ink;
    g.fillText(`${order}X`, map.px(at), box.y - 1);
  }
  line(g, map, (i) => i, spectrum.map((v) => Math.log10(Math.max(v, FLOOR))), colours.x);
  if (cursor !== null) {
    const i = Math.round(Math.min(Math.max(((cursor - box.x) / box.w) * last, 0), last));
    const order = Math.abs(speed) > 30 ? `, ${((60 * i) / Math.abs(speed)).toFixed(2)}X` : "";
    g.strokeStyle = colours.ink;
    stroke(g, map.px(i), box.y, map.px(i), box.y + box.h);
    g.fillStyle = colours.ink;
    g.textAlign = i > last / 2 ? "right" : "left";
    g.textBaseline = "top";
    g.fillText(` ${i} Hz${order}: ${spectrum[i].toFixed(2)} um `, map.px(i), box.y + 4);
  }
}

export class Waterfall {
  constructor() {
    this.image = null;
    this.at = -1;
  }
  add(spectrum, time) {
    if (time < this.at) this.image = null;
    const rows = this.image ? Math.min(Math.floor((time - this.at) / EVERY + 1e-6), ROWS) : 1;
    if (rows < 1) return;
    this.at = this.image ? this.at + rows * EVERY : time;
    if (!this.image) {
      this.image = document.createElement("canvas");
      this.image.width = spectrum.length;
      this.image.height = ROWS;
      const g = this.image.getContext("2d");
      g.fillStyle = `rgb(${cividis(0)})`;
      g.fillRect(0, 0, spectrum.length, ROWS);
    }
    const g = this.image.getContext("2d", { willReadFrequently: true });
    g.drawImage(this.image, 0, rows);
    const row = g.createImageData(spectrum.length, 1);
    spectrum.forEach((size, i) => row.data.set([...cividis(share(size)), 255], 4 * i));
    for (let k = 0; k < rows; k++) g.putImageData(row, 0, k);
  }
  draw(canvas, highest) {
    const view = begin(canvas), { g, w, h } = view, box = { x: 52, y: 6, w: w - 112, h: h - 44 };
    if (this.image) g.drawImage(this.image, box.x, box.y, box.w, box.h);
    axes({ g, colours: { ...view.colours, faint: "#8884" } }, box, [0, highest], [-ROWS * EVERY, 0], "frequency [Hz]", "time [s]");
    colourBar(view, { x: box.x + box.w + 8, y: box.y, w: 10, h: box.h }, FLOOR, CEILING, "um 0-pk, log");
  }
}
