// Plots over time, one below the other: each system's actions and bounded quantities.
import { element } from "./dom.js";
import { Plot } from "./plot.js";
import { plottedOf } from "./compared.js";
import { scaled, STEP, within } from "./window.js";
import { number } from "./words.js";
/** @import { Look } from "./plot.js" */
/** @import { Agent, Scene, Source } from "./types.d.ts" */
/** @import { Stretch } from "./window.js" */

const AROUND = 0.04; // of the run, that is shown on both sides of a moment
const PART = 0.35; // of the window's height, that a plot has where all are scrolled to

/** @param {number} t */
const niceSpan = (t) => {
  const ten = 10 ** Math.floor(Math.log10(t));
  return ten * ([1, 1.5, 2, 3, 5, 7.5].find((step) => step * ten >= t) ?? 10);
};

export class Plots {
  /**
   * @param {HTMLElement} column where they are put
   * @param {object} callbacks
   * @param {(time: number) => void} callbacks.seek
   * @param {(which: Agent | null, plot: Plot) => void} callbacks.highlight
   */
  constructor(column, callbacks) {
    this.column = column;
    this.callbacks = callbacks;
    /** @type {Plot[]} */
    this.plots = [];
    /** @type {Scene | null} */
    this.meta = null;
    /** @type {Source} */
    this.source = /** @type {any} */ (null); // from the first scene on
    this.now = 0;
    this.size = "";
    this.seen = true; // or out of sight, in a page around
    /** @type {Stretch | null} */
    this.stretch = null; // of time that is shown; null: all
    /** @type {Map<string, Look>} */
    this.looks = new Map();
    /** @type {Set<number>} */
    this.hiddenRuns = new Set(); // of several
    this.runs = element("div", { id: "run-keys", role: "group", "aria-label": "runs" });
    this.left = element("p", { class: "muted small", id: "plots-left", hidden: true });
    this.shown = element("span", { class: "muted", role: "status" });
    this.all = this.tool("All", "All of the run (0)", () => this.showAll());
    this.tools = element(
      "div",
      { id: "plot-tools", role: "toolbar", "aria-label": "time that plots show" },
      this.tool("−", "More time (−)", () => this.zoom(1 / STEP)),
      this.tool("+", "Less time (+)", () => this.zoom(STEP)),
      this.all,
      this.shown,
    );
    new ResizeObserver(() => this.resize()).observe(column);
  }

  /**
   * @param {string} text
   * @param {string} title
   * @param {() => void} onclick
   */
  tool(text, title, onclick) {
    return element("button", { type: "button", class: "tool", text, title, onclick });
  }

  /**
   * Plots for a scene.
   * @param {Scene} meta
   * @param {Source} source
   */
  setScene(meta, source) {
    if (meta !== this.meta) {
      this.looks.clear();
      this.stretch = null;
    }
    this.meta = meta;
    this.source = source;
    const { specs, left } = plottedOf(meta);
    this.left.textContent = left;
    this.left.hidden = !left;
    this.plots = specs.map((spec) => {
      const key = `${spec.lines[0].array} ${spec.axis}`;
      const look = this.looks.get(key) ?? { hidden: new Set(), log: false, values: null };
      this.looks.set(key, look);
      return new Plot(this, spec, look);
    });
    const figures = this.plots.map((plot) => plot.root);
    this.column.replaceChildren(this.tools, this.runs, ...figures, this.left);
    this.size = "";
    this.resize();
    this.tellStretch();
  }

  // ---- the time that is shown

  /** @returns {Stretch} */
  get window() {
    return this.stretch ?? [0, this.span()];
  }

  /** @param {Stretch | null} stretch */
  show(stretch) {
    this.stretch = stretch && within(stretch, this.span());
    for (const { uplot } of this.plots) uplot?.setData(uplot.data, true);
    this.tellStretch();
  }

  showAll() {
    for (const { look } of this.plots) look.values = null;
    this.show(null);
  }

  /**
   * @param {number} factor
   * @param {number} around s
   */
  zoom(factor, around = this.now) {
    const [from, to] = this.window;
    const middle = around < from || around > to ? (from + to) / 2 : around;
    this.show(scaled([from, to], middle, factor));
  }

