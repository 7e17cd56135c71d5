// The shaft in a mode as a body in space that moves: rings of its radius along the line that the answer states.
import { begin } from "rotorsim-live";

const RINGS = 24; // corners of a ring
const PERIOD = 1600; // ms that one turn of the phase takes
const SIZE = 0.22; // largest displacement over the shaft's length

export class Shape {
  constructor(look) {
    [this.yaw, this.pitch, this.phase, this.last] = [-0.6, 0.35, 0, 0];
    const again = (now) => {
      this.now = now;
      look();
      this.frame = requestAnimationFrame(again);
    };
    this.frame = requestAnimationFrame(again);
  }
  end() {
    cancelAnimationFrame(this.frame);
  }
  turn(dx, dy) {
    this.yaw += dx / 120;
    this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + dy / 120));
  }
  draw(canvas, { z, radius, lines }, mode, moving) {
    if (moving) this.phase += (2 * Math.PI * Math.min(this.now - this.last, 100)) / PERIOD;
    this.last = this.now;
    const key = [mode, this.phase, this.yaw, this.pitch, canvas.clientWidth, document.body.className].join(), same = this.key === key && this.lines === lines;
    if (same) return;
    [this.key, this.lines] = [key, lines];
    const view = begin(canvas);
    if (!view) return;
    const { g, w, h, colours } = view, long = z[z.length - 1] - z[0], c = Math.cos(this.phase), s = Math.sin(this.phase);
    const thick = Math.min(1, (0.12 * long) / Math.max(...radius)), scale = (0.8 * w) / long;
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    const px = (x, y, along) => {
      const a = along * cy - x * sy, back = along * sy + x * cy;
      return [w / 2 + scale * a, h / 2 - scale * (y * cp - back * sp)];
    };
    const at = lines[mode].map(([re, im]) => re.map((v, k) => SIZE * long * (v * c - im[k] * s))); // the line at this phase
    g.lineWidth = 1;
    const path = (points, colour, alpha) => {
      g.strokeStyle = colour;
      g.globalAlpha = alpha;
      g.beginPath();
      points.forEach((p, k) => (k ? g.lineTo(...p) : g.moveTo(...p)));
      g.stroke();
    };
    const along = z.map((v) => v - z[0] - long / 2), corner = (k, j, dx, dy) => {
      const angle = (2 * Math.PI * j) / RINGS, r = thick * radius[k];
      return px(dx + r * Math.cos(angle), dy + r * Math.sin(angle), along[k]);
    };
    path([px(0, 0, along[0]), px(0, 0, along.at(-1))], colours.ink, 0.5);
    for (const k of z.keys()) path(Array.from({ length: RINGS + 1 }, (_, j) => corner(k, j, at[0][k], at[1][k])), colours.lines[mode % colours.lines.length], 0.8);
    for (let j = 0; j < RINGS; j += 3) path(z.map((_, k) => corner(k, j, at[0][k], at[1][k])), colours.lines[mode % colours.lines.length], 0.5);
    g.globalAlpha = 1;
  }
}
