// A whole run.
import { orNull, partsOf } from "./instant.js";
/** @import { Instant, Pack, Scene } from "./types.d.ts" */

/** @typedef {{i: number, f: number}} At f of the way from sample i to the next one */

/**
 * Rotations a and b mixed: normalised, the short way round; written to out at k.
 * @param {Float64Array} a
 * @param {Float64Array} b
 * @param {number} f from 0 to 1
 * @param {Float64Array} out
 * @param {number} k
 */
const mixQuaternion = (a, b, f, out, k) => {
  let dot = 0;
  for (let c = k; c < k + 4; c++) dot += a[c] * b[c];
  const sign = dot < 0 ? -1 : 1;
  let norm = 0;
  for (let c = k; c < k + 4; c++) {
    out[c] = (1 - f) * a[c] + f * sign * b[c];
    norm += out[c] * out[c];
  }
  norm = Math.sqrt(norm) || 1;
  for (let c = k; c < k + 4; c++) out[c] /= norm;
};

/** Any instant of a run, between samples too. */
export class Replay {
  /** @param {Pack} pack */
  constructor(pack) {
    /** @type {Scene} */
    this.meta = pack.meta;
    this.arrays = pack.arrays;
    this.time = Array.from(pack.arrays.time.data);
    const base = pack.arrays.pose_base?.data || new Float64Array(0);
    this.before = Float64Array.from(base);
    this.after = Float64Array.from(base);
    this.mixed = Float64Array.from(base);
  }

  get end() {
    return this.time[this.time.length - 1];
  }

  /**
   * @param {number} t
   * @returns {At}
   */
  at(t) {
    const time = this.time;
    const last = time.length - 1;
    if (!(t > time[0])) return { i: 0, f: 0 };
    if (t >= time[last]) return { i: last, f: 0 };
    let [low, high] = [0, last];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (time[middle] <= t) low = middle;
      else high = middle;
    }
    return { i: low, f: (t - time[low]) / (time[low + 1] - time[low]) };
  }

  /**
   * @param {number} i
   * @param {Float64Array} out
   */
  fillPoses(i, out) {
    const columns = this.arrays.pose_columns?.data || [];
    const values = this.arrays.pose_values?.data;
    for (let v = 0; v < columns.length; v++) out[columns[v]] = values[i * columns.length + v];
    return out;
  }

  /** @param {At} at */
  poses({ i, f }) {
    const a = this.fillPoses(i, this.before);
    if (f === 0) return a;
    const b = this.fillPoses(i + 1, this.after);
    const out = this.mixed;
    for (let k = 0; k < out.length; k += 8) {
      for (let c = k; c < k + 3; c++) out[c] = a[c] + (b[c] - a[c]) * f;
      mixQuaternion(a, b, f, out, k + 3);
      // what is hidden at one of the two stays so until the next sample
      const whole = a[k + 7] === 0 || b[k + 7] === 0;
      out[k + 7] = whole ? a[k + 7] : a[k + 7] + (b[k + 7] - a[k + 7]) * f;
    }
    return out;
  }

  /**
   * Values of one array, of any width, at an instant.
   * @param {string} name
   * @param {At} at
   */
  row(name, { i, f }) {
    const array = this.arrays[name];
    if (!array) return undefined;
    const width = array.data.length / this.time.length;
    const row = array.data.subarray(i * width, (i + 1) * width);
    if (f === 0) return row;
    const next = array.data.subarray((i + 1) * width, (i + 2) * width);
    return row.map((value, k) => value + (next[k] - value) * f);
  }

  /**
   * @param {number} t
   * @returns {Instant}
   */
  instant(t) {
    const at = this.at(t);
    const time = Math.min(Math.max(t, this.time[0]), this.end);
    /** @type {Instant} */
    const instant = { time, poses: this.poses(at), systems: {} };
    for (const system of this.meta.systems) {
      /** @type {Instant["systems"][string]} */
      const own = (instant.systems[system.name] = {});
      for (const part of partsOf(system)) own[part] = this.row(`${system.name}/${part}`, at);
    }
    return instant;
  }

  /**
   * (links x 2) messages passed and lost in (from, to], or undefined.
   * @param {string} name of the system
   * @param {number} from
   * @param {number} to
   */
  messagesBetween(name, from, to) {
    const array = this.arrays[`${name}/messages`];
    if (!array || !(to > from)) return undefined;
    const width = array.data.length / this.time.length;
    const sum = new Float32Array(width);
    for (let i = this.at(from).i + 1; i <= this.at(to).i; i++)
      for (let k = 0; k < width; k++) sum[k] += array.data[i * width + k];
    return sum;
  }

  /**
   * Column k of an array, over all samples.
   * @param {string} name
   * @param {number} k
   */
  column(name, k) {
    const array = this.arrays[name];
    if (!array) return this.time.map(() => null);
    const width = array.data.length / this.time.length;
    return this.time.map((_, i) => orNull(array.data[i * width + k]));
  }

  /** @param {string} name */
  greatest(name) {
    const data = this.arrays[name]?.data || [];
    let most = 0;
    for (const value of data) if (Math.abs(value) > most) most = Math.abs(value);
    return most;
  }
}
