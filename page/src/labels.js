// Labels of robots, which make way for each other and for robots: one that finds no room above its
// robot stands beside, below or further above, with a line that leads to it.
import { line } from "./colours.js";
import { isThere } from "./instant.js";
import { colour } from "./theme.js";
import { percent } from "./words.js";
/** @import { Box, Overlay } from "./overlay.js" */
/** @import { Instant, System } from "./types.d.ts" */

/** @typedef {Box & {wide: number, text: string}} Pill of an agent's number, so wide, and a text */

const HIGH = 20; // px of a label
const STEP = HIGH + 4; // px from one place to the next

// Places in the order in which they are tried: from right above a robot in a label's widths and in
// steps, and then in the robot's own half widths and in its heights
const PLACES = [
  [0, 0, 0, 0], [0, -1, 0, 0], [0.65, -0.5, 0, 0], [-0.65, -0.5, 0, 0],
  [0.55, 0.5, 1, 0.5], [-0.55, 0.5, -1, 0.5], [0, 1, 0, 1], [0, -2, 0, 0],
  [0.8, -1.5, 0, 0], [-0.8, -1.5, 0, 0], [0.6, 1, 0, 1], [-0.6, 1, 0, 1], [0, 2, 0, 1],
  [0, -3, 0, 0], [0.9, 0.4, 0, 0], [-0.9, 0.4, 0, 0], [1.2, 0.5, 1, 0.5], [-1.2, 0.5, -1, 0.5],
  [0, -4, 0, 0],
]; // prettier-ignore

/**
 * Agents in the order in which they get a label when there is no room for all: 1, 9, 5, ...
 * @param {number} n
 */
const labelOrder = (n) => {
  const zeros = (/** @type {number} */ k) => (k === 0 ? 32 : Math.log2(k & -k));
  return [...Array(n).keys()].sort((a, b) => zeros(b) - zeros(a) || a - b);
};

/**
 * A label at one of the places.
 * @param {number[]} place
 * @param {Pill} pill right above
 * @param {Box} body of the robot
 * @returns {Pill}
 */
const placed = ([right, down, side, below], pill, body) => ({
  ...pill,
  x: pill.x + right * pill.w + (side * body.w) / 2,
  y: pill.y + down * STEP + below * body.h,
});

/**
 * The point of a box that is nearest to another one.
 * @param {Box} box
 * @param {number} x
 * @param {number} y
 */
const nearest = (box, x, y) => ({
  x: Math.min(Math.max(x, box.x), box.x + box.w),
  y: Math.min(Math.max(y, box.y), box.y + box.h),
});

export class Labels {
  /** @param {Overlay} overlay */
  constructor(overlay) {
    this.overlay = overlay;
    /** @type {Map<string, number[]>} */
    this.orders = new Map();
    /** @type {Map<string, number>} */
    this.places = new Map(); // where each label was in the picture before
    /** @type {(Pill & {system: string})[]} */
    this.drawn = []; // in this picture
  }

  /** @param {System[]} systems of another scene */
  begin(systems) {
    this.orders = new Map(systems.map((system) => [system.name, labelOrder(system.agents)]));
    this.places.clear();
  }

  /**
   * @param {System} system
   * @param {Instant} instant
   * @param {boolean} labelled whether they are to be seen, besides the one that is pointed at
   */
  draw(system, instant, labelled) {
    const shares = instant.systems[system.name].share;
    const share = (/** @type {number} */ agent) => (shares ? shares[agent] : NaN);
    const pointed = (/** @type {number} */ agent) => this.overlay.isHighlighted(system, agent);
    const first = (/** @type {number} */ agent) => pointed(agent) || share(agent) > 1;
    const order = this.orders.get(system.name) ?? [];
    const urgent = order.filter(first);
    const seen = [...urgent, ...order.filter((each) => !first(each))].filter(
      (agent) => isThere(instant.systems[system.name], agent) && (labelled || pointed(agent)),
    );
    const found = seen.flatMap((agent) => this.label(system, agent, share(agent)) ?? []);
    for (const { pill, body } of found) this.lead(pill, body); // under all labels
    for (const { pill, about } of found) this.pill(pill, about);
  }

  /**
   * A label that finds room, which is then taken.
   * @param {System} system
   * @param {number} agent
   * @param {number} share
   */
  label(system, agent, share) {
    const { overlay } = this;
    const body = overlay.scene.camera.boxOf(system, agent);
    if (!body) return;
    const p = { x: body.x + body.w / 2, y: body.y };
    overlay.marks.push({ x: p.x, y: p.y, system: system.name, agent });
    const name = String(agent + 1);
    const out = share > 1;
    const used = percent(share);
    for (const text of used ? [used, ""] : [""]) {
      const pill = this.room(system, agent, this.pillBox(p, name, out ? `⚠ ${text}` : text), body);
      if (!pill) continue;
      overlay.taken.push(pill);
      this.drawn.push({ ...pill, system: system.name });
      overlay.marks.push({ x: pill.x + pill.w / 2, y: pill.y + HIGH / 2, system: system.name, agent });
      return { pill, body, about: { name, system, agent, out } };
    }
    this.places.delete(`${system.name} ${agent}`);
  }

