// Drawn flat over the 3-D pane: labels, links, messages on their way, distances on the ground.
import { line } from "./colours.js";
import { headingTexts, isSolid } from "./compare.js";
import { isThere } from "./instant.js";
import { Links } from "./links.js";
import { colour } from "./theme.js";
import { decimals, fixed, number } from "./words.js";
/** @import { Scene } from "./scene.js" */
/** @import { Agent, Instant, Run, Scene as Meta, System, Text } from "./types.d.ts" */

/** @typedef {{x: number, y: number, w: number, h: number}} Box in CSS pixels */
/** @typedef {Box & {wide: number, text: string}} Pill of an agent's number, so wide, and a text */

/**
 * Agents in the order in which they get a label when there is no room for all: 1, 9, 5, ...
 * @param {number} n
 */
const labelOrder = (n) => {
  const zeros = (/** @type {number} */ k) => (k === 0 ? 32 : Math.log2(k & -k));
  return [...Array(n).keys()].sort((a, b) => zeros(b) - zeros(a) || a - b);
};

/** @param {Partial<Text>} kind */
const colourOf = ({ bad, limit, chosen, title }) =>
  bad ? "bad" : limit ? "limit" : chosen ? "accent" : title ? "muted" : "text";

export class Overlay {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Scene} scene
   */
  constructor(canvas, scene) {
    this.canvas = canvas;
    this.scene = scene;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    this.links = new Links(this.context, scene);
    this.labelled = true;
    /** @type {System[]} */
    this.systems = [];
    /** @type {Run[]} */
    this.runs = []; // if several are compared
    /** @type {Map<string, number[]>} */
    this.orders = new Map();
    /** @type {Box[]} */
    this.taken = []; // where texts are
    /** @type {(Agent & {x: number, y: number})[]} */
    this.marks = []; // where labels are, for the mouse
    /** @type {Agent | null} */
    this.highlighted = null;
  }

  /** @param {Meta} meta */
  setMeta({ systems, runs = [] }) {
    this.systems = systems;
    this.runs = runs;
    this.orders = new Map(systems.map((system) => [system.name, labelOrder(system.agents)]));
    this.links.begin();
  }

  /** Whether pictures must go on although nothing new came. */
  get moving() {
    return this.links.pulses.length > 0;
  }

  // ---- drawing

  /**
   * @param {Instant} instant
   * @param {number} now
   */
  draw(instant, now) {
    const { canvas, context } = this;
    const ratio = Math.min(devicePixelRatio, 2);
    const [w, h] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
      canvas.width = Math.round(w * ratio);
      canvas.height = Math.round(h * ratio);
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, w, h);
    this.taken = [];
    this.marks = [];
    const solid = this.systems.filter(isSolid);
    this.links.draw(solid, instant, now);
    if (this.runs.length && solid.length === this.systems.length)
      for (const text of headingTexts(solid, this.runs, this.scene.layout)) this.text(text);
    for (const system of solid)
      if (system.drawn_as === "bars") this.barTexts(system);
      else if (this.labelled) this.labels(system, instant);
    this.distances();
  }

  /** Metres along the lane, at the ground's stronger lines. */
  distances() {
    const { context } = this;
    const { camera, ground, layout } = this.scene;
    if (!layout.box) return;
    const { low, high } = layout.box;
    const y = low[1] - (layout.lane === null ? 1.5 : 0.75);
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "top";
    context.fillStyle = colour("muted");
    const step = ground.major > 10 ? ground.major : 5;
    const wide = this.canvas.clientWidth;
    for (
      let x = Math.floor((low[0] - 2 * step) / step) * step;
      x <= high[0] + 2 * step;
      x += step
    ) {
      const p = camera.project([x, y, layout.floor]);
      const box = p && { x: p.x - 26, y: p.y, w: 52, h: 18 };
      if (!box || box.x < 0 || box.x + box.w > wide || !this.free(box)) continue;
      this.taken.push(box);
      this.haloed(`${number(x, 6)} m`, p.x, p.y + 4);
    }
  }

  // ---- labels

  /** @param {Box} box */
  free(box) {
    return !this.taken.some(
      (t) => box.x < t.x + t.w && t.x < box.x + box.w && box.y < t.y + t.h && t.y < box.y + box.h,
    );
  }

  /**
   * @param {System} system
   * @param {Instant} instant
   */
  labels(system, instant) {
    const shares = instant.systems[system.name].share;
    const share = (/** @type {number} */ agent) => (shares ? shares[agent] : NaN);
    const first = (/** @type {number} */ agent) =>
      this.isHighlighted(system, agent) || share(agent) > 1;
    const order = this.orders.get(system.name) ?? [];
    const away = (/** @type {number} */ agent) => !isThere(instant.systems[system.name], agent);
    const urgent = order.filter(first);
    for (const agent of [...urgent, ...order.filter((each) => !first(each))])
      if (!away(agent)) this.label(system, agent, share(agent));
  }

  /**
   * @param {System} system
   * @param {number} agent
   */
  isHighlighted(system, agent) {
    const which = this.highlighted;
    return which?.system === system.name && which?.agent === agent;
  }

  /**
   * @param {System} system
   * @param {number} agent
   * @param {number} share
   */
  label(system, agent, share) {
    const [x, y, z] = this.scene.layout.agentAt(system, agent);
    const p = this.scene.camera.project([x, y, z + system.height]);
    if (!p) return;
    this.marks.push({ x: p.x, y: p.y, system: system.name, agent });
    const name = String(agent + 1);
    const out = share > 1;
    const digits = out && share < 1.1 ? 1 : 0; // not "100 %" of what is outside
    const used = out ? "outside" : "";
    const percent = Number.isFinite(share) ? `${(100 * share).toFixed(digits)} %` : used;
    for (const text of percent ? [percent, ""] : [""]) {
      const box = this.pillBox(p, name, out ? `⚠ ${text}` : text);
      if (!this.free(box) && !this.isHighlighted(system, agent)) continue;
      this.taken.push(box);
      return this.pill(box, { name, system, agent, out });
    }
  }

  /**
   * @param {{x: number, y: number}} p
   * @param {string} name
   * @param {string} text
   */
  pillBox(p, name, text) {
    const context = this.context;
    context.font = "600 13px system-ui, sans-serif";
    const wide = context.measureText(name).width;
    context.font = "12px system-ui, sans-serif";
    const more = text ? context.measureText(text).width + 7 : 0;
    const w = wide + more + 14;
    return { x: p.x - w / 2, y: p.y - 22, w, h: 20, wide, text };
  }

  /**
   * @param {Pill} box
   * @param {{name: string, system: System, agent: number, out: boolean}} about
   */
  pill(box, { name, system, agent, out }) {
    const context = this.context;
    const chosen = this.isHighlighted(system, agent);
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
   * The look of the agent's line in the plots, under its label.
   * @param {Box} box
   * @param {number} agent
   */
  swatch(box, agent) {
    const context = this.context;
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

  /** @param {System} system */
  barTexts(system) {
    const bars = this.scene.layout.barsOf(system);
    for (const text of [bars.title(), ...bars.gaugeTexts()]) this.text(text);
    const owners = system.action.owner;
    const digits = decimals(bars.reference);
    owners.forEach((owner, k) => {
      const p = this.scene.camera.project(bars.top(k));
      if (p) this.marks.push({ x: p.x, y: p.y, system: system.name, agent: owner - 1 });
      if (!this.labelled) return;
      const chosen = this.isHighlighted(system, owner - 1);
      const axis = system.action.axis[k] || "";
      this.text({ point: bars.foot(k), text: `${owner}${axis}`, shift: 11, bold: true, chosen });
      this.text({
        point: bars.top(k),
        text: fixed(bars.values[k] ?? null, digits),
        shift: -9,
        chosen,
      });
    });
  }

  /**
   * A text at a point of the scene, where there is room.
   * @param {Text} about
   */
  text({ point, text, shift = 0, align = "center", ...kind }) {
    const p = this.scene.camera.project(point);
    if (!p) return;
    const context = this.context;
    context.font = `${kind.bold || kind.title ? "600 " : ""}12px system-ui, sans-serif`;
    const w = context.measureText(text).width;
    const left = align === "center" ? p.x - w / 2 : p.x + 4;
    const box = { x: left - 2, y: p.y + shift - 7, w: w + 4, h: 14 };
    if (!this.free(box) && !kind.chosen) return;
    this.taken.push(box);
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillStyle = colour(colourOf(kind));
    this.haloed(text, left, p.y + shift);
  }

  /**
   * Text that can be read on anything.
   * @param {string} text
   * @param {number} x
   * @param {number} y
   */
  haloed(text, x, y) {
    const context = this.context;
    context.lineWidth = 3;
    context.lineJoin = "round";
    context.strokeStyle = colour("halo");
    context.strokeText(text, x, y);
    context.fillText(text, x, y);
  }

  /**
   * The agent whose label or head is near a point of the pane.
   * @param {number} x
   * @param {number} y
   */
  agentNear(x, y) {
    /** @type {Agent | null} */
    let best = null;
    let nearest = 26;
    for (const mark of this.marks) {
      const away = Math.hypot(mark.x - x, mark.y - y + 4);
      if (away < nearest) [best, nearest] = [{ system: mark.system, agent: mark.agent }, away];
    }
    return best;
  }
}
