// Packs: a JSON header and arrays behind it, see gne_mj/viewer/pack.py.
/** @import { Pack } from "./types.d.ts" */

/**
 * @typedef {object} Entry an array of the header
 * @property {string} name
 * @property {keyof typeof TYPES} dtype
 * @property {number[]} shape
 * @property {number} offset into the data
 * @property {boolean} shuffled column after column; first bytes of all entries, then all second ones
 *
 * @typedef {{meta: any, arrays: Entry[]}} Header
 */

const TYPES = { f8: Float64Array, f4: Float32Array, i4: Int32Array, u1: Uint8Array };

/**
 * Bytes of an array in the order of its entries.
 * @param {Uint8Array} bytes
 * @param {number} size of an entry
 * @param {number} columns
 */
const unshuffled = (bytes, size, columns) => {
  const rows = bytes.length / (size * columns);
  const out = new Uint8Array(bytes.length);
  let from = 0;
  for (let byte = 0; byte < size; byte++)
    for (let column = 0; column < columns; column++)
      for (let row = 0; row < rows; row++)
        out[(row * columns + column) * size + byte] = bytes[from++];
  return out;
};

/** @param {Uint8Array} bytes */
export const isPack = (bytes) =>
  bytes.length > 8 && String.fromCharCode(...bytes.subarray(0, 4)) === "GNE1";

/**
 * @param {Uint8Array} bytes
 * @returns {Pack}
 */
export const decodePack = (bytes) => {
  if (!isPack(bytes)) throw new Error("these bytes are no pack of gne_mj");
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const length = view.getUint32(4, true);
  /** @type {Header} */
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(8, 8 + length)));
  const start = Math.ceil((8 + length) / 8) * 8;
  /** @type {Pack["arrays"]} */
  const arrays = {};
  for (const entry of header.arrays) {
    const Type = TYPES[entry.dtype];
    const count = entry.shape.reduce((a, b) => a * b, 1);
    const from = start + entry.offset;
    const raw = bytes.subarray(from, from + count * Type.BYTES_PER_ELEMENT);
    // a copy, as a typed array must begin at a multiple of its item size
    const columns = entry.shape.slice(1).reduce((a, b) => a * b, 1);
    const own = entry.shuffled ? unshuffled(raw, Type.BYTES_PER_ELEMENT, columns) : raw.slice();
    arrays[entry.name] = { data: new Type(own.buffer, 0, count), shape: entry.shape };
  }
  return { meta: header.meta, arrays };
};

/** @param {Uint8Array<ArrayBuffer>} bytes */
export const inflate = async (bytes) => {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
};

/** @param {string} text */
export const fromBase64 = (text) => Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));

/**
 * The pack of a compressed one.
 * @param {Uint8Array<ArrayBuffer>} bytes
 */
export const unpack = async (bytes) => decodePack(await inflate(bytes));

/** The replay that the server has. */
export const fetchReplay = async () => {
  const answer = await fetch("replay");
  if (!answer.ok) throw new Error(`the server answered ${answer.status}`);
  return unpack(new Uint8Array(await answer.arrayBuffer()));
};
