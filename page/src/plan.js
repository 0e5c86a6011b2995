// On the ground under robots whose positions are decided: the region where they must stay, bounded
// distances between them, discs that must not meet, and where they are heading (their outputs).
import { ramp } from "./colours.js";
import { isThere } from "./instant.js";
import { THREE } from "./meshcat.js";
import { colour } from "./theme.js";
/** @import { Layout } from "./layout.js" */
/** @import { Instant, Numbers, Plan as Meta, Point, Quantity, System, Three } from "./types.d.ts" */

const STRIP = new THREE.PlaneGeometry(1, 1);
const AROUND = 48;
const MARK = new THREE.RingGeometry(0.06, 0.1, AROUND);
const WIDTH = 0.05; // m, of a bounded distance
const LEAD = 0.02; // of the line to an output
const RIM = 0.025; // of a disc
const STEP = 0.004; // m between what lies on each other

/**
 * How much of its bounds a value uses: 1 on one, from the middle of two or from 0 to the only one.
 * @param {number} value
 * @param {number | null | undefined} high
 * @param {number | null | undefined} low
 */
const used = (value, high, low) => {
  const middle = typeof high === "number" && typeof low === "number" ? (high + low) / 2 : 0;
  const up = typeof high === "number" ? (value - middle) / (high - middle) : -Infinity;
  const down = typeof low === "number" ? (value - middle) / (low - middle) : -Infinity;
  return Math.max(up, down);
};

export class Plan {
  /**
   * @param {Three} parent
   * @param {System} system
   * @param {Meta} plan
   */
  constructor(parent, system, plan) {
    this.system = system;
    this.plan = plan;
    this.group = new THREE.Group();
    parent.add(this.group);
    this.region = plan.region.length ? this.addRegion() : null;
    this.distances = system.quantities.flatMap((quantity) => this.addDistances(quantity));
    this.discs = plan.radius.map((radius) => (radius === null ? null : this.addDisc(radius)));
    this.leads = plan.radius.map(() => this.add(STRIP, 0.6));
    this.marks = plan.radius.map(() => this.add(MARK));
    this.restyle();
  }

  /**
   * @param {Three} geometry
   * @param {number} opacity
   */
  add(geometry, opacity = 1) {
    const material = new THREE.MeshBasicMaterial({
      transparent: true,
      opacity,
      depthWrite: false,
      side: THREE.DoubleSide,
    });
    const mesh = new THREE.Mesh(geometry, material);
    this.group.add(mesh);
    return mesh;
  }

  addRegion() {
    const corners = this.plan.region.map(([x, y]) => new THREE.Vector2(x, y));
    const fill = this.add(new THREE.ShapeGeometry(new THREE.Shape(corners)), 0.1);
    const edge = new THREE.LineLoop(
      new THREE.BufferGeometry().setFromPoints(corners.map(({ x, y }) => new THREE.Vector3(x, y))),
      new THREE.LineBasicMaterial(),
    );
    this.group.add(edge);
    return { fill, edge };
  }

  /**
   * A strip for each entry that has a greatest value.
   * @param {Quantity} quantity
   */
  addDistances(quantity) {
    return quantity.between.flatMap((pair, entry) =>
      pair && (typeof quantity.bound?.[entry] === "number" || quantity.moving_bounds.bound)
        ? [{ quantity, entry, pair, strip: this.add(STRIP, 0.9) }]
        : [],
    );
  }

  /** @param {number} radius */
  addDisc(radius) {
    return this.add(new THREE.RingGeometry(Math.max(radius - RIM, 0), radius, AROUND), 0.8);
  }

  restyle() {
    this.region?.fill.material.color.set(colour("limit"));
    this.region?.edge.material.color.set(colour("limit"));
    for (const disc of this.discs) disc?.material.color.set(colour("muted"));
    for (const mesh of [...this.leads, ...this.marks]) mesh.material.color.set(colour("accent"));
  }

  remove() {
    this.group.parent?.remove(this.group);
  }

