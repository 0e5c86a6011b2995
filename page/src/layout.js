// Where agents stand at an instant, in MuJoCo's coordinates, and how much room all of it takes.
import { THREE } from "./meshcat.js";
import { toView } from "./viewer.js";
/** @import { Bars } from "./bars.js" */
/** @import { Plan } from "./plan.js" */
/** @import { Instant, Numbers, Point, System, Three } from "./types.d.ts" */

/** @typedef {{point: Three, radius: number, half: number}} Room an upright cylinder around a point */

export class Layout {
  constructor() {
    /** @type {System[]} */
    this.fleets = [];
    /** @type {Bars[]} */
    this.bars = [];
    /** @type {Plan[]} */
    this.plans = [];
    this.time = 0; // s
    this.floor = 0; // the lowest point of what is drawn
    this.known = false; // whether there was an instant of the scene
    this.spill = 0; // how far bodies have swung out of the box, m
    this.spillTime = 0;
    /** @type {{low: number[], high: number[]} | null} */
    this.box = null; // on the ground, around the agents of fleets
    /** @type {Numbers} */
    this.poses = new Float64Array(0);
  }

  /**
   * Another scene.
   * @param {System[]} fleets
   * @param {Bars[]} bars
   * @param {Plan[]} plans
   */
  begin(fleets, bars, plans) {
    this.fleets = fleets;
    this.bars = bars;
    this.plans = plans;
    this.known = false;
    this.spill = 0;
    this.box = null;
  }

  /** @param {Instant} instant */
  update(instant) {
    this.poses = instant.poses ?? new Float64Array(0);
    this.known = true;
    this.time = instant.time;
    this.box = this.boxOf();
    if (this.box) this.noteSpill(this.box, instant.time);
  }

  /**
   * Where an agent of a fleet is.
   * @param {System} system
   * @param {number} agent
   */
  agentAt(system, agent) {
    const p = 8 * system.anchors[agent];
    return this.poses.slice(p, p + 3);
  }

  /**
   * A direction of an item's own frame as it is in the world.
   * @param {number} item
   * @param {Point} along
   * @returns {Point}
   */
  turned(item, along) {
    const [w, x, y, z] = this.poses.slice(8 * item + 3, 8 * item + 7);
    return new THREE.Vector3(...along).applyQuaternion(new THREE.Quaternion(x, y, z, w)).toArray();
  }

  /**
   * Where links of an agent begin: above a robot, on top of a bar.
   * @param {System} system
   * @param {number} agent
   * @returns {Point}
   */
  headOf(system, agent) {
    if (system.drawn_as === "bars") return this.barsOf(system).topOfAgent(agent);
    const [foot, head] = this.endsOf(system, agent);
    return [head[0], head[1], foot[2] + 0.8 * (head[2] - foot[2])];
  }

  /**
   * The lowest and the highest point over and under the place of an agent of a fleet.
   * @param {System} system
   * @param {number} agent
   * @returns {[Point, Point]}
   */
  endsOf(system, agent) {
    const [x, y, z] = this.agentAt(system, agent);
    const [, low, high] = system.rooms[agent];
    return [
      [x, y, z + low],
      [x, y, z + high],
    ];
  }

  /**
   * The room that an agent of a fleet takes, as three.js sees it.
   * @param {System} system
   * @param {number} agent
   * @returns {Room}
   */
  roomOf(system, agent) {
    const [foot, head] = this.endsOf(system, agent);
    const point = toView([foot[0], foot[1], (foot[2] + head[2]) / 2]);
    return { point, radius: system.rooms[agent][0], half: (head[2] - foot[2]) / 2 };
  }

  /** The rooms of all agents of fleets, as three.js sees them. */
  rooms() {
    return this.fleets.flatMap((system) =>
      system.anchors.map((_, agent) => this.roomOf(system, agent)),
    );
  }

  /**
   * The bars of a system that is drawn as such.
   * @param {System} system
   */
  barsOf(system) {
    return /** @type {Bars} */ (this.bars.find((bars) => bars.system === system));
  }

  boxOf() {
    const low = [Infinity, Infinity];
    const high = [-Infinity, -Infinity];
    for (const system of this.fleets)
      for (const anchor of system.anchors)
        for (const axis of [0, 1]) {
          const v = this.poses[8 * anchor + axis];
          low[axis] = Math.min(low[axis], v);
          high[axis] = Math.max(high[axis], v);
        }
    return Number.isFinite(low[0]) ? { low, high } : null;
  }

  /**
   * What has swung out is forgotten slowly: the view must not breathe.
   * @param {{low: number[], high: number[]}} box
   * @param {number} time s
   */
  noteSpill({ low, high }, time) {
    if (time > this.spillTime) this.spill *= Math.exp((this.spillTime - time) / 3);
    this.spillTime = time;
    const { poses } = this;
    const reach = Math.max(...this.fleets.flatMap(({ rooms }) => rooms.map(([radius]) => radius)));
    for (let p = 0; p < poses.length; p += 8)
      for (const axis of [0, 1]) {
        const out = Math.max(poses[p + axis] - high[axis], low[axis] - poses[p + axis]) - reach;
        if (poses[p + 7] !== 0 && out > this.spill) this.spill = out;
      }
  }

  /** The least and greatest y of robots in rows, one for each fleet, or null. */
  get lane() {
    if (!this.box) return null;
    for (const system of this.fleets) {
      const across = system.anchors.map((anchor) => this.poses[8 * anchor + 1]);
      if (Math.max(...across) - Math.min(...across) >= 0.3) return null;
    }
    return [this.box.low[1], this.box.high[1]];
  }

  get planar() {
    return this.lane === null ? 1 : 0;
  }

  /**
   * What should be in view, as three.js sees it.
   * @returns {Room[]}
   */
  seen() {
    const rooms = this.rooms();
    // what swings out does so from all of them
    for (const room of rooms) room.radius += this.spill;
    const points = [
      ...this.plans.flatMap((plan) => plan.corners(this.time, this.floor)),
      ...this.bars.flatMap((bars) => bars.corners()),
    ];
    return [...rooms, ...points.map((point) => ({ point: toView(point), radius: 0, half: 0 }))];
  }

  /** The middle of the agents, without what swings about them, as three.js sees it. */
  middle() {
    const box = new THREE.Box3();
    for (const { point, half } of this.rooms())
      for (const y of [point.y - half, point.y + half]) box.expandByPoint(point.clone().setY(y));
    for (const bars of this.bars)
      for (const corner of bars.corners()) box.expandByPoint(toView(corner));
    return box.isEmpty() ? new THREE.Vector3() : box.getCenter(new THREE.Vector3());
  }
}
