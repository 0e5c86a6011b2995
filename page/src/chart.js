// uPlot's options for a plot, and the bounds and interventions that are drawn into it.
import uPlot from "uplot";
import { colour } from "./theme.js";
import { number, withUnit } from "./words.js";
/** @import { Plot } from "./plot.js" */
/** @import { MovingBound, Spec } from "./specs.js" */
/** @import { Intervention, System } from "./types.d.ts" */

export const MOST_CHIPS = 14; // lines, up to which each has a chip with its value
const FONT = "12px system-ui, sans-serif";
const LABEL = 13; // px of a bound's label
const UNIT = 18; // px of the unit beside an axis
const LATE = 0.7; // of the width, from which on words about a time stand before it

/**
 * @param {Plot} plot
 * @param {number} width
 * @param {number} height
 * @returns {uPlot.Options}
 */
export const optionsOf = (plot, width, height) => ({
  width,
  height,
  legend: { show: false },
  padding: [6, 16, 0, 0],
  scales: {
    x: { time: false, range: () => plot.plots.window },
    y: { distr: plot.look.log ? 3 : 1, range: (u, low, high) => valuesOf(plot, u, low, high) },
  },
  axes: axesOf(plot.spec.unit, plot.look.log),
  series: [{}, ...plot.spec.lines.map(({ label }, k) => seriesOf(plot, label, k))],
  focus: { alpha: 0.22 },
  cursor: {
    drag: { x: false, y: false },
    points: { show: plot.spec.total <= MOST_CHIPS, size: 6 },
    focus: { prox: 14 },
    sync: { key: "gne", setSeries: false, scales: ["x", null] },
  },
  hooks: {
    drawAxes: [(u) => drawMarks(u, plot)],
    draw: [() => plot.setTime(plot.plots.now)], // the axis is another one only by now
    setCursor: [(u) => plot.hover(u)],
    // uPlot's types do not know what it tells here
    setSeries: [(_, k, how) => plot.focusedByMouse(k, /** @type {any} */ (how))],
  },
});

/**
 * @returns {uPlot.Axis[]}
 * @param {string} unit
 * @param {boolean} log
 */
const axesOf = (unit, log) => {
  const axis = {
    stroke: colour("muted"),
    font: FONT,
    grid: { stroke: colour("plot-grid"), width: 1 },
    ticks: { stroke: colour("plot-grid"), width: 1, size: 4 },
  };
  return [
    {
      ...axis,
      size: 24,
      gap: 2,
      space: 60,
      values: (_, ticks) => ticks.map((v) => `${number(v, 6)} s`),
    },
    {
      ...axis,
      size: unit ? 50 : 50 + UNIT, // so that time is at the same place in all plots
      gap: 3,
      space: 24,
      label: unit || undefined,
      labelSize: UNIT,
      labelGap: 0,
      labelFont: FONT,
      // of powers of ten those that uPlot leaves in
      ...(!log && { values: (/** @type {uPlot} */ _, /** @type {number[]} */ ticks) => ticks.map((v) => number(v, 6)) }),
    },
  ];
};

/**
 * @returns {uPlot.Series}
 * @param {Plot} plot
 * @param {string} label
 * @param {number} k
 */
const seriesOf = (plot, label, k) => {
  const look = plot.lines.lookOf(k);
  return {
    label,
    stroke: look.colour,
    dash: look.dash.length ? look.dash : undefined,
    width: plot.spec.groups.length > MOST_CHIPS ? 1 : 1.75,
    points: { show: false },
    spanGaps: false,
  };
};

/**
 * @returns {[number, number]}
 * @param {Plot} plot
 * @param {uPlot} u
 * @param {number | null} low
 * @param {number | null} high
 */
const valuesOf = (plot, u, low, high) => {
  const { look } = plot;
  if (look.values) return look.values;
  if (!look.log) return rangeY(plot, u.height, low, high);
  if (low === null || high === null || !(low > 0)) return [1e-3, 1];
  return [Number((low / 1.5).toPrecision(2)), high * 1.5]; // axes write the first
};

/**
 * @returns {[number, number]}
 * @param {Plot} plot
 * @param {number} height of the plot, px
 * @param {number | null} low
 * @param {number | null} high
 */
const rangeY = ({ spec, movingBounds }, height, low, high) => {
  const { bounds } = spec;
  const moving = movingBounds.flatMap(({ values }) => values.filter((each) => each !== null));
  for (const value of [...bounds.map((bound) => bound.value), ...moving]) {
    low = low === null ? value : Math.min(low, value);
    high = high === null ? value : Math.max(high, value);
  }
  if (low === null || high === null || !Number.isFinite(low + high)) return [0, 1];
  const size = high - low || Math.abs(high) || 1;
  // room for a bound's label above its line
  const room = bounds.length || moving.length ? 18 / Math.max(height - 36, 40) : 0.08;
  return [low - 0.07 * size, high + room * size * 1.2];
};

/**
 * @param {uPlot} u
 * @param {Plot} plot
 */
