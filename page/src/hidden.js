// Robots that stand behind others: their outlines are seen through what hides them.
import { THREE } from "./meshcat.js";
/** @import { Three } from "./types.d.ts" */

const MANY = 60; // robots, from which on outlines would be all that is seen
const SHARP = 35; // degrees between faces, from which on an edge counts

export class Hidden {
  constructor() {
    /** @type {{lines: Three, mesh: Three}[]} */
    this.all = [];
  }

  /**
   * Outlines of what stands for agents; those of before are forgotten.
   * @param {Iterable<Three[][]>} systems meshes of each agent, by system
   */
  build(systems) {
    for (const { lines, mesh } of this.all) {
      mesh.remove(lines);
      lines.geometry.dispose();
      lines.material.dispose();
    }
    this.all = [];
    const meshes = [...systems].flat().flat();
    if (meshes.length > MANY) return;
    for (const mesh of meshes) {
      const material = new THREE.LineBasicMaterial({
        depthFunc: THREE.GreaterDepth,
        depthWrite: false,
        transparent: true,
        opacity: 0.85,
      });
      const lines = new THREE.LineSegments(new THREE.EdgesGeometry(mesh.geometry, SHARP), material);
      lines.renderOrder = 5;
      mesh.add(lines);
      this.all.push({ lines, mesh });
    }
  }

  /** In the colours that the robots have now. */
  colour() {
    for (const { lines, mesh } of this.all) lines.material.color.copy(mesh.material.color);
  }
}
