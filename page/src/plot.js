// One plot over time: its caption, a chip for each line, and uPlot's chart.
import uPlot from "uplot";
import { MOST_CHIPS, optionsOf } from "./chart.js";
import { line } from "./colours.js";
import { element } from "./dom.js";
import { colour } from "./theme.js";
import { decimals, fixed } from "./words.js";
/** @import { Plots } from "./plots.js" */
/** @import { Spec } from "./specs.js" */
/** @import { Agent } from "./types.d.ts" */

/**
 * A little TeX as text with subscripts: "y_i - y_{i-1}"; null if it holds more than that.
 * @param {string} tex
 */
const symbolOf = (tex) => {
  const plain = tex
    .replace(/\\(lVert|rVert|Vert|\|)/g, "‖")
    .replace(/\\(left|right|,|;|mathrm|text)/g, "")
    .replace(/-/g, "−");
  if (!plain || /[\\^]/.test(plain)) return null;
  const made = element("span", { class: "symbol" });
  for (const [, sub, one, other] of plain.matchAll(/_\{([^}]*)\}|_(\w)|([^_]+)/g))
    made.append(other ?? element("sub", { text: sub ?? one }));
  return made;
};

/**
 * @param {Spec} spec
 * @param {HTMLElement} note
 */
const captionOf = (spec, note) =>
  element(
    "figcaption",
    {},
    element("span", { class: "plot-system", text: spec.system.name }),
    element("span", { class: "plot-title", text: spec.title }),
    symbolOf(spec.symbol),
    note,
  );

const exitLine = () =>
  element(
    "div",
    { class: "exit-line", hidden: true },
    element("span", { text: "left the set" }),
  );

/**
 * A short piece of a line as it is drawn in the plot.
 * @param {{colour: string, dash: number[]}} look
 */
const swatchOf = (look) => {
  const made = element("canvas", { class: "swatch", width: 28, height: 6, "aria-hidden": true });
  const context = /** @type {CanvasRenderingContext2D} */ (made.getContext("2d"));
  Object.assign(context, { strokeStyle: look.colour, lineWidth: 5 });
  context.setLineDash(look.dash.map((length) => 1.6 * length));
  context.moveTo(0, 3);
  context.lineTo(28, 3);
  context.stroke();
  return made;
};

/** A vertical line over the chart, at a time. */
class TimeLine {
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
    this.root.style.visibility = Number.isFinite(x) ? "visible" : "hidden";
  }
}

export class Plot {
  /**
   * @param {Plots} plots
   * @param {Spec} spec
   */
  constructor(plots, spec) {
    this.plots = plots;
    this.spec = spec;
    /** @type {number | null} */
    this.hovered = null; // index into the samples
    /** @type {number | null} */
    this.focused = null; // the line that is pointed at
    /** @type {uPlot | null} */
    this.uplot = null; // from when there is a size
    this.mouseInside = false;
    this.chips = element("div", { class: "plot-chips" });
    this.chart = element("div", { class: "chart" });
    const shown = spec.columns.length;
    this.several = spec.total > shown ? `${shown} of ${spec.total} shown` : "";
    this.note = element("span", { class: "plot-note", text: this.several });
    const name = `${spec.system.name}: ${spec.title} over time`;
    this.root = element("figure", { class: "plot", "aria-label": name });
    this.root.append(captionOf(spec, this.note), this.chips, this.chart);
    this.timeLine = new TimeLine(element("div", { class: "time-line" }));
    this.exitLine = new TimeLine(exitLine());
    this.values = shown > MOST_CHIPS ? [] : spec.labels.map((_, k) => this.addChip(k));
    this.readout = element("span", { class: "readout" });
    if (!this.values.length) this.chips.append(this.readout);
  }

  /**
   * Colour and dash of the k-th line.
   * @param {number} k
   */
  lineOf(k) {
    const { spec } = this;
    if (spec.total === 1) return { colour: colour("text"), dash: [] };
    return line(spec.agents[k] ?? spec.columns[k]);
  }

  /**
   * The chip of the k-th line; returns where its value is written.
   * @param {number} k
   */
  addChip(k) {
    const { spec } = this;
    const value = element("span", { class: "chip-value" });
    const attributes = {
      class: "plot-chip",
      title: `${spec.noun} ${spec.labels[k]}`.trim(),
      onmouseenter: () => this.point(k),
      onmouseleave: () => this.point(null),
    };
    const text = spec.total === 1 ? "" : spec.shorts[k];
    this.chips.append(element("span", attributes, swatchOf(this.lineOf(k)), text, value));
    return value;
  }