const drawMarks = (u, plot) => {
  const { ctx: context, bbox } = u;
  context.save();
  context.beginPath();
  context.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  context.clip();
  drawInterventions(u, plot.plots.source.interventions);
  for (const system of plot.spec.systems) drawApproach(u, plot, system);
  if (plot.look.log) return context.restore();
  drawBounds(u, plot);
  drawMovingBounds(u, plot.movingBounds);
  context.restore();
};

/**
 * @param {uPlot} u
 * @param {Intervention[]} interventions
 */
const drawInterventions = (u, interventions) => {
  const { ctx: context, bbox } = u;
  context.strokeStyle = colour("muted");
  context.lineWidth = 1;
  context.setLineDash([2, 4]);
  for (const { time } of interventions) {
    const x = u.valToPos(time, "x", true);
    context.beginPath();
    context.moveTo(x, bbox.top);
    context.lineTo(x, bbox.top + bbox.height);
    context.stroke();
  }
};

/** @param {Spec} spec */
const saysApproach = ({ name, systems }) => name === "constraint" && systems.length === 1;

/**
 * Whether words about an exit or a closest approach stand at the right.
 * @param {Plot} plot
 */
const isLate = ({ spec, plots: { source, window: [from, to] } }) =>
  spec.systems
    .flatMap((system) => [
      source.exits[system.name],
      saysApproach(spec) ? source.stateOf(system).margin_time : NaN,
    ])
    .some((time) => typeof time === "number" && time > from + LATE * (to - from) && time <= to);

/**
 * Where a run's least margin was.
 * @param {uPlot} u
 * @param {Plot} plot
 * @param {System} system
 */
const drawApproach = (u, { spec, plots }, system) => {
  if (plots.hiddenRuns.has(system.run)) return;
  const { margin_time: time } = plots.source.stateOf(system);
  if (typeof time !== "number") return;
  const { ctx: context, bbox } = u;
  const ratio = uPlot.pxRatio;
  const x = u.valToPos(time, "x", true);
  if (x < bbox.left || x > bbox.left + bbox.width) return; // another stretch is shown
  context.fillStyle = colour("limit");
  context.beginPath();
  context.moveTo(x, bbox.top + 8 * ratio);
  context.lineTo(x - 5 * ratio, bbox.top);
  context.lineTo(x + 5 * ratio, bbox.top);
  context.fill();
  if (!saysApproach(spec)) return;
  context.font = `${12 * ratio}px system-ui, sans-serif`;
  context.textBaseline = "top";
  const leftward = x > bbox.left + LATE * bbox.width;
  context.textAlign = leftward ? "right" : "left";
  context.fillText("closest approach", x + (leftward ? -8 : 8) * ratio, bbox.top);
};

/**
 * How bounds and their labels are drawn.
 * @param {CanvasRenderingContext2D} context
 * @param {number} ratio
 */
const asBounds = (context, ratio) => {
  context.strokeStyle = context.fillStyle = colour("limit");
  context.lineWidth = 1.5 * ratio;
  context.font = `${12 * ratio}px system-ui, sans-serif`;
  context.textBaseline = "bottom";
  context.textAlign = "right";
  context.setLineDash([6 * ratio, 4 * ratio]);
};

/**
 * @param {uPlot} u
 * @param {Plot} plot
 */
const drawBounds = (u, plot) => {
  const { ctx: context, bbox } = u;
  const { bounds, unit } = plot.spec;
  const ratio = uPlot.pxRatio;
  asBounds(context, ratio);
  const late = isLate(plot);
  if (late) context.textAlign = "left";
  const x = bbox.left + (late ? 4 * ratio : bbox.width - 4 * ratio);
  let last = Infinity;
  for (const { value, note } of bounds) {
    const y = u.valToPos(value, "y", true);
    context.beginPath();
    context.moveTo(bbox.left, y);
    context.lineTo(bbox.left + bbox.width, y);
    context.stroke();
    if (last - y < LABEL * ratio) continue; // no room for another label
    last = y;
    const text = `bound ${withUnit(value, unit)}${note}`;
    context.fillText(text, x, y - 2 * ratio);
  }
};

/**
 * Lines over time; each has its label where it ends.
 * @param {uPlot} u
 * @param {MovingBound[]} bounds
 */
const drawMovingBounds = (u, bounds) => {
  const { ctx: context, bbox } = u;
  const ratio = uPlot.pxRatio;
  asBounds(context, ratio);
  const time = u.data[0];
  for (const { values, note } of bounds) {
    context.beginPath();
    /** @type {[number, number] | null} */
    let last = null;
    values.forEach((value, i) => {
      if (value === null) return;
      const [x, y] = [u.valToPos(time[i], "x", true), u.valToPos(value, "y", true)];
      if (values[i - 1] === null || !last) context.moveTo(x, y);
      else context.lineTo(x, y);
      last = [x, y];
    });
    context.stroke();
    if (!last) continue;
    const [x, y] = /** @type {[number, number]} */ (last);
    const right = Math.min(x, bbox.left + bbox.width - 4 * ratio);
    context.fillText(`bound${note}`, right, y - 2 * ratio);
  }
};
