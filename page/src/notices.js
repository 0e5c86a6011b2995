// Sentences that go away by themselves, or when they are closed.
import { byId, element } from "./dom.js";

const MOST = 3; // at once
const STAYS = { info: 5000, error: 12000 }; // ms

/** @type {Map<string, () => void>} */
const shown = new Map(); // what takes a sentence away, by what it is about

/**
 * Says something once: another sentence about the same takes its place. Errors stay longer and are
 * announced at once.
 * @param {string} text
 * @param {"info" | "error"} level
 * @param {string} about
 */
export const notify = (text, level = "info", about = text) => {
  shown.get(about)?.();
  const error = level === "error";
  const notice = element(
    "div",
    { class: `toast ${error ? "error" : ""}` },
    element("span", { "aria-hidden": true, text: error ? "⚠" : "ℹ" }),
    element("span", { class: "said", text }),
    element("button", {
      type: "button",
      class: "icon",
      text: "✕",
      "aria-label": "close this message",
      onclick: () => close(),
    }),
  );
  const due = setTimeout(() => close(), STAYS[level]);
  const close = () => {
    clearTimeout(due);
    notice.remove();
    if (shown.get(about) === close) shown.delete(about);
  };
  shown.set(about, close);
  const place = byId(error ? "alerts" : "notices");
  place.append(notice);
  while (place.children.length > MOST) place.firstChild?.remove();
};
