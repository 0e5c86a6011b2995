// Vertical lines over a chart, at a time.
import uPlot from "uplot";
import { element } from "./dom.js";

export class TimeLine {
  /** @param {HTMLElement} root */
  constructor(root) {
    this.root = root;
    this.x = NaN;
    this.seen = true;
  }

  /**
   * @param {uPlot} u
   * @param {number} time
   */
  place(u, time) {
    const x = Math.round(u.valToPos(time, "x"));
    const seen = x >= 0 && x <= u.bbox.width / uPlot.pxRatio;
    if (this.x === x && this.seen === seen) return; // painting anew costs more than all else here
    this.x = x;
    this.seen = seen;
    this.root.style.transform = `translateX(${x}px)`;
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
