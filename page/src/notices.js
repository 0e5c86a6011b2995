// Sentences that go away by themselves.
import { byId, element } from "./dom.js";

const MOST = 3; // at once

/**
 * Errors stay longer and are announced at once.
 * @param {string} text
 */
export const notify = (text, level = "info") => {
  const error = level === "error";
  const notice = element(
    "div",
    { class: `toast ${error ? "error" : ""}` },
    element("span", { "aria-hidden": true, text: error ? "⚠" : "ℹ" }),
    element("span", { text }),
  );
  const place = byId(error ? "alerts" : "notices");
  place.append(notice);
  while (place.children.length > MOST) place.firstChild?.remove();
  setTimeout(() => notice.remove(), error ? 12000 : 5000);
};