  /**
   * A label where there is room for it, first where it was, over robots only if there is no other;
   * null where there is none.
   * @param {System} system
   * @param {number} agent
   * @param {Pill} pill right above
   * @param {Box} body of the robot
   */
  room(system, agent, pill, body) {
    const { overlay } = this;
    const key = `${system.name} ${agent}`;
    const before = this.places.get(key) ?? 0;
    const places = [before, ...PLACES.keys()].map((k) => ({ k, box: placed(PLACES[k], pill, body) }));
    const free = places.filter(({ k, box }) => (k === 0 || this.inside(box)) && overlay.free(box));
    const found = free.find(({ box }) => this.inside(box) && overlay.clear(box)) ?? free[0];
    if (found) {
      const { k, box } = found;
      // back to the head only when there is plenty of room, or labels would flicker
      this.places.set(key, k === before && before > 0 && this.lonely(pill) ? 0 : k);
      return box;
    }
    return overlay.isHighlighted(system, agent) ? pill : null;
  }

  /** @param {Box} box */
  inside({ x, y, w, h }) {
    const { clientWidth: wide, clientHeight: high } = this.overlay.canvas;
    return x >= 0 && x + w <= wide && y >= 0 && y + h <= high;
  }

  /** @param {Box} box */
  lonely({ x, y, w, h }) {
    const around = { x: x - 8, y: y - 8, w: w + 16, h: h + 16 };
    return this.overlay.free(around) && this.inside(around) && this.overlay.clear({ x, y, w, h });
  }

  /**
   * @param {{x: number, y: number}} p
   * @param {string} name
   * @param {string} text
   * @returns {Pill}
   */
  pillBox(p, name, text) {
    const { context } = this.overlay;
    context.font = "600 13px system-ui, sans-serif";
    const wide = context.measureText(name).width;
    context.font = "12px system-ui, sans-serif";
    const more = text ? context.measureText(text).width + 7 : 0;
    const w = wide + more + 14;
    return { x: p.x - w / 2, y: p.y - 22, w, h: HIGH, wide, text };
  }

  /**
   * @param {Pill} box
   * @param {{name: string, system: System, agent: number, out: boolean}} about
   */
  pill(box, { name, system, agent, out }) {
    const { context } = this.overlay;
    const chosen = this.overlay.isHighlighted(system, agent);
    context.beginPath();
    context.roundRect(box.x, box.y, box.w, box.h, 5);
    context.fillStyle = out ? colour("bad-fill") : colour("pill");
    context.fill();
    context.lineWidth = chosen ? 2 : 1;
    context.strokeStyle = colour(chosen ? "accent" : "pill-edge");
    context.stroke();
    context.textBaseline = "middle";
    context.textAlign = "left";
    context.fillStyle = out ? "#fff" : colour("text");
    context.font = "600 13px system-ui, sans-serif";
    context.fillText(name, box.x + 7, box.y + 10.5);
    context.font = "12px system-ui, sans-serif";
    if (!out) context.fillStyle = colour("muted");
    context.fillText(box.text, box.x + 14 + box.wide, box.y + 10.5);
    if (system.agents <= 14 && !out) this.swatch(box, agent);
  }

  /**
   * A line to the robot, where the label is not at it.
   * @param {Box} box
   * @param {Box} body
   */
  lead(box, body) {
    const p = nearest(body, box.x + box.w / 2, box.y + box.h / 2);
    const { x, y } = nearest(box, p.x, p.y);
    if (Math.hypot(p.x - x, p.y - y) < 8) return;
    const { context } = this.overlay;
    context.strokeStyle = colour("muted");
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(p.x, p.y);
    context.stroke();
  }

  /**
   * The look of the agent's line in the plots, under its label.
   * @param {Box} box
   * @param {number} agent
   */
  swatch(box, agent) {
    const { context } = this.overlay;
    const look = line(agent);
    context.strokeStyle = look.colour;
    context.lineWidth = 2.5;
    context.setLineDash(look.dash);
    context.beginPath();
    context.moveTo(box.x + 5, box.y + box.h);
    context.lineTo(box.x + box.w - 5, box.y + box.h);
    context.stroke();
    context.setLineDash([]);
  }
}
