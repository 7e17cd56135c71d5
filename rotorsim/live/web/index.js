// Everything the page draws; each view takes a frame, or a part of one, and knows nothing of where it came from.
export { theme } from "./colours.js";
export { drawFilm } from "./film.js";
export { Film3d } from "./film3d.js";
export { drawOrbit } from "./orbit.js";
export { begin, frame, line, stroke, ticks } from "./plot.js";
export { readings } from "./readings.js";
export { shortcuts } from "./shortcuts.js";
export { drawSpectrum, Waterfall } from "./spectrum.js";
export { drawTraces } from "./traces.js";
