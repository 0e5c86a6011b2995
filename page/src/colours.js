// Colours and dashes that stand for numbers.
import { theme } from "./theme.js";
/** @import { Palette } from "./types.d.ts" */

// Blue, light blue, yellow, orange, red: told apart by hue with any colour blindness, and the
// yellow in the middle is much the lightest.
/** @type {[number, number[]][]} */
const RAMP = [
  [0.0, [0.16, 0.38, 0.83]],
  [0.4, [0.36, 0.66, 0.9]],
  [0.56, [0.66, 0.84, 0.83]],
  [0.72, [0.97, 0.85, 0.3]],
  [0.9, [0.96, 0.55, 0.12]],
  [1.0, [0.88, 0.27, 0.08]],
];
const OUTSIDE = [0.86, 0.02, 0.16];
const UNKNOWN = [0.55, 0.58, 0.62];

/**
 * Colour, three numbers from 0 to 1, of an agent that uses this share of its bound.
 * @param {number | null} share
 */
export const ramp = (share) => {
  if (share === null || Number.isNaN(share)) return UNKNOWN;
  if (share > 1) return OUTSIDE;
  const above = RAMP.findIndex(([stop]) => share <= stop);
  if (above <= 0) return RAMP[0][1];
  const [[from, a], [to, b]] = [RAMP[above - 1], RAMP[above]];
  return a.map((v, k) => v + ((b[k] - v) * (share - from)) / (to - from));
};

/** @param {number[]} rgb */
export const css = (rgb) => `rgb(${rgb.map((v) => Math.round(255 * v)).join(", ")})`;

export const rampGradient = () =>
  `linear-gradient(to right, ${RAMP.map(([s, c]) => `${css(c)} ${100 * s}%`).join(", ")})`;

/** @type {Palette} */
let palette = { dark: [], light: [] };
const HUES = 8; // of a palette; those that come again have another dash too
const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3], [12, 5]];

/**
 * The colours of lines, which figures have too.
 * @param {Palette} given
 */
export const setPalette = (given) => (palette = given);

/**
 * Dash of the lines of one of several runs.
 * @param {number} run
 */
export const dashOf = (run) => DASHES[run];

/**
 * Colour and dash of the k-th line of a plot.
 * @param {number} k
 */
export const line = (k) => {
  const colours = palette[theme()];
  return {
    colour: colours[k % colours.length],
    dash: DASHES[Math.floor(k / HUES) % DASHES.length],
  };
};
