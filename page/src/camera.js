// The camera: what it follows, from how far, and where points are on the screen.
import { THREE } from "./meshcat.js";
import { DEGREE, toView } from "./viewer.js";
/** @import { Layout, Room } from "./layout.js" */
/** @import { Box } from "./overlay.js" */
/** @import { Follow, System, Three } from "./types.d.ts" */

const AROUND = 3; // distances at which one robot fits, from which it is followed

export class Camera {
  /**
   * @param {Three} viewer meshcat's
   * @param {HTMLElement} pane
   * @param {Layout} layout
   */
  constructor(viewer, pane, layout) {
    this.viewer = viewer;
    this.pane = pane;
    this.layout = layout;
    this.lens = viewer.camera;
    Object.assign(this.lens, { fov: 38, near: 0.05, far: 4000 });
    this.controls = viewer.controls;
    Object.assign(this.controls, {
      maxPolarAngle: 89 * DEGREE,
      minDistance: 0.2,
      maxDistance: 1500,
    });
    this.controls.addEventListener("change", () => {
      if (!this.rendering) this.rememberZoom();
    });
    this.rendering = false; // what changes then is not the user's doing
    /** @type {Follow} */
    this.follow = { kind: "fleet" };
    this.following = true;
    this.zoom = 1; // distance, in distances at which all fits
    this.placed = false;
    this.followPoint = new THREE.Vector3(); // where what is followed was
  }

  followed() {
    const { kind, system, agent = 0 } = this.follow;
    if (kind === "agent") {
      const fleet = this.layout.fleets.find((each) => each.name === system);
      if (fleet) return toView(this.layout.agentAt(fleet, agent));
    }
    return this.layout.middle();
  }

  /**
   * Distance from the target at which all is in view from a direction.
   * @param {Three} direction
   * @param {Three} target
   * @param {Room[]} rooms what all is
   */
  fitDistance(direction, target, rooms = this.layout.seen()) {
    const view = new THREE.Matrix4().lookAt(
      direction,
      new THREE.Vector3(),
      new THREE.Vector3(0, 1, 0),
    );
    const [right, up, back] = [0, 1, 2].map((k) =>
      new THREE.Vector3().setFromMatrixColumn(view, k),
    );
    const tangent = Math.tan((this.lens.fov / 2) * DEGREE);
    const wide = tangent * (this.pane.clientWidth / Math.max(this.pane.clientHeight, 1));
    let distance = this.controls.minDistance;
    for (const { point, radius, half } of rooms) {
      const p = point.clone().sub(target);
      /** How far an upright cylinder goes along an axis. */
      const out = (/** @type {Three} */ axis) =>
        radius * Math.hypot(axis.x, axis.z) + half * Math.abs(axis.y);
      const nearer = p.dot(back) + out(back);
      distance = Math.max(
        distance,
        (Math.abs(p.dot(right)) + out(right)) / (0.88 * wide) + nearer,
        (Math.abs(p.dot(up)) + out(up)) / (0.76 * tangent) + nearer,
      );
    }
    return distance;
  }

  /**
   * From the side, and for a long lane nearly along it, so that the near ones stay large; fleets
   * that are wider than they are long from behind.
   */
  defaultDirection() {
    const { box, bars, planar } = this.layout;
    const [length, width] = box ? [0, 1].map((axis) => box.high[axis] - box.low[axis]) : [0, 0];
    const long = Math.min(Math.max((length - 40) / 60, 0), 1);
    const azimuth = (width > length && planar ? -174 : -84 + 75 * long) * DEGREE;
    const rows = bars.reduce((sum, each) => sum + each.rows, 0);
    const ofBars = rows > 1 ? 32 : 12;
    const ofFleet = planar ? 36 : 20 - 13 * long;
    const elevation = (box ? ofFleet : ofBars) * DEGREE;
    const flat = Math.cos(elevation);
    return toView([Math.cos(azimuth) * flat, Math.sin(azimuth) * flat, Math.sin(elevation)]);
  }

