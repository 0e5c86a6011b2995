// Elements of the document.
/** @import { Elements } from "./types.d.ts" */

/**
 * An element of index.html.
 * @template {keyof Elements} Id
 * @param {Id} id
 * @returns {Elements[Id]}
 */
export const byId = (id) => /** @type {Elements[Id]} */ (document.getElementById(id));

/**
 * A new element: tag, attributes (class, text, on..., others), children.
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, any>} attributes
 * @param {(Node | string | null | undefined)[]} children
 * @returns {HTMLElementTagNameMap[Tag]}
 */
export const element = (tag, attributes = {}, ...children) => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name === "text") made.textContent = value;
    else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name.startsWith("aria-")) made.setAttribute(name, String(value));
    else made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
};

/**
 * Says whether a toggle button is pressed.
 * @param {HTMLElement} button
 * @param {boolean} pressed
 */
export const press = (button, pressed) => button.setAttribute("aria-pressed", String(pressed));
