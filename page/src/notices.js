// Sentences that go away by themselves, or when they are closed. They stand over the 3-D view, or on
// a small window above the transport, where they cover nothing.
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
  place.prepend(notice); // so that those that are read stay where they are
  while (place.children.length > MOST) place.lastChild?.remove();
};

/**
 * Takes away what was said about something, as it holds no more.
 * @param {string} about
 */
export const dismiss = (about) => shown.get(about)?.();

/** Keeps notes above the legend, however many lines it has. */
export const placeNotes = () => {
  const legend = byId("legend");
  const place = () => {
    const below = innerHeight - legend.getBoundingClientRect().top;
    byId("notes").style.setProperty("--below", `${below}px`);
  };
  new ResizeObserver(place).observe(legend);
};
