// Dark or light, and the colours that the style sheet has for it.

const KEY = "gne_mj.theme";
const colours = new Map();

const remembered = () => {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null; // storage may be forbidden, as in a sandboxed file
  }
};

/** @returns {"dark" | "light"} */
export const theme = () => (document.documentElement.dataset.theme === "dark" ? "dark" : "light");

/** @param {string} name */
export const setTheme = (name, remember = true) => {
  document.documentElement.dataset.theme = name;
  colours.clear();
  if (!remember) return;
  try {
    localStorage.setItem(KEY, name);
  } catch {
    // not remembered then
  }
};

/**
 * A colour of the theme, by the name of its CSS variable.
 * @param {string} name
 */
export const colour = (name) => {
  if (!colours.has(name)) {
    const style = getComputedStyle(document.documentElement);
    colours.set(name, style.getPropertyValue(`--${name}`).trim());
  }
  return colours.get(name);
};

const still = matchMedia("(prefers-reduced-motion: reduce)");
export const reducedMotion = () => still.matches;

const light = matchMedia("(prefers-color-scheme: light)").matches;
setTheme(remembered() || (light ? "light" : "dark"), false);