  fit() {
    if (!this.layout.known) return;
    const target = this.followed();
    const direction = this.defaultDirection();
    this.look(target, direction, this.distanceFrom(direction, target));
    this.zoom = 1;
    this.followPoint = target;
    this.placed = true;
  }

  /**
   * From how far what is followed is looked at first.
   * @param {Three} direction
   * @param {Three} target
   */
  distanceFrom(direction, target) {
    const { kind, system, agent = 0 } = this.follow;
    const fleet = this.layout.fleets.find((each) => each.name === system);
    if (kind !== "agent" || !fleet) return this.fitDistance(direction, target);
    return AROUND * this.fitDistance(direction, target, [this.layout.roomOf(fleet, agent)]);
  }

  /**
   * @param {Three} target
   * @param {Three} direction
   * @param {number} distance
   */
  look(target, direction, distance) {
    this.controls.target.copy(target);
    this.lens.position.copy(target).addScaledVector(direction, distance);
    this.lens.lookAt(target);
    this.viewer.set_dirty();
  }

  arm() {
    const arm = this.lens.position.clone().sub(this.controls.target);
    const distance = arm.length();
    return { direction: arm.divideScalar(distance || 1), distance };
  }

  rememberZoom() {
    if (!this.layout.known) return;
    const { direction, distance } = this.arm();
    this.zoom = distance / this.fitDistance(direction, this.controls.target);
  }

  /** Camera and target go with what is followed; for a fleet the distance keeps it in view. */
  move() {
    if (!this.placed) return this.fit();
    if (!this.following) return;
    const point = this.followed();
    const target = this.controls.target.clone().add(point).sub(this.followPoint);
    const { direction, distance } = this.arm();
    const fleet = this.follow.kind === "fleet";
    this.look(
      target,
      direction,
      fleet ? this.zoom * this.fitDistance(direction, target) : distance,
    );
    this.followPoint = point;
  }

  /** @param {Follow} follow */
  setFollow(follow) {
    this.following = follow.kind !== "none";
    if (!this.following) return;
    this.follow = follow;
    this.fit();
  }

  /**
   * Turns about the target (degrees) and zooms (factor), for the keyboard.
   * @param {number} turn
   * @param {number} factor
   */
  nudge(turn, factor) {
    const { direction, distance } = this.arm();
    direction.applyAxisAngle(new THREE.Vector3(0, 1, 0), turn * DEGREE);
    this.look(this.controls.target.clone(), direction, distance * factor);
    this.rememberZoom();
  }

  render() {
    this.rendering = true;
    this.viewer.render();
    this.rendering = false;
  }

  /**
   * Where a point is in the pane, in CSS pixels; null behind the camera.
   * @param {ArrayLike<number>} point
   */
  project(point) {
    const p = toView(point).project(this.lens);
    if (p.z > 1 || p.z < -1) return null;
    return {
      x: ((p.x + 1) / 2) * this.pane.clientWidth,
      y: ((1 - p.y) / 2) * this.pane.clientHeight,
    };
  }

  /**
   * What an agent of a fleet covers of the pane, in CSS pixels; null behind the camera.
   * @param {System} system
   * @param {number} agent
   * @returns {Box | null}
   */
  boxOf(system, agent) {
    const [foot, head] = this.layout.endsOf(system, agent).map((end) => this.project(end));
    if (!foot || !head) return null;
    const { point, radius } = this.layout.roomOf(system, agent);
    const { direction } = this.arm();
    const depth = this.lens.position.clone().sub(point).dot(direction);
    const tangent = Math.tan((this.lens.fov / 2) * DEGREE);
    const wide = (radius * this.pane.clientHeight) / (2 * tangent * Math.max(depth, this.lens.near));
    const deep = wide * Math.abs(direction.y); // of a level disc, as it is seen from above
    const top = Math.min(foot.y, head.y) - deep;
    return { x: head.x - wide, y: top, w: 2 * wide, h: Math.max(foot.y, head.y) + deep - top };
  }
}
