// Colours and dashes that stand for numbers.
import { theme } from "./theme.js";

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

// Okabe and Ito's colours, each readable on the theme's ground.
const LINES = {
  dark: ["#56b4e9", "#e69f00", "#2fc18c", "#f0e442", "#e87c3a", "#d98cbb", "#f2f2f2", "#5a9bff"],
  light: ["#0072b2", "#c07c00", "#00805c", "#8c7a00", "#d55e00", "#a8518a", "#111111", "#2f62c9"],
};
const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3], [12, 5]];

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
  const colours = LINES[theme()];
  return {
    colour: colours[k % colours.length],
    dash: DASHES[Math.floor(k / colours.length) % DASHES.length],
  };
};
