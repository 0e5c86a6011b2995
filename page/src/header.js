// The line on top: clock, a chip for the status of each system, and the banner of an exit.
import { byId, element } from "./dom.js";
import { fixed, number, outside, status } from "./words.js";
/** @import { Scene, Source, State, System } from "./types.d.ts" */

export class Header {
  chipKey = ""; // of what the chips say
  bannerText = "";

  /** @param {(time: number) => void} lead to a moment */
  constructor(lead) {
    this.lead = lead;
  }

  /**
   * @param {Scene} meta
   * @param {Source} source
   */
  show(meta, source) {
    byId("time").textContent = source.time.toFixed(2);
    byId("duration").textContent = number(meta.duration, 6);
    byId("pace").textContent = source.pace;
    this.showChips(meta.systems, source);
    this.showBanner(meta.systems, source);
  }

  /**
   * @param {System[]} systems
   * @param {Source} source
   */
  showChips(systems, source) {
    const key = JSON.stringify(systems.map((system) => source.stateOf(system)));
    if (key === this.chipKey) return;
    this.chipKey = key;
    const of = source.seekable ? "closest approach" : "closest approach so far";
    const chips = systems.map((system) => chipOf(system, source.stateOf(system), of, this.lead));
    byId("chips").replaceChildren(...chips);
    announce(systems, source);
  }

  /**
   * @param {System[]} systems
   * @param {Source} source
   */
  showBanner(systems, source) {
    const out = systems.filter((system) => outside(source.stateOf(system).status));
    const text = out.map((system) => exitText(system, source)).join("   ");
    byId("banner-show").hidden = !source.seekable || !(out[0]?.name in source.exits);
    if (text === this.bannerText) return; // closed, perhaps
    this.bannerText = text;
    byId("banner").hidden = !text;
    byId("banner-text").textContent = text;
  }
}

/**
 * A sentence in the banner, in place of a scene.
 * @param {string} text
 */
export const warn = (text) => {
  byId("banner-text").textContent = text;
  byId("banner").hidden = false;
  byId("waiting").hidden = true;
};

/**
 * Tells a screen reader of changes of status; margins change too often for that.
 * @param {System[]} systems
 * @param {Source} source
 */
const announce = (systems, source) => {
  const words = systems.map(
    (system) => `${system.name}: ${status(source.stateOf(system).status).words}`,
  );
  const text = words.join(", ");
  const place = byId("announcement");
  if (place.textContent !== text) place.textContent = text;
};

/**
 * @param {System} system
 * @param {State} state
 * @param {string} of what the margin is
 * @param {(time: number) => void} lead to a moment
 */
const chipOf = (system, state, of, lead) => {
  const { kind, symbol, words } = status(state.status);
  const about = [
    system.game,
    `${system.agents} ${system.agent_name}s`,
    `information: ${system.information}`,
    `mode: ${system.mode}`,
    `engine: ${system.engine}`,
  ];
  return element(
    "div",
    {
      class: `chip ${kind}`,
      title: [state.message, about.join(" · ")].filter(Boolean).join("\n"),
    },
    element("span", { class: "sign", "aria-hidden": true, text: symbol }),
    element("span", {}, element("b", { text: system.name }), `: ${words}`),
    marginOf(state, of, lead),
  );
};

/**
 * The least margin, which leads to where it was.
 * @param {State} state
 * @param {string} of what it is
 * @param {(time: number) => void} lead
 */
const marginOf = ({ status: word, margin, margin_name: name, margin_time: time }, of, lead) => {
  const none = word === "not_begun" ? "no margin yet" : "no margin known";
  if (typeof margin !== "number") return element("span", { class: "margin", text: none });
  const text = `${of}: margin ${number(margin)}${name ? ` · ${name}` : ""}`;
  if (typeof time !== "number") return element("span", { class: "margin", text });
  const when = ` at ${fixed(time, time < 10 ? 2 : 1)} s`;
  const onclick = () => lead(time);
  const title = "Show it";
  return element("button", { type: "button", class: "margin", text: text + when, title, onclick });
};

/**
 * @param {System} system
 * @param {Source} source
 */
const exitText = (system, source) => {
  const { status: word, message } = source.stateOf(system);
  const at = source.exits[system.name];
  const when = at === undefined ? "" : ` at ${number(at, 4)} s`;
  return `${system.name}: ${status(word).words}${when}${message ? `: ${message}` : ""}`;
};
