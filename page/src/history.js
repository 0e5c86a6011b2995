// What came in live.
import { orNull, partsOf } from "./instant.js";
/** @import { Instant, Numbers, Pack, System } from "./types.d.ts" */

/** Every second sample is dropped when there are many. */
export class History {
  /**
   * @param {System[]} systems
   * @param {number} most samples
   */
  constructor(systems, most = 3000) {
    this.most = most;
    this.names = systems.flatMap((system) =>
      partsOf(system)
        .filter((part) => !["estimate", "joints"].includes(part))
        .map((part) => `${system.name}/${part}`),
    );
    /** @type {number[]} */
    this.time = [];
    /** @type {Record<string, (number | null)[][]>} */
    this.columns = {};
    this.spacing = 0; // s between samples that are kept
    /** @type {Record<string, number>} */
    this.peaks = {};
    this.clear();
  }

  clear() {
    this.time = [];
    this.columns = Object.fromEntries(this.names.map((name) => [name, []]));
    this.spacing = 0;
    this.peaks = {};
  }

  /** @param {Pack} pack of all that was before */
  fill(pack) {
    this.clear();
    const time = pack.arrays.time.data;
    for (const name of this.names) {
      const data = pack.arrays[name]?.data;
      if (!data || time.length === 0) continue;
      const width = data.length / time.length;
      this.columns[name] = [...Array(width).keys()].map((k) =>
        Array.from(time, (_, i) => orNull(data[i * width + k])),
      );
      this.notePeak(name, data);
    }
    this.time = Array.from(time);
    this.thin();
  }

  /**
   * @param {string} name
   * @param {Numbers | number[]} values
   */
  notePeak(name, values) {
    let most = this.peaks[name] || 0;
    for (const value of values) if (Math.abs(value) > most) most = Math.abs(value);
    this.peaks[name] = most;
  }

  /**
   * Takes an instant if it is new; one from the past means that the run began again.
   * @param {Instant} instant
   */
  push(instant) {
    const last = this.time[this.time.length - 1];
    if (instant.time < last) this.clear();
    else if (instant.time < last + this.spacing || instant.time === last) return;
    for (const name of this.names) {
      const cut = name.indexOf("/");
      const values = instant.systems[name.slice(0, cut)][name.slice(cut + 1)];
      this.append(name, values || []);
    }
    this.time.push(instant.time);
    if (this.time.length > this.most) this.thin();
  }

  /**
   * @param {string} name
   * @param {Numbers | number[]} values
   */
  append(name, values) {
    const columns = this.columns[name];
    for (let k = 0; k < Math.max(values.length, columns.length); k++) {
      // a column that begins late is empty before
      columns[k] ??= Array(this.time.length).fill(null);
      columns[k].push(orNull(values[k]));
    }
    this.notePeak(name, values);
  }

  thin() {
    while (this.time.length > this.most) {
      /** @type {<T>(values: T[]) => T[]} */
      const keep = (values) => values.filter((_, i) => i % 2 === 0);
      this.time = keep(this.time);
      for (const name of this.names) this.columns[name] = this.columns[name].map(keep);
      this.spacing = (this.time[this.time.length - 1] - this.time[0]) / this.time.length;
    }
  }

  /**
   * @param {string} name
   * @param {number} k
   */
  column(name, k) {
    return this.columns[name][k] || this.time.map(() => null);
  }

  /** @param {string} name */
  greatest(name) {
    return this.peaks[name] || 0;
  }
}
