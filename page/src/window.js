// The stretch of time that all plots show, and how wheels, drags and fingers change it.
import { element } from "./dom.js";
/** @import uPlot from "uplot" */
/** @import { Plot } from "./plot.js" */

const NARROWEST = 1e-4; // of the whole, up to which time can be looked at
export const STEP = 0.7; // a turn of the wheel, or a press of a button
const SLOP = 4; // px, up to which a hand is where it was

/** @typedef {[number, number]} Stretch from where to where */

/**
 * A stretch that is narrower or wider by a factor, about a point that stays where it is.
 * @param {Stretch} stretch
 * @param {number} around
 * @param {number} factor
 * @returns {Stretch}
 */
export const scaled = ([from, to], around, factor) => [
  around - (around - from) * factor,
  around + (to - around) * factor,
];

/**
 * The part of a stretch that lies in the whole, from 0; null if it is the whole, or all but empty.
 * @param {Stretch} stretch
 * @param {number} whole
 * @returns {Stretch | null}
 */
export const within = ([from, to], whole) => {
  const width = Math.max(to - from, NARROWEST * whole);
  if (!(width < 0.999 * whole)) return null;
  const begin = Math.min(Math.max(from, 0), whole - width);
  return [begin, begin + width];
};

/**
 * What a plot does where it is touched: time beside its axis, values beside theirs, and both over
 * the lines, where a single finger or the mouse alone goes to a time.
 */
export class Hands {
  /**
   * @param {Plot} plot
   * @param {uPlot} u
   */
  constructor(plot, u) {
    this.plot = plot;
    this.u = u;
    this.mark = element("div", { class: "stretch", hidden: true });
    u.over.append(this.mark);
    /** @type {Map<number, {x: number, y: number}>} */
    this.down = new Map(); // fingers, or the mouse
    /** @type {"seek" | "stretch" | "time" | "values" | "pinch" | null} */
    this.doing = null;
    this.begun = 0; // where a stretch begins, px
    u.root.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    u.root.addEventListener("pointerdown", (event) => this.press(event));
    u.root.addEventListener("pointermove", (event) => this.drag(event));
    for (const name of /** @type {const} */ (["pointerup", "pointercancel"]))
      u.root.addEventListener(name, (event) => this.release(event));
    u.root.addEventListener("dblclick", () => plot.plots.showAll());
  }

  /**
   * Which part of the plot a point is in, and where in it.
   * @param {MouseEvent} event
   */
  at({ clientX, clientY }) {
    const box = this.u.over.getBoundingClientRect();
    const [x, y] = [clientX - box.left, clientY - box.top];
    const part = x < 0 ? "values" : y > box.height ? "time" : "lines";
    return { part, x, y };
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    const { part, x, y } = this.at(event);
    // over the lines the wheel scrolls the page; with ctrl, as pads say of two fingers, it zooms
    if (part === "lines" && !event.ctrlKey) return;
    event.preventDefault();
    const factor = event.deltaY > 0 ? 1 / STEP : STEP;
    if (part === "values") this.plot.zoomValues(factor, y);
    else this.plot.plots.zoom(factor, this.u.posToVal(x, "x"));
  }

  /** @param {PointerEvent} event */
  press(event) {
    if (event.button !== 0) return;
    const { part, x, y } = this.at(event);
    this.down.set(event.pointerId, { x, y });
    this.u.root.setPointerCapture(event.pointerId);
    if (this.down.size > 1) this.doing = "pinch";
    else if (part === "values" || part === "time") this.doing = part;
    else if (event.shiftKey || !this.plot.plots.source.seekable)
      this.doing = event.pointerType === "touch" ? "time" : "stretch";
    else this.doing = "seek";
    this.begun = x;
    // of a finger it is known later whether it goes to a time, scrolls, or is the first of two
    if (this.doing === "seek" && event.pointerType !== "touch") this.seek(x);
  }

  /** @param {PointerEvent} event */
  drag(event) {
    const before = this.down.get(event.pointerId);
    if (!before) return;
    const { x, y } = this.at(event);
    const { plots } = this.plot;
    const moved = event.pointerType !== "touch" || Math.abs(x - this.begun) > SLOP;
    if (this.doing === "seek" && moved) this.seek(x);
    if (this.doing === "stretch") this.showMark(x);
    if (this.doing === "time") plots.pan(this.u.posToVal(before.x, "x") - this.u.posToVal(x, "x"));
    if (this.doing === "values") this.plot.panValues(before.y, y);
    if (this.doing === "pinch") this.pinch(event.pointerId, x);
    this.down.set(event.pointerId, { x, y });
  }

  /**
   * Two fingers stretch time between them.
   * @param {number} finger that moves
   * @param {number} x where it is now
   */
  pinch(finger, x) {
    const other = [...this.down].find(([id]) => id !== finger)?.[1].x;
    const before = this.down.get(finger)?.x;
    if (other === undefined || before === undefined) return;
    const [wide, now] = [Math.abs(before - other), Math.abs(x - other)];
    if (wide > 10 && now > 10) this.plot.plots.zoom(wide / now, this.u.posToVal(other, "x"));
  }

  /** @param {PointerEvent} event */
  release(event) {
    const stands = this.down.get(event.pointerId);
    this.down.delete(event.pointerId);
    this.mark.hidden = true;
    if (this.doing === "seek" && stands && event.type === "pointerup") this.seek(stands.x);
    if (this.doing === "stretch" && stands && Math.abs(stands.x - this.begun) > SLOP) {
      const ends = [this.begun, stands.x].map((x) => this.u.posToVal(x, "x"));
      this.plot.plots.show([Math.min(...ends), Math.max(...ends)]);
    }
    if (!this.down.size) this.doing = null;
  }

  /** @param {number} x */
  seek(x) {
    this.plot.plots.callbacks.seek(this.u.posToVal(x, "x"));
  }

  /** @param {number} x */
  showMark(x) {
    this.mark.hidden = false;
    this.mark.style.left = `${Math.min(x, this.begun)}px`;
    this.mark.style.width = `${Math.abs(x - this.begun)}px`;
  }
}