  /** @param {number} seconds */
  pan(seconds) {
    if (this.stretch) this.show([this.stretch[0] + seconds, this.stretch[1] + seconds]);
  }

  /**
   * A moment, with some time on both sides.
   * @param {number} time
   */
  showAround(time) {
    const far = AROUND * this.span();
    this.show([time - far, time + far]);
  }

  tellStretch() {
    const [from, to] = this.window;
    this.shown.textContent = this.stretch ? `${number(from, 4)} to ${number(to, 4)} s` : "";
  }

  /** @param {Source} source */
  setSource(source) {
    this.source = source;
    this.refresh();
  }

  restyle() {
    if (this.meta) this.setScene(this.meta, this.source);
  }

  /** Right end of the time axis: the run's, or live a round number beyond what is there. */
  span() {
    const { exits, seekable, store } = this.source;
    const last = store.time.at(-1) ?? 0;
    const duration = this.meta?.duration;
    // an exit at the very end should not hide in the frame
    const exit = Math.max(0, ...Object.values(exits));
    if (seekable) return Math.max(last, 1.06 * exit, 1e-6);
    const nice = niceSpan(Math.max(last, 2));
    return duration && last <= duration ? Math.min(nice, duration) : nice;
  }

  /**
   * Out of sight no plot follows its window's size: a notebook may have many.
   * @param {boolean} seen
   */
  setSeen(seen) {
    this.seen = seen;
    if (seen) this.resize();
  }

  resize() {
    if (!this.meta || !this.seen || !this.column.clientWidth) return;
    const width = this.column.clientWidth - 24;
    const height = Math.floor(Math.min(Math.max(this.room(), 112), 300));
    const size = `${width} ${height}`;
    if (size === this.size) return;
    this.size = size;
    for (const plot of this.plots) plot.setSize(width, height);
    for (const plot of this.plots) plot.setTime(this.now);
  }

  /** Height of a chart in px, for as many as fit. */
  room() {
    const { column, plots, tools, runs, left } = this;
    if (getComputedStyle(column).overflowY === "visible") return PART * innerHeight; // it grows
    const extra = plots.reduce(
      (sum, { root, chart }) => sum + root.offsetHeight - chart.offsetHeight,
      tools.offsetHeight + runs.offsetHeight + left.offsetHeight,
    );
    return (column.clientHeight - extra - 16) / Math.max(plots.length, 1);
  }

  /** @param {Plot} plot whose chart is new */
  place(plot) {
    plot.setTime(this.now);
    plot.showLines();
    plot.writeValues();
  }

  refresh() {
    for (const plot of this.plots) plot.refresh();
  }

  /** Other lines are switched on, or those of another run. */
  showLines() {
    for (const plot of this.plots) plot.showLines();
  }

  /**
   * The heading of a run, where there are several.
   * @param {number} run
   */
  headingOf(run) {
    return this.meta?.runs?.[run].heading ?? "";
  }

  /** @param {number} t */
  setTime(t) {
    this.now = t;
    for (const plot of this.plots) plot.setTime(t);
  }

  writeValues() {
    for (const plot of this.plots) plot.writeValues();
  }

  /**
   * @param {Agent | null} which
   * @param {Plot} [except]
   */
  highlight(which, except) {
    for (const plot of this.plots) if (plot !== except) plot.highlight(which);
  }

  describe() {
    return this.plots.map(({ spec, uplot, look, lines, movingBounds }) => ({
      system: spec.whose,
      name: spec.name,
      axis: spec.axis,
      title: spec.title,
      series: spec.lines.map(({ label }) => label),
      total: spec.total,
      bounds: spec.bounds.map(({ value }) => value),
      moving: movingBounds.length,
      width: uplot?.width ?? 0,
      samples: uplot?.data[0].length ?? 0,
      time: uplot && [uplot.scales.x.min, uplot.scales.x.max],
      values: uplot && [uplot.scales.y.min, uplot.scales.y.max],
      hidden: [...look.hidden],
      shown: [...spec.lines.keys()].map((k) => lines.shows(k)),
      colours: [...spec.lines.keys()].map((k) => lines.lookOf(k).colour),
      dashes: [...spec.lines.keys()].map((k) => lines.lookOf(k).dash),
      log: look.log,
    }));
  }
}
