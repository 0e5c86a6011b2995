// What runs have in common, laid over each other: one plot of each variable that several have.
import { thinned, wholesOf } from "./specs.js";
/** @import { Bound, Line, Spec, Whole } from "./specs.js" */
/** @import { Run, Scene, System } from "./types.d.ts" */

/**
 * What to plot of a scene, and what is left out, in words.
 * @param {Scene} meta
 * @returns {{specs: Spec[], left: string}}
 */
export const plottedOf = ({ systems, runs }) => {
  const all = systems.flatMap(wholesOf);
  if (!runs) return { specs: all.map((whole) => thinned(whole)), left: "" };
  const whose = (/** @type {System} */ system) => runs[system.run].systems[system.name];
  /** @type {Map<string, Whole[]>} */
  const found = new Map();
  for (const whole of all) {
    const key = [whose(whole.systems[0]), whole.name, whole.axis, whole.unit].join("\n");
    found.set(key, [...(found.get(key) ?? []), whole]);
  }
  const joined = [...found.values()].map((wholes) => joinedOf(wholes, runs, whose(wholes[0].systems[0])));
  const common = joined.flatMap(({ whole }) => (whole ? [thinned(whole, runs.length)] : []));
  if (!common.length)
    return {
      specs: all.map((whole) => thinned(whole)),
      left: "These runs have no variable in common; each has plots of its own.",
    };
  const left = joined.flatMap((each) => each.left);
  return { specs: common, left: left.length ? `Of one run alone, and not plotted: ${left.join("; ")}.` : "" };
};

/**
 * One plot of what several runs have of a variable.
 * @param {Whole[]} wholes of runs
 * @param {Run[]} runs
 * @param {string} whose name of the systems
 * @returns {{whole: Whole | null, left: string[]}}
 */
const joinedOf = (wholes, runs, whose) => {
  const lines = wholes.flatMap((whole) => whole.lines);
  const often = (/** @type {Line} */ line) => lines.filter(({ key }) => key === line.key).length > 1;
  const common = lines.filter(often);
  const left = wholes.flatMap((whole) => {
    const alone = whole.lines.filter((line) => !often(line));
    return alone.length ? [leftOf(whole, alone, runs)] : [];
  });
  if (!common.length) return { whole: null, left };
  const of = wholes.filter((whole) => whole.lines.some(often));
  return {
    whole: {
      ...of[0],
      systems: of.flatMap((whole) => whole.systems),
      whose,
      lines: common,
      bounds: boundsOf(of, runs),
    },
    left,
  };
};

/**
 * What one run has that no other has.
 * @param {Whole} whole
 * @param {Line[]} alone
 * @param {Run[]} runs
 */
const leftOf = ({ systems: [{ run }], title, noun, lines }, alone, runs) => {
  const labels = alone.map(({ label }) => label).join(", ");
  const whose = /^\d/.test(labels) ? `${noun} ${labels}` : labels;
  const part = alone.length < lines.length ? ` of ${whose}` : "";
  return `${title}${part} (${runs[run].heading})`;
};

/**
 * Bounds of all; those that not all runs have say whose they are.
 * @param {Whole[]} wholes
 * @param {Run[]} runs
 * @returns {Bound[]}
 */
const boundsOf = (wholes, runs) => {
  /** @type {Map<number, {note: string, whose: string[]}>} */
  const found = new Map();
  for (const { bounds, systems } of wholes)
    for (const { value, note } of bounds) {
      const known = found.get(value) ?? { note, whose: [] };
      known.whose.push(runs[systems[0].run].heading);
      found.set(value, known);
    }
  return [...found]
    .map(([value, { note, whose }]) => ({
      value,
      note: whose.length < wholes.length ? `: ${whose.join("; ")}` : note,
    }))
    .sort((a, b) => a.value - b.value);
};
