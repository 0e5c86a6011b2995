// Vertical lines over a chart, at a time.
import { element } from "./dom.js";
/** @import uPlot from "uplot" */

export class TimeLine {
  /** @param {HTMLElement} root */
  constructor(root) {
    this.root = root;
    this.x = NaN;
  }

  /**
   * @param {uPlot} u
   * @param {number} time
   */
  place(u, time) {
    const x = Math.round(u.valToPos(time, "x"));
    if (this.x === x) return; // painting anew costs more than all else here
    this.x = x;
    this.root.style.transform = `translateX(${x}px)`;
    const seen = x >= 0 && x <= u.over.clientWidth;
    this.root.style.visibility = seen ? "visible" : "hidden";
  }
}

/** @param {string} whose run, if there are several */
export const exitLine = (whose) =>
  element(
    "div",
    { class: "exit-line", hidden: true },
    element("span", { text: whose ? `left the set: ${whose}` : "left the set" }),
  );