  /**
   * One line is pointed at: it stands out, and so does its agent in the scene.
   * @param {number | null} k
   */
  point(k) {
    this.focus(k);
    this.tell(k);
  }

  /** @param {number | null} k */
  tell(k) {
    const agent = k === null ? null : this.spec.agents[k];
    const which = agent === null ? null : { system: this.spec.system.name, agent };
    this.plots.callbacks.highlight(which, this);
  }

  /** @param {number | null} k */
  focus(k) {
    if (this.focused === k) return;
    this.focused = k;
    this.markChip(k);
    this.uplot?.setSeries(k === null ? /** @type {any} */ (null) : k + 1, { focus: true });
  }

  /** @param {number | null} k */
  markChip(k) {
    this.values.forEach((value, each) =>
      value.parentElement?.classList.toggle("chosen", each === k),
    );
  }

  /** @param {Agent | null} which */
  highlight(which) {
    const own = which?.system === this.spec.system.name;
    const k = own ? this.spec.agents.indexOf(which.agent) : -1;
    this.focus(k < 0 ? null : k);
  }

  // ---- uPlot

  /**
   * @param {number} width
   * @param {number} height
   */
  setSize(width, height) {
    if (this.uplot) return this.uplot.setSize({ width, height });
    this.uplot = new uPlot(optionsOf(this, width, height), this.data(), this.chart);
    this.uplot.over.append(this.timeLine.root, this.exitLine.root);
    this.listen(this.uplot, this.uplot.over);
  }

  /** @returns {uPlot.AlignedData} */
  data() {
    const { store } = this.plots.source;
    return [store.time, ...this.spec.columns.map((k) => store.column(this.spec.array, k))];
  }

  /**
   * The mouse is somewhere over this plot, or over one beside it.
   * @param {uPlot} u
   */
  hover(u) {
    const { idx = null, left = -1 } = u.cursor;
    this.hovered = left >= 0 ? idx : null;
    this.writeValues();
  }

  /**
   * @param {number | null} k
   * @param {{focus?: boolean}} how
   */
  focusedByMouse(k, how) {
    if (how?.focus === undefined || this.uplot?.cursor.left === undefined) return;
    if (!this.mouseInside) return;
    const focused = k === null || k === undefined ? null : k - 1;
    if (focused === this.focused) return;
    this.focused = focused;
    this.markChip(focused);
    this.tell(focused);
  }

  /**
   * @param {uPlot} u
   * @param {HTMLElement} over
   */
  listen(u, over) {
    let dragging = false;
    const seek = (/** @type {MouseEvent} */ event) => {
      const left = event.clientX - over.getBoundingClientRect().left;
      this.plots.callbacks.seek(u.posToVal(left, "x"));
    };
    over.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !this.plots.source.seekable) return;
      dragging = true;
      over.setPointerCapture(event.pointerId);
      seek(event);
    });
    over.addEventListener("pointermove", (event) => dragging && seek(event));
    over.addEventListener("pointerup", () => (dragging = false));
    over.addEventListener("pointercancel", () => (dragging = false));
    over.addEventListener("mouseenter", () => (this.mouseInside = true));
    over.addEventListener("mouseleave", () => {
      this.mouseInside = false;
      this.point(null);
    });
  }

  refresh() {
    this.uplot?.setData(this.data(), true);
    this.writeValues();
  }

  /** @param {number} t */
  setTime(t) {
    if (!this.uplot) return;
    this.timeLine.place(this.uplot, t);
    const exit = this.plots.source.exits[this.spec.system.name];
    const { root } = this.exitLine;
    root.hidden = !Number.isFinite(exit);
    if (root.hidden) return;
    this.exitLine.place(this.uplot, exit);
    root.classList.toggle("leftward", exit > 0.7 * this.plots.span());
  }

  /** Values at the mouse, or now. */
  writeValues() {
    const u = this.uplot;
    if (!u) return;
    const digits = decimals(this.plots.source.store.greatest(this.spec.array));
    const i = this.hovered ?? u.valToIdx(this.plots.now);
    const hover = this.hovered === null ? "" : `at ${fixed(u.data[0][i] ?? null, 2)} s`;
    this.note.textContent = [this.several, hover].filter(Boolean).join(" · ");
    const value = (/** @type {number} */ k) => fixed(u.data[k + 1][i] ?? null, digits);
    this.values.forEach((place, k) => (place.textContent = value(k)));
    if (this.values.length) return;
    const { spec, focused: k } = this;
    this.readout.textContent =
      k === null
        ? "point at a line for its value"
        : `${spec.noun} ${spec.labels[k]}: ${value(k)} ${spec.unit}`.trim();
  }
}
