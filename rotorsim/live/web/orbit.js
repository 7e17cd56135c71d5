// An orbit inside the circles, or rooms with an edge in even directions, that it must not leave.
import { axes, begin, line } from "./plot.js";

export function drawOrbit(canvas, orbit, circles, [cx, cy]) {
  const view = begin(canvas);
  if (!view) return;
  const { g, w, h, colours } = view;
  const side = Math.min(w - 66, h - 44), box = { x: 50 + (w - 66 - side) / 2, y: 6, w: side, h: side };
  const reach = 1.12 * Math.max(...circles.map((c) => c.radius), 5, ...(orbit ? away(orbit, cx, cy) : []));
  const map = axes(view, box, [cx - reach, cx + reach], [cy - reach, cy + reach], "x [um]", "y [um]");
  for (const { radius, edge, name, dash } of circles) {
    g.setLineDash(dash);
    g.strokeStyle = colours.ink;
    g.beginPath();
    if (edge) {
      edge.forEach((r, i) => {
        const at = (2 * Math.PI * i) / edge.length;
        g.lineTo(map.px(cx + r * Math.cos(at)), map.py(cy + r * Math.sin(at)));
      });
      g.closePath();
    } else {
      g.arc(map.px(cx), map.py(cy), (radius / reach) * (side / 2), 0, 2 * Math.PI);
    }
    g.stroke();
    g.setLineDash([]);
    g.fillStyle = colours.ink;
    g.textAlign = "center";
    g.textBaseline = "bottom";
    g.fillText(name, map.px(cx), map.py(cy - 0.8 * radius));
  }
  if (!orbit) return;
  const [x, y] = orbit;
  g.save();
  g.beginPath();
  g.rect(box.x, box.y, box.w, box.h);
  g.clip();
  line(g, map, (i) => x[i], y, colours.x, 1.5);
  g.fillStyle = colours.ink;
  g.beginPath();
  g.arc(map.px(x.at(-1)), map.py(y.at(-1)), 3.5, 0, 2 * Math.PI);
  g.fill();
  g.restore();
}

// How far the orbit goes from the middle, in steps, so that the scale stands still.
function away([x, y], cx, cy) {
  let most = 0;
  for (let i = 0; i < x.length; i++) most = Math.max(most, Math.hypot(x[i] - cx, y[i] - cy));
  return [10 * Math.ceil(most / 10)];
}
