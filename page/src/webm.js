// WebM: pictures that an encoder has made, in the container that browsers and players open (a Matroska
// file of EBML elements: number, size, content; see the Matroska specification, RFC 9559).

/** @typedef {{data: Uint8Array<ArrayBuffer>, time: number, key: boolean}} Picture coded; time in ms; key: needs none before */

const TIME = 1e6; // ns, in units of which times are told

/**
 * A number in so many bytes.
 * @param {number} value
 * @param {number} bytes
 */
const uint = (value, bytes = 8) => {
  const out = new Uint8Array(bytes);
  for (let k = bytes - 1, rest = value; k >= 0; k--, rest = Math.floor(rest / 256)) out[k] = rest % 256;
  return out;
};

/** @param {number} value */
const float = (value) => {
  const out = new Uint8Array(8);
  new DataView(out.buffer).setFloat64(0, value);
  return out;
};

/** @param {string} value */
const text = (value) => new TextEncoder().encode(value);

/** @param {Uint8Array[]} parts */
const joined = (parts) => {
  const out = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
};

/**
 * An element: its number as the specification has it, the size in eight bytes, the content.
 * @param {number} id
 * @param {Uint8Array[]} content
 */
const element = (id, ...content) => {
  const size = uint(content.reduce((sum, part) => sum + part.length, 0));
  size[0] = 1; // of eight bytes
  const width = id > 0xffffff ? 4 : id > 0xffff ? 3 : id > 0xff ? 2 : 1;
  return joined([uint(id, width), size, ...content]);
};

const HEAD = element(
  0x1a45dfa3,
  element(0x4286, uint(1, 1)), // version
  element(0x42f7, uint(1, 1)), // that readers need
  element(0x42f2, uint(4, 1)), // bytes of the longest number
  element(0x42f3, uint(8, 1)), // of the longest size
  element(0x4282, text("webm")),
  element(0x4287, uint(4, 1)), // version of that
  element(0x4285, uint(2, 1)),
);

/**
 * Pictures from one that needs none before to the next, with their times.
 * @param {Picture[]} pictures
 */
const clusterOf = (pictures) => {
  const begin = pictures[0].time;
  const blocks = pictures.map(({ data, time, key }) =>
    element(0xa3, uint(0x81, 1), uint(time - begin, 2), uint(key ? 0x80 : 0, 1), data),
  );
  return element(0x1f43b675, element(0xe7, uint(begin)), ...blocks);
};

/**
 * Where each cluster is, so that players can go to a time.
 * @param {number[]} times ms
 * @param {number[]} places bytes from the begin of the segment's content
 */
const cuesOf = (times, places) =>
  element(
    0x1c53bb6b,
    ...times.map((time, k) =>
      element(
        0xbb,
        element(0xb3, uint(time)),
        element(0xb7, element(0xf7, uint(1, 1)), element(0xf1, uint(places[k]))),
      ),
    ),
  );

/**
 * A film as a file's bytes.
 * @param {Picture[]} pictures in order; the first needs none before
 * @param {{codec: string, width: number, height: number, duration: number}} about px and ms
 */
export const webmOf = (pictures, { codec, width, height, duration }) => {
  /** @type {Picture[][]} */
  const groups = [];
  for (const picture of pictures)
    if (picture.key) groups.push([picture]);
    else groups[groups.length - 1].push(picture);
  const info = element(
    0x1549a966,
    element(0x2ad7b1, uint(TIME)),
    element(0x4d80, text("gne_mj")),
    element(0x5741, text("gne_mj")),
    element(0x4489, float(duration)),
  );
  const track = element(
    0x1654ae6b,
    element(
      0xae,
      element(0xd7, uint(1, 1)), // its number
      element(0x73c5, uint(1, 1)),
      element(0x83, uint(1, 1)), // of pictures
      element(0x9c, uint(0, 1)), // a picture a block
      element(0x86, text(codec)),
      element(0xe0, element(0xb0, uint(width)), element(0xba, uint(height))),
    ),
  );
  const clusters = groups.map(clusterOf);
  const times = groups.map(([{ time }]) => time);
  const before = info.length + track.length + cuesOf(times, times).length; // as long wherever they are
  const places = clusters.map((_, k) =>
    clusters.slice(0, k).reduce((sum, { length }) => sum + length, before),
  );
  return joined([HEAD, element(0x18538067, info, track, cuesOf(times, places), ...clusters)]);
};
