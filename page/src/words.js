// Numbers and states in words.

/**
 * A number in few characters: three digits, a real minus sign.
 * @param {number | null | undefined} value
 */
export const number = (value, digits = 3) => {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  let text;
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) text = value.toExponential(digits - 1);
  else text = String(Number(value.toPrecision(digits)));
  return text.replace("-", "−").replace("e+", "e");
};

/**
 * @param {number | null} value
 * @param {number} decimals
 */
export const fixed = (value, decimals) =>
  value === null || Number.isNaN(value)
    ? "–"
    : value
        .toFixed(decimals)
        .replace(/^-(?=[0.]*$)/, "")
        .replace("-", "−");

/**
 * Decimals that tell three digits of the greatest value, so that all texts stay as long.
 * @param {number} greatest
 */
export const decimals = (greatest) =>
  greatest > 0 ? Math.min(Math.max(2 - Math.floor(Math.log10(greatest)), 0), 8) : 2;

/**
 * "0.42 m/s" or "0.42"
 * @param {number | null} value
 * @param {string} unit
 */
export const withUnit = (value, unit) => number(value) + (unit ? ` ${unit}` : "");

const SYMBOLS = { ok: "✓", going: "▸", still: "‖", bad: "⚠", unknown: "?" };

/**
 * Kind of a status, and its symbol and words.
 * @param {string} word
 */
export const status = (word) => {
  /** @type {keyof typeof SYMBOLS} */
  let kind = "unknown";
  if (/^(converged|completed)$/.test(word)) kind = "ok";
  else if (/left|outside|diverged|too_small/.test(word)) kind = "bad";
  else if (word === "running") kind = "going";
  else if (/^(paused|not_begun|not_connected)$/.test(word)) kind = "still";
  return { kind, symbol: SYMBOLS[kind], words: String(word || "unknown").replaceAll("_", " ") };
};

/**
 * A share of a bound; beyond it never "100 %".
 * @param {number} share
 */
export const percent = (share) => {
  if (!(share > 1)) return Number.isFinite(share) ? `${(100 * share).toFixed(0)} %` : "";
  const text = (100 * share).toFixed(share < 1.1 ? 1 : 0);
  return Number.isFinite(share) && Number(text) > 100 ? `${text} %` : "outside";
};

/** @param {string} word */
export const outside = (word) => status(word).kind === "bad";
