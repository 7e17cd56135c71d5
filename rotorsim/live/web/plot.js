// Axes, lines and colour bars on a canvas; lengths in CSS pixels.
import { css, cividis, theme } from "./colours.js";

const LEAST = { w: 140, h: 80 }; // CSS pixels that axes and labels take

// What a view draws with, or null on a canvas that is too small to draw on.
export function begin(canvas) {
  const scale = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  if (canvas.width !== Math.round(w * scale) || canvas.height !== Math.round(h * scale)) {
    canvas.width = Math.round(w * scale);
    canvas.height = Math.round(h * scale);
  }
  const g = canvas.getContext("2d");
  g.setTransform(scale, 0, 0, scale, 0, 0);
  g.clearRect(0, 0, w, h);
  g.font = "11px system-ui, sans-serif";
  return w < LEAST.w || h < LEAST.h ? null : { g, w, h, colours: theme() };
}

export function ticks(low, high, most) {
  const raw = (high - low) / most, size = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * size).find((s) => s >= raw);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
}

const text = (value) => String(Number(value.toPrecision(4)));

// Draws frame, ticks and labels; returns the maps from values to pixels. A name for a tick may be given.
export function axes(view, box, xs, ys, xlabel, ylabel, name = text) {
  const map = {
    px: (v) => box.x + ((v - xs[0]) / (xs[1] - xs[0])) * box.w,
    py: (v) => box.y + box.h - ((v - ys[0]) / (ys[1] - ys[0])) * box.h,
  };
  const across = ticks(...xs, Math.max(box.w / 38, 2)).map((v) => [v, xlabel === null ? "" : text(v)]);
  const up = ticks(...ys, Math.max(box.h / 28, 2)).map((v) => [v, name(v)]);
  frame(view, box, map, across, up, xlabel || "", ylabel, 33);
  return map;
}

// Frame with ticks, each a value and its text, and labels; that of y is so far from the box.
export function frame({ g, colours }, box, map, across, up, xlabel, ylabel, away) {
  g.strokeStyle = colours.faint;
  g.fillStyle = colours.ink;
  g.lineWidth = 1;
  g.textBaseline = "top";
  g.textAlign = "center";
  for (const [v, name] of across) {
    stroke(g, map.px(v), box.y, map.px(v), box.y + box.h);
    g.fillText(name, map.px(v), box.y + box.h + 4);
  }
  g.fillText(xlabel, box.x + box.w / 2, box.y + box.h + 19);
  g.textAlign = "right";
  g.textBaseline = "middle";
  for (const [v, name] of up) {
    stroke(g, box.x, map.py(v), box.x + box.w, map.py(v));
    g.fillText(name, box.x - 5, map.py(v));
  }
  g.strokeRect(box.x, box.y, box.w, box.h);
  g.save();
  g.translate(box.x - away, box.y + box.h / 2);
  g.rotate(-Math.PI / 2);
  g.textAlign = "center";
  g.fillText(ylabel, 0, 0);
  g.restore();
}

export function stroke(g, x1, y1, x2, y2) {
  g.beginPath();
  g.moveTo(x1, y1);
  g.lineTo(x2, y2);
  g.stroke();
}

// A line through points, with gaps where one has no value.
export function line(g, map, xs, ys, colour, width = 1.3) {
  g.strokeStyle = colour;
  g.lineWidth = width;
  g.beginPath();
  let drawing = false;
  for (let i = 0; i < ys.length; i++) {
    const x = xs(i), known = x !== null && ys[i] !== null;
    if (known && drawing) g.lineTo(map.px(x), map.py(ys[i]));
    else if (known) g.moveTo(map.px(x), map.py(ys[i]));
    drawing = known;
  }
  g.stroke();
}

// A name per line, coloured, at the top right of a box.
export function legend({ g, colours }, box, names, palette) {
  g.textBaseline = "top";
  g.textAlign = "right";
  let right = box.x + box.w - 5;
  names.map((name, i) => [name, palette[i]]).reverse().forEach(([name, colour]) => {
    const wide = g.measureText(name).width;
    g.fillStyle = colours.paper;
    g.globalAlpha = 0.75;
    g.fillRect(right - wide - 3, box.y + 2, wide + 6, 13);
    g.globalAlpha = 1;
    g.fillStyle = colour;
    g.fillText(name, right, box.y + 3);
    right -= wide + 10;
  });
}

// Remembers a range: it widens at once and narrows slowly, so that the scale stands still under the eye.
export class Range {
  constructor(least) {
    this.least = least;
    this.low = this.high = 0;
  }
  around(lists) {
    let low = Infinity, high = -Infinity;
    for (const list of lists) for (const v of list) { if (v < low) low = v; if (v > high) high = v; }
    if (!(high >= low)) return [this.low, this.high || this.least];
    const middle = (low + high) / 2, half = Math.max((high - low) / 2, this.least / 2) * 1.15;
    low = middle - half; high = middle + half;
    const wide = this.high - this.low;
    if (low < this.low || high > this.high || 2 * half < 0.4 * wide) {
      const step = ticks(0, 2 * half, 4)[1];
      this.low = Math.floor(low / step) * step;
      this.high = Math.ceil(high / step) * step;
    }
    return [this.low, this.high];
  }
}

export function colourBar({ g, colours }, box, low, high, label) {
  for (let i = 0; i < box.h; i++) {
    g.fillStyle = css(cividis(1 - i / box.h));
    g.fillRect(box.x, box.y + i, box.w, 1.5);
  }
  g.fillStyle = colours.ink;
  g.textAlign = "left";
  g.textBaseline = "top";
  g.fillText(text(high), box.x + box.w + 4, box.y);
  g.textBaseline = "bottom";
  g.fillText(text(low), box.x + box.w + 4, box.y + box.h);
  g.save();
  g.translate(box.x + box.w + 6, box.y + box.h / 2);
  g.rotate(-Math.PI / 2);
  g.textAlign = "center";
  g.textBaseline = "top";
  g.fillText(label, 0, 0);
  g.restore();
}
