// Keys by name.

/**
 * Calls actions by their keys; not while one types, nor where a key means something to the focused
 * element.
 * @param {Record<string, (event: KeyboardEvent) => void>} actions
 */
export const onKeys = (actions) =>
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (hasMeaning(event.key, /** @type {HTMLElement} */ (event.target))) return;
    if (document.querySelector("dialog[open]")) return;
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action(event);
  });

/**
 * Whether an element takes a key itself.
 * @param {string} key
 * @param {HTMLElement} target
 */
const hasMeaning = (key, target) => {
  const type = target instanceof HTMLInputElement ? target.type : target.tagName;
  if (["number", "text", "SELECT", "TEXTAREA"].includes(type)) return true;
  if (key === " ") return ["BUTTON", "SUMMARY", "checkbox"].includes(type);
  if (!key.startsWith("Arrow")) return false;
  const slides = type === "range" && target.id !== "time-slider";
  return slides || target.getAttribute("role") === "separator";
};
