// What there is to plot of a system.
/** @import { Quantity, Store, System } from "./types.d.ts" */

const MOST_LINES = 40;

/**
 * @typedef {{value: number, note: string}} Bound, and whose it is
 *
 * @typedef {{values: (number | null)[], note: string}} MovingBound the same at each sample
 *
 * @typedef {object} Spec
 * @property {System} system
 * @property {string} name of the quantity, or "action"
 * @property {string} axis of the actions, if they have several
 * @property {string} array that a store has it under
 * @property {string} unit
 * @property {number[]} columns of the array
 * @property {number} total how many there are, of which columns are chosen
 * @property {string} title
 * @property {string} symbol TeX
 * @property {string[]} labels of the columns
 * @property {string[]} shorts the same without what all of them say
 * @property {(number | null)[]} agents from 0, of the columns that are an agent's own
 * @property {string} noun before a label
 * @property {Bound[]} bounds
 * @property {string[]} moving arrays of bounds that change in time, with the same columns
 */

/**
 * Labels without what all of them say: "gap of agents 1 and 2" as "1–2".
 * @param {string[]} labels
 */
const shortOf = (labels) => {
  if (labels.length < 2) return labels;
  const [first] = labels;
  let n = 0;
  while (n < first.length && labels.every((each) => each[n] === first[n])) n++;
  const common = first.slice(0, n).lastIndexOf(" ") + 1;
  return labels.map((each) =>
    each
      .slice(common)
      .replace(/\bagents? /g, "")
      .replace(/ and /g, "–")
      .replace(/ to /g, "→")
      .replace(/_(\d)\b/g, (_, digit) => "₀₁₂₃₄₅₆₇₈₉"[digit]),
  );
};

/** @returns {Omit<Spec, "total" | "shorts">[]} one for each axis of the actions */
const actionsOf = (/** @type {System} */ system) => {
  const { action, agent_name: agent } = system;
  return [...new Set(action.axis)].map((axis) => {
    const columns = [...action.owner.keys()].filter((k) => action.axis[k] === axis);
    return {
      system,
      name: "action",
      axis,
      array: `${system.name}/action`,
      unit: action.unit,
      columns,
      title: axis ? `${action.name}, ${axis}` : action.name,
      symbol: "",
      labels: columns.map((k) => String(action.owner[k])),
      agents: columns.map((k) => action.owner[k] - 1),
      noun: agent,
      bounds: [],
      moving: [],
    };
  });
};

/**
 * @param {System} system
 * @param {Quantity} quantity
 * @returns {Omit<Spec, "total" | "shorts">}
 */
const quantityOf = (system, quantity) => {
  const ofAgents = quantity.labels.length === system.agents && system.agents > 1;
  return {
    system,
    name: quantity.name,
    axis: "",
    array: `${system.name}/quantity/${quantity.name}`,
    unit: quantity.unit,
    columns: [...quantity.labels.keys()],
    title: quantity.long_name,
    symbol: quantity.symbol,
    labels: quantity.labels.map((each) => each || quantity.long_name),
    agents: quantity.labels.map((_, k) => (ofAgents ? k : null)),
    noun: ofAgents ? system.agent_name : "",
    bounds: boundsOf(quantity),
    moving: Object.values(quantity.moving_bounds).map((each) => `${system.name}/quantity/${each}`),
  };
};

/**
 * Each different bound with the entries that have it.
 * @param {Quantity} quantity
 * @returns {Bound[]}
 */
const boundsOf = ({ bound, lower_bound, labels }) => {
  /** @type {Map<number, string[]>} */
  const found = new Map();
  const shorts = shortOf(labels);
  for (const values of [bound, lower_bound])
    (values ?? []).forEach((value, k) => {
      if (value === null || !Number.isFinite(value)) return;
      found.set(value, [...(found.get(value) ?? []), shorts[k]]);
    });
  return [...found]
    .map(([value, whose]) => ({ value, note: noteOf(whose, labels.length) }))
    .sort((a, b) => a.value - b.value);
};

/**
 * Each different bound over time, with the entries that have it.
 * @param {Spec} spec
 * @param {Store} store
 * @returns {MovingBound[]}
 */
export const movingBoundsOf = ({ moving, columns, shorts }, store) => {
  /** @type {Map<string, {values: (number | null)[], whose: string[]}>} */
  const found = new Map();
  for (const array of moving)
    columns.forEach((column, k) => {
      const values = store.column(array, column);
      if (values.every((value) => value === null)) return;
      const key = values.join();
      const known = found.get(key) ?? { values, whose: [] };
      found.set(key, { values, whose: [...known.whose, shorts[k]] });
    });
  return [...found.values()].map(({ values, whose }) => ({
    values,
    note: noteOf(whose, columns.length),
  }));
};

/**
 * Whose a bound is, where it is not everyone's and can be told in a few words.
 * @param {string[]} whose
 * @param {number} of
 */
const noteOf = (whose, of) => {
  const note = `: ${whose.join(", ")}`;
  return whose.length < of && note.length < 20 ? note : "";
};

/**
 * At most `most` of n indices, evenly chosen.
 * @param {number} n
 * @param {number} most
 */
const evenly = (n, most) => {
  if (n <= most) return [...Array(n).keys()];
  return [...Array(most).keys()].map((k) => Math.round((k * (n - 1)) / (most - 1)));
};

/**
 * @param {Omit<Spec, "total" | "shorts">} spec
 * @returns {Spec}
 */
const thinned = (spec) => {
  const total = spec.columns.length;
  const chosen = evenly(total, MOST_LINES);
  /** @type {<T>(values: T[]) => T[]} */
  const pick = (values) => chosen.map((k) => values[k]);
  return {
    ...spec,
    total,
    columns: pick(spec.columns),
    shorts: pick(shortOf(spec.labels)),
    labels: pick(spec.labels),
    agents: pick(spec.agents),
  };
};

/**
 * What to plot of a system: actions by axis, then quantities.
 * @param {System} system
 * @returns {Spec[]}
 */
export const specsOf = (system) =>
  [
    ...actionsOf(system),
    ...system.quantities.map((quantity) => quantityOf(system, quantity)),
  ].map(thinned);
