"use strict";
// Packs, and what was simulated: as a replay (whole), or as history (what came in live).
(() => {
  const TYPES = { f8: Float64Array, f4: Float32Array, i4: Int32Array, u1: Uint8Array };

  const unshuffled = (bytes, size) => {
    if (size === 1) return bytes.slice();
    const n = bytes.length / size;
    const out = new Uint8Array(bytes.length);
    for (let byte = 0; byte < size; byte++) {
      const group = byte * n;
      for (let k = 0; k < n; k++) out[k * size + byte] = bytes[group + k];
    }
    return out;
  };

  GNE.isPack = (bytes) =>
    bytes.length > 8 && String.fromCharCode(...bytes.subarray(0, 4)) === "GNE1";

  /** {meta, arrays: {name: {data, shape}}} of a pack's bytes. */
  GNE.decodePack = (bytes) => {
    if (!GNE.isPack(bytes)) throw new Error("these bytes are no pack of gne_mj");
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const length = view.getUint32(4, true);
    const header = JSON.parse(new TextDecoder().decode(bytes.subarray(8, 8 + length)));
    const start = Math.ceil((8 + length) / 8) * 8;
    const arrays = {};
    for (const entry of header.arrays) {
      const Type = TYPES[entry.dtype];
      const count = entry.shape.reduce((a, b) => a * b, 1);
      const from = start + entry.offset;
      const raw = bytes.subarray(from, from + count * Type.BYTES_PER_ELEMENT);
      // a copy, as a typed array must begin at a multiple of its item size
      const own = entry.shuffled ? unshuffled(raw, Type.BYTES_PER_ELEMENT) : raw.slice();
      arrays[entry.name] = { data: new Type(own.buffer, 0, count), shape: entry.shape };
    }
    return { meta: header.meta, arrays };
  };

  GNE.inflate = async (bytes) => {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };

  GNE.fromBase64 = (text) => Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));

  // NaN is a gap in a line
  const orNull = (value) => (Number.isFinite(value) ? value : null);

  /** Arrays of a system that an instant has, by their short name. */
  const partsOf = (system) => [
    "action",
    ...system.quantities.map((quantity) => `quantity/${quantity.name}`),
    "share",
    "margin",
    "estimate",
  ];

  /** One simulated instant out of a live frame. */
  GNE.instantOfFrame = (pack, systems) => {
    const instant = { time: pack.meta.time, poses: pack.arrays.poses?.data, systems: {} };
    for (const system of systems) {
      const own = (instant.systems[system.name] = {});
      for (const part of [...partsOf(system), "messages"])
        own[part] = pack.arrays[`${system.name}/${part}`]?.data;
    }
    return instant;
  };

  /** Rotations a and b mixed: normalised, the short way round; written to out at k. */
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

  /** A whole run; any instant of it, between samples too. */
  GNE.Replay = class {
    constructor(pack) {
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

    /** {i, f}: f of the way from sample i to the next one. */
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

    fillPoses(i, out) {
      const columns = this.arrays.pose_columns?.data || [];
      const values = this.arrays.pose_values?.data;
      const T = this.time.length;
      for (let v = 0; v < columns.length; v++) out[columns[v]] = values[v * T + i];
      return out;
    }

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

    /** Values of one array, of any width, at an instant. */
    row(name, { i, f }) {
      const array = this.arrays[name];
      if (!array) return undefined;
      const width = array.data.length / this.time.length;
      const row = array.data.subarray(i * width, (i + 1) * width);
      if (f === 0) return row;
      const next = array.data.subarray((i + 1) * width, (i + 2) * width);
      return row.map((value, k) => value + (next[k] - value) * f);
    }

    instant(t) {
      const at = this.at(t);
      const instant = { time: Math.min(Math.max(t, this.time[0]), this.end), systems: {} };
      instant.poses = this.poses(at);
      for (const system of this.meta.systems) {
        const own = (instant.systems[system.name] = {});
        for (const part of partsOf(system)) own[part] = this.row(`${system.name}/${part}`, at);
      }
      return instant;
    }

    /** (links x 2) messages passed and lost in (from, to], or undefined. */
    messagesBetween(system, from, to) {
      const array = this.arrays[`${system.name}/messages`];
      if (!array || !(to > from)) return undefined;
      const width = array.data.length / this.time.length;
      const sum = new Float32Array(width);
      for (let i = this.at(from).i + 1; i <= this.at(to).i; i++)
        for (let k = 0; k < width; k++) sum[k] += array.data[i * width + k];
      return sum;
    }

    /** Column k of an array, over all samples. */
    column(name, k) {
      const array = this.arrays[name];
      if (!array) return this.time.map(() => null);
      const width = array.data.length / this.time.length;
      return this.time.map((_, i) => orNull(array.data[i * width + k]));
    }

    greatest(name) {
      const data = this.arrays[name]?.data || [];
      let most = 0;
      for (const value of data) if (Math.abs(value) > most) most = Math.abs(value);
      return most;
    }
  };

  /** What came in live; every second sample is dropped when there are many. */
  GNE.History = class {
    constructor(systems, most = 3000) {
      this.most = most;
      this.names = systems.flatMap((system) =>
        partsOf(system)
          .filter((part) => part !== "estimate")
          .map((part) => `${system.name}/${part}`),
      );
      this.clear();
    }

    clear() {
      this.time = [];
      this.columns = Object.fromEntries(this.names.map((name) => [name, []]));
      this.spacing = 0;
      this.peaks = {};
    }

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

    notePeak(name, values) {
      let most = this.peaks[name] || 0;
      for (const value of values) if (Math.abs(value) > most) most = Math.abs(value);
      this.peaks[name] = most;
    }

    /** Takes an instant if it is new; one from the past means that the run began again. */
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
        const keep = (values) => values.filter((_, i) => i % 2 === 0);
        this.time = keep(this.time);
        for (const name of this.names) this.columns[name] = this.columns[name].map(keep);
        this.spacing = (this.time[this.time.length - 1] - this.time[0]) / this.time.length;
      }
    }

    column(name, k) {
      return this.columns[name][k] || this.time.map(() => null);
    }

    greatest(name) {
      return this.peaks[name] || 0;
    }
  };
})();
