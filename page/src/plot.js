// One plot over time: its caption, a chip for each line, and uPlot's chart.
import uPlot from "uplot";
import { captionOf } from "./caption.js";
import { optionsOf } from "./chart.js";
import { Chips } from "./chips.js";
import { element } from "./dom.js";
import { Lines } from "./lines.js";
import { Reading } from "./reading.js";
import { movingBoundsOf } from "./specs.js";
import { exitLine, TimeLine } from "./timeline.js";
import { Hands, scaled } from "./window.js";
import { decimals, fixed } from "./words.js";
/** @import { Plots } from "./plots.js" */
/** @import { MovingBound, Spec } from "./specs.js" */
/** @import { Agent } from "./types.d.ts" */

/**
 * How a plot is looked at, which stays while its theme or its run changes.
 * @typedef {{hidden: Set<number>, log: boolean, values: [number, number] | null}} Look
 */

export class Plot {
  /**
   * @param {Plots} plots
   * @param {Spec} spec
   * @param {Look} look
   */
  constructor(plots, spec, look) {
    this.plots = plots;
    this.spec = spec;
    this.look = look;
    this.lines = new Lines(plots, spec, look.hidden);
    /** @type {number | null} */
    this.hovered = null; // index into the samples
    /** @type {number | null} */
    this.focused = null; // the line that is pointed at
    /** @type {uPlot | null} */
    this.uplot = null; // from when there is a size
    /** @type {MovingBound[]} */
    this.movingBounds = [];
    this.mouseInside = false;
    this.chips = new Chips(this);
    this.reading = new Reading(this);
    const name = `${[spec.whose, spec.title].filter(Boolean).join(": ")} over time`;
    this.chart = element("div", {
      class: "chart",
      tabindex: 0,
      role: "group",
      "aria-label": `${name}; arrow keys read values`,
      onkeydown: (/** @type {KeyboardEvent} */ event) => this.reading.key(event),
      onblur: () => this.reading.at(null),
    });
    this.root = element("figure", { class: "plot", "aria-label": name });
    this.root.append(captionOf(this), this.chips.root, this.chart, this.reading.spoken);
    this.timeLine = new TimeLine(element("div", { class: "time-line" }));
    this.exitLines = spec.systems.map((system) => ({
      system,
      line: new TimeLine(exitLine(plots.headingOf(system.run))),
    }));
  }

  showLines() {
    const { lines, spec, uplot } = this;
    uplot?.batch(() => {
      for (const k of spec.lines.keys()) uplot.setSeries(k + 1, { show: lines.shows(k) });
    });
    this.chips.press();
    this.writeValues();
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
    const { agent = null, system } = k === null ? {} : this.spec.lines[k];
    const which = agent === null || !system ? null : { system: system.name, agent };
    this.plots.callbacks.highlight(which, this);
  }

  /** @param {number | null} k */
  focus(k) {
    if (this.focused === k) return;
    this.focused = k;
    this.chips.mark(k);
    this.uplot?.setSeries(k === null ? /** @type {any} */ (null) : k + 1, { focus: true });
  }

  /** @param {Agent | null} which */
  highlight(which) {
    const k = this.spec.lines.findIndex(
      ({ system, agent }) => system.name === which?.system && agent === which.agent,
    );
    this.focus(k < 0 ? null : k);
  }

  // ---- uPlot

  /**
   * @param {number} width
   * @param {number} height
   */
  setSize(width, height) {
    if (!this.uplot) return this.make(width, height);
    this.uplot.setSize({ width, height });
    this.uplot.setData(this.uplot.data, true); // the room for a bound's label is another one
  }

  /**
   * @param {number} width
   * @param {number} height
   */
  make(width, height) {
    this.uplot?.destroy();
    this.uplot = new uPlot(optionsOf(this, width, height), this.data(), this.chart);
    const { over } = this.uplot;
    const lines = [this.timeLine, ...this.exitLines.map((each) => each.line)];
    for (const each of lines) each.x = NaN;
    over.append(...lines.map(({ root }) => root));
    new Hands(this, this.uplot);
    over.addEventListener("mouseenter", () => (this.mouseInside = true));
    over.addEventListener("mouseleave", () => {
      this.mouseInside = false;
      this.point(null);
    });
    this.plots.place(this);
  }

  /** @param {boolean} log */
  setLogarithmic(log) {
    Object.assign(this.look, { log, values: null });
    if (this.uplot) this.make(this.uplot.width, this.uplot.height);
  }

  /** Whether what is drawn is the values' negative: of what must stay below 0 the margin. */
  get turned() {
    return this.look.log && this.spec.name === "constraint";
  }

  /** The columns as they are. */
  columns() {
    const { store } = this.plots.source;
    return this.spec.lines.map(({ array, column }) => store.column(array, column));
  }

  /** @returns {uPlot.AlignedData} */
  data() {
    const { store } = this.plots.source;
    this.movingBounds = movingBoundsOf(this.spec, store);
    if (!this.look.log) return [store.time, ...this.columns()];
    const sign = this.turned ? -1 : 1;
    const drawn = this.columns().map((column) =>
      column.map((value) => (value !== null && sign * value > 0 ? sign * value : null)),
    );
    return [store.time, ...drawn];
  }

  /** @param {(position: number) => number} move of where an edge is, px, to where it was */
  moveValues(move) {
    const u = this.uplot;
    if (!u) return;
    const [top, bottom] = [0, u.over.clientHeight].map((edge) => u.posToVal(move(edge), "y"));
    this.look.values = [Math.min(top, bottom), Math.max(top, bottom)];
    u.setData(u.data, true);
  }

  /**
   * @param {number} factor
   * @param {number} around px
   */
  zoomValues(factor, around) {
    const [top, bottom] = scaled([0, this.uplot?.over.clientHeight ?? 1], around, factor);
    const high = this.uplot?.over.clientHeight ?? 1;
    this.moveValues((edge) => top + ((bottom - top) * edge) / high);
  }

  /**
   * @param {number} from px
   * @param {number} to
   */
  panValues(from, to) {
    this.moveValues((edge) => edge + from - to);
  }

  // ---- values

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
    this.chips.mark(focused);
    this.tell(focused);
  }

  refresh() {
    this.uplot?.setData(this.data(), true);
    this.writeValues();
  }

  /** @param {number} t */
  setTime(t) {
    if (!this.uplot) return;
    this.timeLine.place(this.uplot, t);
    for (const { system, line: own } of this.exitLines) {
      const exit = this.plots.source.exits[system.name];
      const { root } = own;
      root.hidden = !Number.isFinite(exit) || this.plots.hiddenRuns.has(system.run);
      if (root.hidden) continue;
      own.place(this.uplot, exit);
      const [from, to] = this.plots.window;
      root.classList.toggle("leftward", exit > from + 0.7 * (to - from));
    }
  }

  /**
   * @param {number} k
   * @param {number} i
   */
  valueText(k, i) {
    const { store } = this.plots.source;
    const value = this.uplot?.data[k + 1][i] ?? null;
    return fixed(value, decimals(store.greatest(this.spec.lines[k].array)));
  }

  /** Values at the mouse, or now. */
  writeValues() {
    const u = this.uplot;
    if (!u) return;
    const i = this.hovered ?? u.valToIdx(this.plots.now);
    const hover = this.hovered === null ? "" : `at ${fixed(u.data[0][i] ?? null, 2)} s`;
    const turned = this.turned ? "margin −g, log" : this.look.log ? "log" : "";
    this.chips.write(i, [turned, hover]);
  }
}
