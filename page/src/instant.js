// One simulated instant.
/** @import { Instant, Pack, System } from "./types.d.ts" */

/**
 * Arrays of a system that an instant has, by their short names.
 * @param {System} system
 */
export const partsOf = (system) => [
  "action",
  ...system.quantities.flatMap(({ name, moving_bounds: moving }) =>
    [name, ...Object.values(moving)].map((each) => `quantity/${each}`),
  ),
  "share",
  "margin",
  "estimate",
  "joints",
  "linked",
  "there",
];

/**
 * Whether an agent, from 0, is there: some leave and join.
 * @param {Instant["systems"][string] | undefined} own arrays of its system
 * @param {number} agent
 */
export const isThere = (own, agent) => !own?.there || own.there[agent] > 0.5;

/**
 * NaN is a gap in a line.
 * @param {number | undefined} value
 * @returns {number | null}
 */
export const orNull = (value) => (value !== undefined && Number.isFinite(value) ? value : null);

/**
 * An instant out of a live frame.
 * @param {Pack} pack
 * @param {System[]} systems
 * @returns {Instant}
 */
export const instantOfFrame = (pack, systems) => {
  /** @type {Instant} */
  const instant = { time: pack.meta.time, poses: pack.arrays.poses?.data, systems: {} };
  for (const system of systems) {
    /** @type {Instant["systems"][string]} */
    const own = (instant.systems[system.name] = {});
    for (const part of [...partsOf(system), "messages"])
      own[part] = pack.arrays[`${system.name}/${part}`]?.data;
  }
  return instant;
};
