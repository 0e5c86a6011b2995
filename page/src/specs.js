// What there is to plot of a system.
/** @import { Quantity, Store, System } from "./types.d.ts" */

const MOST_LINES = 40;

/**
 * @typedef {{value: number, note: string}} Bound, and whose it is
 *
 * @typedef {{values: (number | null)[], note: string}} MovingBound the same at each sample
 *
 * @typedef {object} Line
 * @property {System} system
 * @property {string} array that a store has it under
 * @property {number} column of the array
 * @property {string} label
 * @property {string} key the label, numbered where an earlier line has the same
 * @property {number | null} agent from 0, if it is an agent's own
 * @property {string[]} moving arrays of bounds that change in time, with the same columns
 *
 * @typedef {object} Spec
 * @property {System[]} systems of which it is, one a run
 * @property {string} whose what the systems are called
 * @property {string} name of the quantity, or "action"
 * @property {string} axis of the actions, if they have several
 * @property {string} unit
 * @property {string} title
 * @property {string} symbol TeX
 * @property {string} noun before a label
 * @property {Line[]} lines
 * @property {string[]} shorts labels of the lines without what all of them say
 * @property {number[][]} groups lines with a key in common: one, or one of each run
 * @property {number} total how many groups there are, of which some are chosen
 * @property {Bound[]} bounds
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

/**
 * Labels with keys that tell equal ones apart.
 * @param {string[]} labels
 */
const keyed = (labels) =>
  labels.map((label, k) => {
    const before = labels.slice(0, k).filter((each) => each === label).length;
    return { label, key: before ? `${label} ${before + 1}` : label };
  });

/** @typedef {Omit<Spec, "total" | "shorts" | "groups">} Whole before lines are chosen */

/** @returns {Whole[]} one for each axis of the actions */
const actionsOf = (/** @type {System} */ system) => {
  const { action, agent_name: noun } = system;
  return [...new Set(action.axis)].map((axis) => {
    const columns = [...action.owner.keys()].filter((k) => action.axis[k] === axis);
    return {
      systems: [system],
      whose: system.name,
      name: "action",
      axis,
      unit: action.unit,
      title: axis ? `${action.name}, ${axis}` : action.name,
      symbol: "",
      noun,
      lines: keyed(columns.map((column) => String(action.owner[column]))).map((named, k) => ({
        ...named,
        system,
        array: `${system.name}/action`,
        column: columns[k],
        agent: action.owner[columns[k]] - 1,
        moving: [],
      })),
      bounds: [],
    };
  });
};

/**
 * @param {System} system
 * @param {Quantity} quantity
 * @returns {Whole}
 */
const quantityOf = (system, quantity) => {
  const ofAgents = quantity.labels.length === system.agents && system.agents > 1;
  const moving = Object.values(quantity.moving_bounds).map(
    (each) => `${system.name}/quantity/${each}`,
  );
  return {
    systems: [system],
    whose: system.name,
    name: quantity.name,
    axis: "",
    unit: quantity.unit,
    title: quantity.long_name,
    symbol: quantity.symbol,
    noun: ofAgents ? system.agent_name : "",
    lines: keyed(quantity.labels.map((label) => label || quantity.long_name)).map((named, column) => ({
      ...named,
      system,
      array: `${system.name}/quantity/${quantity.name}`,
      column,
      agent: ofAgents ? column : null,
      moving,
    })),
    bounds: boundsOf(quantity),
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
export const movingBoundsOf = ({ lines, shorts }, store) => {
  /** @type {Map<string, {values: (number | null)[], whose: Set<string>}>} */
  const found = new Map();
  lines.forEach(({ moving, column }, k) => {
    for (const array of moving) {
      const values = store.column(array, column);
      if (values.every((value) => value === null)) continue;
      const key = values.join();
      const known = found.get(key) ?? { values, whose: new Set() };
      found.set(key, known);
      known.whose.add(shorts[k]);
    }
  });
  return [...found.values()].map(({ values, whose }) => ({
    values,
    note: noteOf([...whose], new Set(shorts).size),
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
 * A plot with so many lines as can be told apart.
 * @param {Whole} whole
 * @param {number} runs
 * @returns {Spec}
 */
export const thinned = (whole, runs = 1) => {
  const keys = [...new Set(whole.lines.map(({ key }) => key))];
  const chosen = evenly(keys.length, Math.floor(MOST_LINES / runs)).map((k) => keys[k]);
  const shorts = shortOf(keys.map((key) => whole.lines.find((line) => line.key === key)?.label ?? ""));
  const lines = whole.lines.filter(({ key }) => chosen.includes(key));
  return {
    ...whole,
    total: keys.length,
    lines,
    shorts: lines.map(({ key }) => shorts[keys.indexOf(key)]),
    groups: chosen.map((key) => [...lines.keys()].filter((k) => lines[k].key === key)),
  };
};

/**
 * What to plot of a system: actions by axis, then quantities.
 * @param {System} system
 * @returns {Whole[]}
 */
export const wholesOf = (system) => [
  ...actionsOf(system),
  ...system.quantities.map((quantity) => quantityOf(system, quantity)),
];
