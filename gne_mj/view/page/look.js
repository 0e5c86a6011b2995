"use strict";
// How things look: theme, colours, numbers and words. Everything else lives in the global GNE.
const GNE = {};

(() => {
  // Blue, light blue, yellow, orange, red: told apart by hue with any colour blindness, and the
  // yellow in the middle is much the lightest.
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

  /** Colour, three numbers from 0 to 1, of an agent that uses this share of its bound. */
  GNE.ramp = (share) => {
    if (share === null || Number.isNaN(share)) return UNKNOWN;
    if (share > 1) return OUTSIDE;
    const above = RAMP.findIndex(([stop]) => share <= stop);
    if (above <= 0) return RAMP[0][1];
    const [[from, a], [to, b]] = [RAMP[above - 1], RAMP[above]];
    return a.map((v, k) => v + ((b[k] - v) * (share - from)) / (to - from));
  };

  GNE.css = (rgb) => `rgb(${rgb.map((v) => Math.round(255 * v)).join(", ")})`;

  GNE.rampGradient = () =>
    `linear-gradient(to right, ${RAMP.map(([s, c]) => `${GNE.css(c)} ${100 * s}%`).join(", ")})`;

  // Okabe and Ito's colours, each readable on the theme's ground.
  const LINES = {
    dark: ["#56b4e9", "#e69f00", "#2fc18c", "#f0e442", "#e87c3a", "#d98cbb", "#f2f2f2", "#5a9bff"],
    light: ["#0072b2", "#c07c00", "#00805c", "#8c7a00", "#d55e00", "#a8518a", "#111111", "#2f62c9"],
  };
  const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3], [12, 5]];

  /** Colour and dash of the k-th line of a plot. */
  GNE.line = (k) => {
    const colours = LINES[GNE.theme()];
    return {
      colour: colours[k % colours.length],
      dash: DASHES[Math.floor(k / colours.length) % DASHES.length],
    };
  };

  /** At most `most` of n indices, evenly chosen. */
  GNE.chosen = (n, most) => {
    if (n <= most) return [...Array(n).keys()];
    return [...Array(most).keys()].map((k) => Math.round((k * (n - 1)) / (most - 1)));
  };

  // ---- theme

  const KEY = "gne_mj.theme";

  const remembered = () => {
    try {
      return localStorage.getItem(KEY);
    } catch {
      return null; // storage may be forbidden, as in a sandboxed file
    }
  };

  GNE.theme = () => document.documentElement.dataset.theme;

  GNE.setTheme = (theme, remember = true) => {
    document.documentElement.dataset.theme = theme;
    colours.clear();
    if (!remember) return;
    try {
      localStorage.setItem(KEY, theme);
    } catch {
      // not remembered then
    }
  };

  const colours = new Map();

  /** A colour of the theme, by the name of its CSS variable. */
  GNE.colour = (name) => {
    if (!colours.has(name)) {
      const style = getComputedStyle(document.documentElement);
      colours.set(name, style.getPropertyValue(`--${name}`).trim());
    }
    return colours.get(name);
  };

  const light = matchMedia("(prefers-color-scheme: light)").matches;
  GNE.setTheme(remembered() || (light ? "light" : "dark"), false);

  const still = matchMedia("(prefers-reduced-motion: reduce)");
  GNE.reducedMotion = () => still.matches;

  // ---- numbers and words

  /** A number in few characters: three digits, a real minus sign. */
  GNE.number = (value, digits = 3) => {
    if (value === null || value === undefined || Number.isNaN(value)) return "–";
    const size = Math.abs(value);
    let text;
    if (size !== 0 && (size < 1e-3 || size >= 1e5)) text = value.toExponential(digits - 1);
    else text = String(Number(value.toPrecision(digits)));
    return text.replace("-", "−").replace("e+", "e");
  };

  GNE.fixed = (value, decimals) =>
    value === null || Number.isNaN(value)
      ? "–"
      : value
          .toFixed(decimals)
          .replace(/^-(?=[0.]*$)/, "")
          .replace("-", "−");

  /** Decimals that tell three digits of the greatest value, so that all texts stay as long. */
  GNE.decimals = (greatest) =>
    greatest > 0 ? Math.min(Math.max(2 - Math.floor(Math.log10(greatest)), 0), 8) : 2;

  /** "0.42 m/s" or "0.42" */
  GNE.withUnit = (value, unit) => GNE.number(value) + (unit ? ` ${unit}` : "");

  const SYMBOLS = { ok: "✓", going: "▸", bad: "⚠", unknown: "?" };

  /** Kind of status (ok, going, bad, unknown), and its symbol and words. */
  GNE.status = (word) => {
    let kind = "unknown";
    if (/^(converged|completed)$/.test(word)) kind = "ok";
    else if (/left|diverged|too_small/.test(word)) kind = "bad";
    else if (word === "running") kind = "going";
    return { kind, symbol: SYMBOLS[kind], words: String(word || "unknown").replaceAll("_", " ") };
  };

  GNE.outside = (word) => GNE.status(word).kind === "bad";

  /** An element: tag, attributes (class, text, on..., others), children. */
  GNE.element = (tag, attributes = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (value === undefined || value === null || value === false) continue;
      if (name === "text") made.textContent = value;
      else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
      else made.setAttribute(name, value === true ? "" : value);
    }
    made.append(...children.filter((child) => child !== null && child !== undefined));
    return made;
  };

  GNE.byId = (id) => document.getElementById(id);
})();