  /**
   * Where what positions are relative to is.
   * @param {number} time s
   */
  origin(time) {
    const { offset } = this.system.shown;
    return this.plan.velocity.map((v, axis) => v * time + offset[axis]);
  }

  /** Corners of the region, if it is of the size of a fleet, for the camera. */
  corners(/** @type {number} */ time, /** @type {number} */ floor) {
    const [x, y] = this.origin(time);
    return this.plan.region.map(([a, b]) => /** @type {Point} */ ([x + a, y + b, floor]));
  }

  /**
   * @param {Instant} instant
   * @param {Layout} layout
   */
  update(instant, layout) {
    const own = instant.systems[this.system.name];
    const [x, y] = this.origin(instant.time);
    const level = layout.floor + STEP;
    this.group.visible = !this.system.shown.faint && !this.system.shown.off;
    if (this.region)
      for (const part of [this.region.fill, this.region.edge]) part.position.set(x, y, level);
    for (const distance of this.distances) this.placeDistance(distance, own, layout);
    for (let agent = 0; agent < this.system.agents; agent++) {
      const [px, py] = layout.agentAt(this.system, agent);
      for (const mesh of [this.discs[agent], this.leads[agent], this.marks[agent]])
        if (mesh) mesh.visible = isThere(own, agent);
      this.discs[agent]?.position.set(px, py, level + STEP);
      this.placeOutput(agent, [px, py], own.action, instant.time, level);
    }
  }

  /**
   * @param {Plan["distances"][number]} distance
   * @param {Record<string, Numbers | undefined>} own arrays of the system
   * @param {Layout} layout
   */
  placeDistance({ quantity, entry, pair: [a, b], strip }, own, layout) {
    const value = own[`quantity/${quantity.name}`]?.[entry] ?? NaN;
    strip.visible = isThere(own, a - 1) && isThere(own, b - 1);
    const { bound, lower_bound: lower } = quantity.moving_bounds;
    const high = bound ? own[`quantity/${bound}`]?.[entry] : quantity.bound?.[entry];
    const low = lower ? own[`quantity/${lower}`]?.[entry] : quantity.lower_bound?.[entry];
    const share = used(value, high, low);
    strip.material.color.setRGB(...ramp(share));
    const ends = [a, b].map((agent) => layout.agentAt(this.system, agent - 1));
    this.stretch(strip, ends[0], ends[1], WIDTH, layout.floor + 2 * STEP);
  }

  /**
   * The mark at an agent's output, and the line that leads to it.
   * @param {number} agent
   * @param {number[]} from where it is
   * @param {Numbers | undefined} action
   * @param {number} time s
   * @param {number} level m
   */
  placeOutput(agent, from, action, time, level) {
    const { owner } = this.system.action;
    const to = this.origin(time);
    if (to.length < 2 || !action) return;
    const axes = owner.flatMap((each, k) => (each === agent + 1 ? [k] : []));
    axes.forEach((k, axis) => (to[axis] += action[k]));
    if (axes.length === 1) to[1] = from[1]; // on a lane
    this.marks[agent].position.set(to[0], to[1], level + 3 * STEP);
    this.stretch(this.leads[agent], from, to, LEAD, level + 2 * STEP);
  }

  /**
   * @param {Three} strip
   * @param {ArrayLike<number>} from
   * @param {ArrayLike<number>} to
   * @param {number} width
   * @param {number} level
   */
  stretch(strip, from, to, width, level) {
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    strip.position.set((from[0] + to[0]) / 2, (from[1] + to[1]) / 2, level);
    strip.rotation.z = Math.atan2(dy, dx);
    strip.scale.set(Math.max(Math.hypot(dx, dy), 1e-6), width, 1);
  }
}

/**
 * The plans of systems that have one.
 * @param {Three} parent
 * @param {System[]} systems
 */
export const plansOf = (parent, systems) =>
  systems.flatMap((system) => (system.plan ? [new Plan(parent, system, system.plan)] : []));
