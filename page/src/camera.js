// The camera: what it follows, from how far, and where points are on the screen.
import { THREE } from "./meshcat.js";
import { DEGREE, toView } from "./viewer.js";
/** @import { Layout } from "./layout.js" */
/** @import { Follow, Three } from "./types.d.ts" */

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
      minDistance: 0.8,
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
   * Distance from the target at which all points are in view from a direction.
   * @param {Three} direction
   * @param {Three} target
   */
  fitDistance(direction, target) {
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
    let distance = 2.5;
    for (const point of this.layout.points()) {
      const p = point.sub(target);
      const nearer = p.dot(back);
      distance = Math.max(
        distance,
        Math.abs(p.dot(right)) / (0.88 * wide) + nearer,
        Math.abs(p.dot(up)) / (0.76 * tangent) + nearer,
      );
    }
    return distance;
  }

  /** From the side, and for a long lane nearly along it, so that the near ones stay large. */
  defaultDirection() {
    const { box, bars, planar } = this.layout;
    const length = box ? box.high[0] - box.low[0] : 0;
    const long = Math.min(Math.max((length - 40) / 60, 0), 1);
    const azimuth = (box ? -84 + 75 * long : -84) * DEGREE;
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
    const near = this.follow.kind === "agent" ? 6 : this.fitDistance(direction, target);
    this.look(target, direction, near);
    this.zoom = 1;
    this.followPoint = target;
    this.placed = true;
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
}
