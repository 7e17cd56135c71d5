// What the desk draws; each view takes plain data and knows nothing of where they came from.
export { Chart, shade } from "./chart.js";
export { layout } from "./drawing.js";
export { Shape } from "./shape.js";
