// Plots over time, one below the other: each system's actions and bounded quantities.
import { Plot } from "./plot.js";
import { specsOf } from "./specs.js";
/** @import { Agent, Scene, Source } from "./types.d.ts" */

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
    new ResizeObserver(() => this.resize()).observe(column);
  }

  /**
   * Plots for a scene.
   * @param {Scene} meta
   * @param {Source} source
   */
  setScene(meta, source) {
    this.meta = meta;
    this.source = source;
    this.plots = meta.systems.flatMap(specsOf).map((spec) => new Plot(this, spec));
    this.column.replaceChildren(...this.plots.map((plot) => plot.root));
    this.size = "";
    this.resize();
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

  resize() {
    if (!this.meta || !this.column.clientWidth) return;
    const width = this.column.clientWidth - 24;
    const count = Math.max(this.plots.length, 1);
    const extra = this.plots.reduce(
      (sum, { root, chart }) => sum + root.offsetHeight - chart.offsetHeight,
      0,
    );
    const room = (this.column.clientHeight - extra - 16) / count;
    const height = Math.floor(Math.min(Math.max(room, 112), 300));
    const size = `${width} ${height}`;
    if (size === this.size) return;
    this.size = size;
    for (const plot of this.plots) plot.setSize(width, height);
    for (const plot of this.plots) plot.setTime(this.now);
  }

  refresh() {
    for (const plot of this.plots) plot.refresh();
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
    return this.plots.map(({ spec, uplot }) => ({
      system: spec.system.name,
      name: spec.name,
      axis: spec.axis,
      title: spec.title,
      series: [...spec.labels],
      total: spec.total,
      bounds: spec.bounds.map(({ value }) => value),
      width: uplot?.width ?? 0,
      samples: uplot?.data[0].length ?? 0,
    }));
  }
}
