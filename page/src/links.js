// Who hears whom: links between agents, and messages on their way along them.
import { isThere } from "./instant.js";
import { colour, reducedMotion } from "./theme.js";
/** @import { Scene } from "./scene.js" */
/** @import { Instant, Numbers, System } from "./types.d.ts" */

/** @typedef {{system: System, from: number, to: number, lost: boolean, born: number}} Pulse */

const TRAVEL = 650; // ms a message is seen on its way
const REST = 400; // ms between two of one link
const FLOW = 1800; // ms between two of one link, where messages flow continuously
const MANY = 160; // links, from which on only some of them show messages
const DENSE = 300; // edges, from which on they are straight

/**
 * A point of a curve, from its start (0) to its end (1).
 * @param {{x: number, y: number}[]} curve its two ends, with the point that bends it between
 * @param {number} t
 */
export const along = ([a, c, b], t) => {
  const u = 1 - t;
  return {
    x: u * u * a.x + 2 * u * t * c.x + t * t * b.x,
    y: u * u * a.y + 2 * u * t * c.y + t * t * b.y,
  };
};

export class Links {
  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Scene} scene
   */
  constructor(context, scene) {
    this.context = context;
    this.scene = scene;
    this.shown = true;
    /** @type {Pulse[]} */
    this.pulses = []; // messages on their way, between agents from 0
    this.lastPulse = new Map(); // when each link had one
    this.heads = new Map(); // where links of each agent begin
    /** @type {Map<string, Numbers | undefined>} */
    this.linked = new Map(); // of graphs that change: which of a system's edges there are now
    /** @type {Map<string, Instant["systems"][string]>} */
    this.arrays = new Map(); // of each system now
    /** @type {(system: System, pair: [number, number]) => boolean} */
    this.isLost = () => false; // whether a link, of agents from 1, was taken away
  }

  /** Another scene. */
  begin() {
    this.pulses = [];
    this.lastPulse.clear();
  }

  /**
   * Starts pulses for messages, not more than the eye can follow.
   * @param {System} system
   * @param {Numbers | undefined} counts links x [passed, lost]
   * @param {number} now
   */
  messages(system, counts, now) {
    if (!this.pulsing || !counts || document.hidden) return;
    const every = Math.max(1, Math.ceil(system.links.length / MANY));
    for (let link = 0; link < system.links.length; link += every) {
      if (!this.among(system, system.links[link])) continue;
      const [passed, lost] = [counts[2 * link], counts[2 * link + 1]];
      if (passed + lost > 0) this.pulse(system, link, lost > 0, now, REST);
    }
  }

  /**
   * A slow steady flow, where messages have no instants.
   * @param {System[]} systems
   * @param {number} now
   */
  flow(systems, now) {
    if (!this.pulsing) return;
    for (const system of systems)
      if (system.message_period === null && !system.triggered) this.flowIn(system, now);
  }

  /**
   * @param {System} system
   * @param {number} now
   */
  flowIn(system, now) {
    const every = Math.max(1, Math.ceil(system.links.length / MANY));
    const linked = this.linked.get(system.name);
    for (let link = 0; link < system.links.length; link += every) {
      if (linked && !(linked[link >> 1] > 0.5)) continue; // an edge's two links follow each other
      if (!this.among(system, system.links[link])) continue;
      const key = `${system.name}/${link}`;
      // each begins at a moment of its own
      if (!this.lastPulse.has(key)) this.lastPulse.set(key, now - ((link * 617) % FLOW));
      this.pulse(system, link, false, now, FLOW);
    }
  }

  /**
   * Whether both agents, from 1, are there, and hear each other if they ever do.
   * @param {System} system
   * @param {[number, number]} pair
   */
  among(system, [a, b]) {
    const own = this.arrays.get(system.name);
    return isThere(own, a - 1) && isThere(own, b - 1) && !this.isLost(system, [a, b]);
  }

  get pulsing() {
    return this.shown && !reducedMotion();
  }

  /**
   * @param {System} system
   * @param {number} link
   * @param {boolean} lost
   * @param {number} now ms
   * @param {number} rest ms since the one before
   */
  pulse(system, link, lost, now, rest) {
    const key = `${system.name}/${link}`;
    if (now - (this.lastPulse.get(key) ?? -Infinity) < rest) return;
    this.lastPulse.set(key, now);
    const [hearer, sender] = system.links[link];
    this.pulses.push({ system, from: sender - 1, to: hearer - 1, lost, born: now });
  }

  /**
   * Curve between two agents on the screen: its two ends and the point that bends it.
   * @param {System} system
   * @param {number} a
   * @param {number} b
   */
  curve(system, a, b) {
    if (system.edges.length > DENSE) return this.straight(system, a, b);
    const { camera, layout } = this.scene;
    const [p, q] = [layout.headOf(system, a), layout.headOf(system, b)];
    const length = Math.hypot(...p.map((v, k) => v - q[k]));
    const middle = p.map((v, k) => (v + q[k]) / 2);
    middle[2] += Math.max(0.25, 0.22 * length);
    const ends = [p, middle, q].map((point) => camera.project(point));
    return ends.includes(null) ? null : ends;
  }

  /**
   * @param {System} system
   * @param {number} a
   * @param {number} b
   */
  straight(system, a, b) {
    const [from, to] = [this.headAt(system, a), this.headAt(system, b)];
    return from && to && [from, { x: (from.x + to.x) / 2, y: (from.y + to.y) / 2 }, to];
  }

  /**
   * Where the links of an agent begin on the screen; once a picture for each.
   * @param {System} system
   * @param {number} agent
   */
  headAt(system, agent) {
    const key = `${system.name}/${agent}`;
    const { camera, layout } = this.scene;
    if (!this.heads.has(key)) this.heads.set(key, camera.project(layout.headOf(system, agent)));
    return this.heads.get(key);
  }

  /**
   * @param {System[]} systems
   * @param {Instant} instant
   * @param {number} now
   */
  draw(systems, instant, now) {
    if (!this.shown) return void (this.pulses = []); // or they would keep pictures coming
    this.heads.clear();
    for (const system of systems) {
      const linked = instant.systems[system.name].linked;
      this.linked.set(system.name, linked);
      this.arrays.set(system.name, instant.systems[system.name]);
      this.edges(system, (edge) => !linked || linked[edge] > 0.5);
    }
    this.pulses = this.pulses.filter(({ born, lost }) => now - born < (lost ? 1.5 : 1) * TRAVEL);
    for (const pulse of this.pulses) this.drawPulse(pulse, (now - pulse.born) / TRAVEL);
  }

  /**
   * @param {System} system
   * @param {(edge: number) => boolean} there
   */
  edges(system, there) {
    const { context } = this;
    const dense = system.edges.length > 60;
    context.lineWidth = dense ? 0.8 : 1.4;
    context.strokeStyle = colour("link");
    context.globalAlpha = dense ? Math.max(0.15, 30 / system.edges.length) : 0.75;
    context.setLineDash(system.edges_are === "messages" ? [] : [4, 4]);
    context.beginPath();
    for (const [edge, [a, b]] of system.edges.entries()) {
      if (!there(edge) || !this.among(system, [a, b])) continue;
      const curve = this.curve(system, a - 1, b - 1);
      if (!curve) continue;
      const [from, bend, to] = curve;
      context.moveTo(from.x, from.y);
      context.quadraticCurveTo(bend.x, bend.y, to.x, to.y);
    }
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
    for (const pair of system.edges) if (this.isLost(system, pair)) this.lostEdge(system, pair);
  }

  /**
   * A link that was taken away: a broken line and a cross.
   * @param {System} system
   * @param {[number, number]} pair
   */
  lostEdge(system, [a, b]) {
    const { context } = this;
    const curve = this.curve(system, a - 1, b - 1);
    if (!curve) return;
    const [from, bend, to] = curve;
    context.strokeStyle = colour("bad");
    context.lineWidth = 1.2;
    context.setLineDash([3, 6]);
    context.beginPath();
    context.moveTo(from.x, from.y);
    context.quadraticCurveTo(bend.x, bend.y, to.x, to.y);
    context.stroke();
    context.setLineDash([]);
    const { x, y } = along(curve, 0.5);
    this.cross(x, y, 1);
  }

  /**
   * The edge that is nearest to a point of the pane, if one is near.
   * @param {System[]} systems
   * @param {number} x
   * @param {number} y
   * @param {number} near px
   */
  nearest(systems, x, y, near) {
    /** @type {{system: System, edge: [number, number]} | null} */
    let best = null;
    let least = near;
    for (const system of systems)
      for (const edge of system.edges) {
        const curve = this.curve(system, edge[0] - 1, edge[1] - 1);
        if (!curve) continue;
        // not at its ends, where several meet
        for (let k = 3; k <= 29; k++) {
          const at = along(curve, k / 32);
          const away = Math.hypot(at.x - x, at.y - y);
          if (away < least) [best, least] = [{ system, edge }, away];
        }
      }
    return best;
  }

  /**
   * @param {Pulse} pulse
   * @param {number} age in times that a message is seen
   */
  drawPulse({ system, from, to, lost }, age) {
    const { context } = this;
    const curve = this.curve(system, from, to);
    if (!curve) return;
    const { x, y } = along(curve, lost ? Math.min(age, 0.5) : age);
    context.fillStyle = context.strokeStyle = colour(lost ? "bad" : "pulse");
    if (lost && age > 0.5) return this.cross(x, y, Math.max(0, 1.5 - age));
    context.beginPath();
    context.arc(x, y, 3, 0, 2 * Math.PI);
    context.fill();
  }

  /**
   * A message that is lost.
   * @param {number} x
   * @param {number} y
   * @param {number} alpha
   */
  cross(x, y, alpha) {
    const { context } = this;
    context.globalAlpha = alpha;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x - 4, y - 4);
    context.lineTo(x + 4, y + 4);
    context.moveTo(x + 4, y - 4);
    context.lineTo(x - 4, y + 4);
    context.stroke();
    context.globalAlpha = 1;
  }
}
