// Colours that colour-blind people can distinguish (Okabe and Ito), for light and dark pages.
const LIGHT = ["#0072B2", "#D55E00", "#009E73", "#CC79A7"], DARK = ["#56B4E9", "#E69F00", "#3fc79a", "#CC79A7"];

export function theme() {
  const dark = document.body.classList.contains("body--dark");
  return dark
    ? { ink: "#e8e8e8", faint: "#555", paper: "#1d1d1d", x: DARK[0], y: DARK[1], lines: DARK }
    : { ink: "#222", faint: "#ccc", paper: "#ffffff", x: LIGHT[0], y: LIGHT[1], lines: LIGHT };
}

// Cividis, seven of its colours; linear in between.
const STOPS = [[0, 32, 77], [33, 61, 107], [86, 91, 109], [123, 122, 119], [165, 156, 116], [211, 193, 100], [255, 234, 70]];

export function cividis(share) {
  const at = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1), i = Math.min(Math.floor(at), STOPS.length - 2);
  return [0, 1, 2].map((k) => STOPS[i][k] + (at - i) * (STOPS[i + 1][k] - STOPS[i][k]));
}

export const css = ([r, g, b]) => `rgb(${r | 0},${g | 0},${b | 0})`;
