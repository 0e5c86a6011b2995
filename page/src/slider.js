// A slider with a number beside it, for a number of the running simulation.
import { element } from "./dom.js";
import { withUnit } from "./words.js";
/** @import { Control } from "./types.d.ts" */

const PER_SECOND = 12; // values sent while a slider is dragged
const ECHO = 400; // ms within which the simulation's answer must not pull it back under the hand

/**
 * Calls at most so many times per second; the last value is never dropped.
 * @param {number} perSecond
 * @param {(value: number) => void} call
 */
const atMost = (perSecond, call) => {
  /** @type {number | null} */
  let waiting = null;
  let latest = NaN;
  return (/** @type {number} */ value) => {
    latest = value;
    waiting ??= setTimeout(() => {
      waiting = null;
      call(latest);
    }, 1000 / perSecond);
  };
};

export class Slider {
  /**
   * @param {Control} control
   * @param {(value: number) => void} changed
   */
  constructor(control, changed) {
    this.control = control;
    this.changed = atMost(PER_SECOND, changed);
    this.value = control.value;
    this.touched = -Infinity; // when it was last dragged
    this.typing = false; // half a number may be in the field
    this.range = this.makeRange();
    this.number = this.makeNumber();
    this.root = element(
      "div",
      { class: "control" },
      element("span", { class: "control-label", text: control.label }),
      this.range,
      this.number,
      element("span", { class: "unit", text: control.unit }),
    );
    this.show();
  }

  makeRange() {
    const { key, label } = this.control;
    const attributes = { type: "range", min: 0, max: 1, step: 0.002, title: key };
    const range = element("input", { ...attributes, "aria-label": label });
    range.oninput = () => {
      this.touched = performance.now();
      this.value = Number(this.valueAt(Number(range.value)).toPrecision(3));
      this.show();
      this.changed(this.value);
    };
    return range;
  }

  makeNumber() {
    const { label, min, max } = this.control;
    const attributes = { type: "number", min, max, step: "any" };
    const number = element("input", { ...attributes, "aria-label": `${label}, as a number` });
    number.oninput = () => (this.typing = true);
    number.onblur = () => {
      this.typing = false;
      this.show(); // nothing, or half a number, was left there
    };
    number.onchange = () => {
      this.typing = false;
      const value = Number(number.value);
      if (number.value !== "" && Number.isFinite(value)) this.changed((this.value = value));
    };
    return number;
  }

  get logarithmic() {
    return this.control.scale === "log" && this.control.min > 0;
  }

  /**
   * Where a value is along the slider, from 0 to 1.
   * @param {number} value
   */
  placeOf(value) {
    const { min, max } = this.control;
    if (this.logarithmic) return Math.log(value / min) / Math.log(max / min);
    return (value - min) / (max - min);
  }

  /** @param {number} place */
  valueAt(place) {
    const { min, max } = this.control;
    return this.logarithmic ? min * (max / min) ** place : min + (max - min) * place;
  }

  show() {
    const place = this.placeOf(this.value);
    this.range.value = String(place);
    this.range.setAttribute("aria-valuetext", withUnit(this.value, this.control.unit));
    this.range.style.setProperty("--done", `${100 * place}%`);
    if (!this.typing) this.number.value = String(Number(this.value.toPrecision(3)));
  }

  /**
   * The simulation's value, shown when no hand is on the slider.
   * @param {number} value
   */
  follow(value) {
    this.value = value;
    clearTimeout(this.told);
    const wait = this.touched + ECHO - performance.now();
    if (wait > 0) this.told = setTimeout(() => this.follow(value), wait);
    else this.show();
  }
}
