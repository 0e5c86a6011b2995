// What one agent takes the others to be: a translucent copy of each robot, ahead of it by what is
// thought too fast times one second; for bars, outlines at the height thought.
import { THREE } from "./meshcat.js";
import { colour } from "./theme.js";
import { matrixIn } from "./viewer.js";
/** @import { Scene } from "./scene.js" */
/** @import { Agent, Instant, Numbers, System, Three } from "./types.d.ts" */

const EDGES = new THREE.EdgesGeometry(new THREE.BoxGeometry(1, 1, 1).translate(0, 0, 0.5));
const SECOND = 1;
/**
 * What an agent takes all m actions to be; not a number where it keeps no estimate.
 * @param {System} system
 * @param {number} holder from 0
 * @param {Numbers} estimate all of the system's
 * @param {number} m
 * @returns {Numbers}
 */
const estimatesOf = ({ kept }, holder, estimate, m) => {
  if (!kept) return estimate.subarray(holder * m, (holder + 1) * m);
  const row = new Float64Array(m).fill(NaN);
  kept.by.forEach((agent, e) => {
    if (agent === holder + 1) row[kept.action[e]] = estimate[e];
  });
  return row;
};

/** @type {Record<string, number>} */
const DIRECTIONS = { "": 0, x: 0, y: 1, z: 2 };

export class Ghosts {
  /** @param {Scene} scene */
  constructor(scene) {
    this.scene = scene;
    this.group = new THREE.Group();
    scene.viewer.scene.add(this.group);
    /** @type {Agent | null} */
    this.shown = null; // whose estimates
    /** @type {Map<number, Three[]>} */
    this.copies = new Map(); // by agent, or by bar
  }

  /** Makes the copies anew when they are next needed. */
  forget() {
    for (const mesh of [...this.group.children]) this.group.remove(mesh);
    this.copies.clear();
  }

  /** @param {Agent | null} shown */
  show(shown) {
    this.forget();
    this.shown = shown;
    if (this.scene.instant) this.apply(this.scene.instant);
    this.scene.dirty();
  }

  /** @param {Instant} instant */
  apply(instant) {
    const { shown } = this;
    const system = this.scene.meta?.systems.find((each) => each.name === shown?.system);
    const { estimate, action } = (system && instant.systems[system.name]) ?? {};
    this.group.visible = Boolean(system && shown && estimate && action);
    if (!system || !shown || !estimate || !action) return;
    const row = estimatesOf(system, shown.agent, estimate, action.length);
    if (system.drawn_as === "bars") this.outlines(system, shown.agent, row);
    else this.shadows(system, shown.agent, row, action);
  }

  /**
   * @param {System} system
   * @param {number} holder who has the estimates
   * @param {Numbers} row of estimates
   */
  outlines(system, holder, row) {
    const bars = this.scene.layout.barsOf(system);
    system.action.owner.forEach((owner, k) => {
      if (owner === holder + 1) return;
      const [outline] = this.copiesOf(k, () => [this.outline()]);
      const [x, y] = bars.spot(k);
      outline.position.set(...bars.point(x, y, 0));
      outline.visible = Number.isFinite(row[k]); // others are not estimated
      const height = bars.scale * bars.heightOf(row[k]);
      outline.scale.set(0.5 * bars.scale, 0.5 * bars.scale, height || 1e-4);
    });
  }

  /**
   * What stands for an agent or a bar, made when it is first needed.
   * @param {number} k
   * @param {() => Three[]} make
   */
  copiesOf(k, make) {
    const copies = this.copies.get(k) ?? make();
    this.copies.set(k, copies);
    return copies;
  }

  outline() {
    const material = new THREE.LineBasicMaterial({ color: colour("ghost") });
    const lines = new THREE.LineSegments(EDGES, material);
    this.group.add(lines);
    return lines;
  }

  /**
   * @param {System} system
   * @param {number} holder
   * @param {Numbers} row
   * @param {Numbers} action
   */
  shadows(system, holder, row, action) {
    for (let agent = 0; agent < system.agents; agent++) {
      if (agent === holder) continue;
      const ahead = this.ahead(system, agent, row, action);
      const sources = this.scene.tinted.get(system.name)?.[agent] ?? [];
      const copies = this.copiesOf(agent, () => sources.map((mesh) => this.copy(mesh)));
      copies.forEach((copy, k) => {
        copy.matrix.copy(matrixIn(this.scene.viewer, sources[k]));
        ahead.forEach((v, axis) => (copy.matrix.elements[12 + axis] += v));
        // where nothing is mistaken the copy would only flicker in the robot's surface
        copy.visible = Math.hypot(...ahead) > 0.01;
      });
    }
  }

  /**
   * @param {System} system
   * @param {number} agent
   * @param {Numbers} row
   * @param {Numbers} action
   */
  ahead(system, agent, row, action) {
    const ahead = [0, 0, 0];
    system.action.owner.forEach((owner, k) => {
      const wrong = (row[k] - action[k]) * SECOND;
      if (owner === agent + 1 && Number.isFinite(wrong))
        ahead[DIRECTIONS[system.action.axis[k]] ?? 0] += wrong;
    });
    return ahead;
  }

  /** @param {Three} mesh */
  copy(mesh) {
    const material = new THREE.MeshPhongMaterial({
      color: colour("ghost"),
      transparent: true,
      opacity: 0.5,
      depthWrite: false,
    });
    material.emissive.set(colour("ghost")).multiplyScalar(0.35);
    const copy = new THREE.Mesh(mesh.geometry, material);
    copy.matrixAutoUpdate = false;
    this.group.add(copy);
    return copy;
  }
}
