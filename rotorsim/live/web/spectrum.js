// Spectrum with an order cursor, and a waterfall of the spectra of the last seconds.
import { cividis } from "./colours.js";
import { axes, begin, colourBar, line, stroke } from "./plot.js";

const FLOOR = 0.01, LEAST_CEILING = 100, ROWS = 120, EVERY = 0.1;
const share = (size, ceiling) => Math.log10(Math.max(size, FLOOR) / FLOOR) / Math.log10(ceiling / FLOOR);
let ceiling = LEAST_CEILING;

// The scale takes the largest line that was shown since the page was opened, in whole decades.
function widen(spectrum) {
  let most = ceiling;
  for (const size of spectrum) if (size > most) most = size;
  if (most > ceiling) ceiling = 10 ** Math.ceil(Math.log10(most));
}
const ORDERS = [0.5, 1, 2, 3];

export function drawSpectrum(canvas, { spectrum, orders, now: { speed } }, highest, cursor) {
  const view = begin(canvas);
  if (!view) return;
  const { g, w, h, colours } = view, last = highest;
  if (spectrum) widen(spectrum);
  const box = { x: 52, y: 14, w: w - 62, h: h - 52 };
  const map = axes(view, box, [0, last], [Math.log10(FLOOR), Math.log10(ceiling)], "frequency [Hz]", "disc [um 0-pk]",
    (v) => (Number.isInteger(v) ? String(Number((10 ** v).toPrecision(1))) : ""));
  g.textAlign = "center";
  g.textBaseline = "bottom";
  if (orders) {
    g.fillStyle = colours.ink;
    g.fillText(orders, box.x + box.w / 2, box.y - 1);
  }
  if (!spectrum) return;
  for (const order of orders ? [] : ORDERS) {
    const at = (order * Math.abs(speed)) / 60;
    if (at < 1 || at > last) continue;
    g.strokeStyle = colours.y;
    g.setLineDash([3, 3]);
    stroke(g, map.px(at), box.y, map.px(at), box.y + box.h);
    g.setLineDash([]);
    g.fillStyle = colours.ink;
    g.fillText(`${order}X`, map.px(at), box.y - 1);
  }
  const step = last / (spectrum.length - 1);
  line(g, map, (i) => i * step, spectrum.map((v) => Math.log10(Math.max(v, FLOOR))), colours.x);
  if (cursor !== null) {
    const i = Math.round(Math.min(Math.max(((cursor - box.x) / box.w) * last, 0), last) / step), hertz = i * step;
    const order = !orders && Math.abs(speed) > 30 ? `, ${((60 * hertz) / Math.abs(speed)).toFixed(2)}X` : "";
    g.strokeStyle = colours.ink;
    stroke(g, map.px(hertz), box.y, map.px(hertz), box.y + box.h);
    g.fillStyle = colours.ink;
    g.textAlign = hertz > last / 2 ? "right" : "left";
    g.textBaseline = "top";
    g.fillText(` ${Number(hertz.toPrecision(6))} Hz${order}: ${spectrum[i].toFixed(2)} um `, map.px(hertz), box.y + 4);
  }
}

export class Waterfall {
  constructor() {
    this.rows = []; // the newest first
    this.at = -1;
  }
  add(spectrum, time) {
    if (time < this.at) this.clear();
    const rows = this.rows.length ? Math.min(Math.floor((time - this.at) / EVERY + 1e-6), ROWS) : 1;
    if (rows < 1) return;
    widen(spectrum);
    this.at = this.rows.length ? this.at + rows * EVERY : time;
    for (let k = 0; k < rows; k++) this.rows.unshift(spectrum);
    this.rows.length = Math.min(this.rows.length, ROWS);
    if (this.ceiling !== ceiling || !this.image) this.paint();
    else this.shift(rows);
  }
  clear() {
    this.rows = [];
    this.image = null;
    this.at = -1;
  }
  paint() {
    this.ceiling = ceiling;
    this.image = document.createElement("canvas");
    this.image.width = this.rows[0].length;
    this.image.height = ROWS;
    const g = this.image.getContext("2d", { willReadFrequently: true });
    g.fillStyle = `rgb(${cividis(0)})`;
    g.fillRect(0, 0, this.image.width, ROWS);
    this.rows.forEach((row, k) => this.line(g, row, k, 1));
  }
  shift(rows) {
    const g = this.image.getContext("2d", { willReadFrequently: true });
    g.drawImage(this.image, 0, rows);
    this.line(g, this.rows[0], 0, rows);
  }
  line(g, spectrum, first, count) {
    const row = g.createImageData(spectrum.length, 1);
    spectrum.forEach((size, i) => row.data.set([...cividis(share(size, ceiling)), 255], 4 * i));
    for (let k = 0; k < count; k++) g.putImageData(row, 0, first + k);
  }
  draw(canvas, highest) {
    const view = begin(canvas);
    if (!view) return;
    const { g, w, h } = view, box = { x: 52, y: 6, w: w - 112, h: h - 44 };
    if (this.image) g.drawImage(this.image, box.x, box.y, box.w, box.h);
    axes({ g, colours: { ...view.colours, faint: "#8884" } }, box, [0, highest], [-ROWS * EVERY, 0], "frequency [Hz]", "time [s]");
    colourBar(view, { x: box.x + box.w + 8, y: box.y, w: 10, h: box.h }, FLOOR, ceiling, "um 0-pk, log");
  }
}
