// The last 2500 samples, `span` seconds: disc and pins as their sensors read them, references.
import { axes, begin, legend, line, Range } from "./plot.js";

const ranges = { disc: new Range(4), reference: new Range(0.5), pin: new Range(2) };

export function drawTraces(canvas, trace, span) {
  const view = begin(canvas);
  if (!view) return;
  const { g, w, h, colours } = view;
  const shown = Math.max(span, trace.seconds);
  const pins = Object.keys(trace).filter((name) => name.startsWith("pin_"));
  const rows = [["disc", ["x", "y"], "disc [um]"]];
  if (pins.length) rows.push(["reference", ["reference_x", "reference_y"], "ref. [V]"], ["pin", pins, "pins [um]"]);
  const each = (h - 38) / rows.length;
  rows.forEach(([kind, names, label], k) => {
    const box = { x: 52, y: 4 + k * each, w: w - 62, h: each - 8 };
    const last = k === rows.length - 1;
    const map = axes(view, box, [-shown, 0], ranges[kind].around(names.map((n) => trace[n])), last ? "time [s]" : null, label);
    names.forEach((name, i) => {
      const values = trace[name], count = values.length;
      line(g, map, (j) => -trace.seconds * (1 - (j + 1) / count), values, colours.lines[i]);
    });
    const entries = kind === "pin" ? names.map((_, i) => String(i + 1)) : ["x", "y"];
    legend(view, box, entries, colours.lines);
  });
}
