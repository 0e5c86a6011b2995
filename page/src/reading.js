// Values of a plot by the keyboard, in words for who hears them.
import { MOST_CHIPS } from "./chart.js";
import { element } from "./dom.js";
import { STEP } from "./window.js";
import { fixed } from "./words.js";
/** @import uPlot from "uplot" */
/** @import { Plot } from "./plot.js" */

const FAR = 10; // samples that a key goes with shift

export class Reading {
  /** @param {Plot} plot */
  constructor(plot) {
    this.plot = plot;
    this.spoken = element("span", { class: "unseen", role: "status" });
  }

  /**
   * Keys of a plot that has the focus read its values, and zoom.
   * @param {KeyboardEvent} event
   */
  key(event) {
    const u = this.plot.uplot;
    if (!u || event.ctrlKey || event.metaKey || event.altKey) return;
    const last = u.data[0].length - 1;
    const now = this.plot.hovered ?? u.valToIdx(this.plot.plots.now);
    const by = event.shiftKey ? FAR : 1;
    /** @type {Record<string, () => void>} */
    const actions = {
      ArrowLeft: () => this.at(Math.max(now - by, 0)),
      ArrowRight: () => this.at(Math.min(now + by, last)),
      Home: () => this.at(u.valToIdx(this.plot.plots.window[0])),
      End: () => this.at(u.valToIdx(this.plot.plots.window[1])),
      Escape: () => this.at(null),
      "+": () => this.plot.plots.zoom(STEP, u.data[0][now]),
      "=": () => this.plot.plots.zoom(STEP, u.data[0][now]),
      "-": () => this.plot.plots.zoom(1 / STEP, u.data[0][now]),
      0: () => this.plot.plots.showAll(),
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    event.stopPropagation(); // else the scene would turn, or time go on
    actions[event.key]();
  }

  /** @param {number | null} i of a sample */
  at(i) {
    const u = this.plot.uplot;
    if (!u) return;
    this.plot.hovered = i;
    const left = i === null ? -10 : u.valToPos(u.data[0][i], "x");
    u.setCursor({ left, top: i === null ? -10 : 1 }, false);
    this.plot.hovered = i;
    this.plot.writeValues();
    this.spoken.textContent = i === null ? "" : this.sentence(u, i);
  }

  /**
   * @param {uPlot} u
   * @param {number} i
   */
  sentence(u, i) {
    const { spec } = this.plot;
    const on = this.plot.lines.on.slice(0, MOST_CHIPS);
    const values = on.map((k) => `${this.plot.lines.nameOf(k)} ${this.plot.valueText(k, i)}`);
    return `${fixed(u.data[0][i], 2)} s: ${values.join(", ")} ${spec.unit}`;
  }
}
