// Drawn flat over the 3-D pane: labels, links, messages on their way, distances on the ground.
import { dashOf, setPalette } from "./colours.js";
import { headingTexts, isSolid } from "./compare.js";
import { Labels } from "./labels.js";
import { Links } from "./links.js";
import { colour } from "./theme.js";
import { decimals, fixed, number } from "./words.js";
/** @import { Pushing } from "./push.js" */
/** @import { Scene } from "./scene.js" */
/** @import { Agent, Instant, Run, Scene as Meta, System, Text } from "./types.d.ts" */

/** @typedef {{x: number, y: number, w: number, h: number}} Box in CSS pixels */
/** @param {Partial<Text>} kind */
const colourOf = ({ bad, limit, chosen, title }) =>
  bad ? "bad" : limit ? "limit" : chosen ? "accent" : title ? "muted" : "text";

const RING = 3; // px between a robot and the ring around it
const MANY = 60; // robots, of which labels make way for each other alone

/**
 * Whether two boxes have something in common.
 * @param {Box} a
 * @param {Box} b
 */
const meet = (a, b) => a.x < b.x + b.w && b.x < a.x + a.w && a.y < b.y + b.h && b.y < a.y + a.h;

const BODY = 24; // px from a robot's middle line, within which it is touched

/**
 * How far a point is from the straight line between two others, px.
 * @param {{x: number, y: number}} a
 * @param {{x: number, y: number}} b
 * @param {number} x
 * @param {number} y
 */
const awayFrom = (a, b, x, y) => {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const along = ((x - a.x) * dx + (y - a.y) * dy) / (dx * dx + dy * dy || 1);
  const t = Math.min(Math.max(along, 0), 1);
  return Math.hypot(a.x + t * dx - x, a.y + t * dy - y);
};

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
    this.labels = new Labels(this);
    /** @type {Pushing | null} */
    this.hands = null; // what hands do in the pane
    this.labelled = true;
    /** @type {System[]} */
    this.systems = [];
    /** @type {Run[]} */
    this.runs = []; // if several are compared
    /** @type {Box[]} */
    this.taken = []; // where texts are
    /** @type {Box[]} */
    this.bodies = []; // where robots are, unless they are many
    /** @type {(Agent & {x: number, y: number})[]} */
    this.marks = []; // where labels are, for the mouse
    /** @type {Agent | null} */
    this.highlighted = null;
  }

  /** @param {Meta} meta */
  setMeta({ systems, runs = [], palette }) {
    setPalette(palette);
    this.systems = systems;
    this.runs = runs;
    this.labels.begin(systems);
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
    this.labels.drawn = [];
    const solid = this.systems.filter(isSolid);
    this.bodies = this.bodiesOf(solid.filter(({ drawn_as: as }) => as === "fleet"));
    this.links.draw(solid, instant, now);
    for (const system of this.systems) if (system.shown.faint) this.rings(system);
    if (this.runs.length && solid.length === this.systems.length)
      for (const text of headingTexts(solid, this.runs, this.scene.layout)) this.text(text);
    this.hands?.drawUnder(context);
    for (const system of solid)
      if (system.drawn_as === "bars") this.barTexts(system);
      else this.labels.draw(system, instant, this.labelled);
    this.distances();
    this.hands?.draw(context);
  }

  /**
   * Rings around robots that lie over those of another run, dashed as their run is in the plots:
   * where both are nearly at one place, one would not see them.
   * @param {System} system
   */
  rings(system) {
    const { context } = this;
    if (system.drawn_as === "bars" || system.agents > MANY) return;
    context.strokeStyle = colour("ghost");
    context.lineWidth = 2;
    context.setLineDash(dashOf(system.run));
    for (const agent of system.anchors.keys()) {
      const box = this.scene.camera.boxOf(system, agent);
      if (!box) continue;
      const [w, h] = [box.w / 2 + RING, box.h / 2 + RING];
      context.beginPath();
      context.ellipse(box.x + box.w / 2, box.y + box.h / 2, w, h, 0, 0, 2 * Math.PI);
      context.stroke();
    }
    context.setLineDash([]);
  }

  /** Metres along the lane, at the ground's stronger lines. */
  distances() {
    const { context } = this;
    const { camera, surroundings, layout } = this.scene;
    if (!layout.box) return;
    const { low, high } = layout.box;
    const y = low[1] - (layout.lane === null ? 1.5 : 0.75);
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "top";
    context.fillStyle = colour("muted");
    const step = surroundings.ground.major > 10 ? surroundings.ground.major : 5;
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

  /** @param {System[]} fleets */
  bodiesOf(fleets) {
    if (fleets.reduce((sum, { agents }) => sum + agents, 0) > MANY) return [];
    return fleets
      .flatMap((system) => system.anchors.map((_, k) => this.scene.camera.boxOf(system, k)))
      .filter((box) => box !== null);
  }

  /**
   * Whether no text is there.
   * @param {Box} box
   */
  free(box) {
    return !this.taken.some((taken) => meet(box, taken));
  }

  /**
   * Whether no robot is there.
   * @param {Box} box
   */
  clear(box) {
    return !this.bodies.some((body) => meet(box, body));
  }

  /**
   * @param {System} system
   * @param {number} agent
   */
  isHighlighted(system, agent) {
    const which = this.highlighted;
    return which?.system === system.name && which?.agent === agent;
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
   * The agent at a point of the pane: its label, or what stands there, from the ground to its head.
   * @param {number} x
   * @param {number} y
   */
  agentAt(x, y) {
    const near = this.agentNear(x, y);
    if (near) return near;
    const { camera, layout } = this.scene;
    /** @type {Agent | null} */
    let best = null;
    let nearest = BODY;
    for (const system of this.scene.fleets)
      for (let agent = 0; agent < system.agents; agent++) {
        const foot = camera.project(layout.agentAt(system, agent));
        const head = camera.project(layout.headOf(system, agent));
        if (!foot || !head) continue;
        const away = awayFrom(foot, head, x, y);
        if (away < nearest) [best, nearest] = [{ system: system.name, agent }, away];
      }
    return best;
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
