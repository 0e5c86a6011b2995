// Many robots: equal shapes are drawn together. A hundred robots are a thousand meshes, and without
// a graphics card it is the number of drawing calls that counts.
import { THREE } from "./meshcat.js";
/** @import { Three } from "./types.d.ts" */

const FEW = 150; // meshes, up to which they are drawn one by one
const HIDDEN = new THREE.Matrix4().makeScale(0, 0, 0);

const sums = new WeakMap(); // of geometries, which many meshes may share

/**
 * A number that tells apart geometries without parameters.
 * @param {Three} geometry
 */
const checksum = (geometry) => {
  if (sums.has(geometry)) return sums.get(geometry);
  const values = geometry.attributes.position?.array || [];
  let sum = 0;
  for (let i = 0; i < values.length; i++) sum += values[i] * ((i % 7) + 1);
  const found = `${values.length} ${geometry.index?.count ?? 0} ${sum}`;
  sums.set(geometry, found);
  return found;
};

/** @param {Three} mesh */
const signature = ({ geometry, material: m }) => {
  const shape = geometry.parameters ? JSON.stringify(geometry.parameters) : checksum(geometry);
  return [
    geometry.type,
    shape,
    m.type,
    m.opacity,
    m.transparent,
    m.side,
    m.wireframe,
    m.shininess,
  ].join("|");
};

/** @param {Three} mesh */
const batchable = (mesh) =>
  mesh.isMesh &&
  !mesh.isInstancedMesh &&
  !Array.isArray(mesh.material) &&
  !mesh.material.map &&
  !mesh.material.vertexColors;

/**
 * Far away nobody counts the corners of a ball.
 * @param {Three} geometry
 * @param {number} count of its copies
 */
const coarser = (geometry, count) => {
  const p = geometry.parameters;
  const around = count > 100 ? 10 : 14;
  if (geometry.type === "SphereGeometry") return new THREE.SphereGeometry(p.radius, around, 7);
  if (geometry.type === "CylinderGeometry")
    return new THREE.CylinderGeometry(
      p.radiusTop,
      p.radiusBottom,
      p.height,
      around,
      1,
      p.openEnded,
    );
  return geometry;
};

export class Batches {
  /** @param {Three} scene */
  constructor(scene) {
    this.scene = scene;
    this.group = new THREE.Group();
    // instances are placed in the world, whatever the scene's rotation is
    scene.updateMatrix();
    this.group.matrixAutoUpdate = false;
    this.group.matrix.copy(scene.matrix).invert();
    scene.add(this.group);
    /** @type {{instanced: Three, meshes: Three[]}[]} */
    this.all = [];
  }

  clear() {
    for (const { instanced, meshes } of this.all) {
      this.group.remove(instanced);
      instanced.dispose();
      for (const mesh of meshes) mesh.layers.enable(0);
    }
    this.all = [];
  }

  /**
   * Batches the meshes below these objects, if they are many.
   * @param {Three[]} roots
   */
  build(roots) {
    this.clear();
    const groups = new Map();
    let count = 0;
    for (const root of roots)
      root?.traverse((/** @type {Three} */ mesh) => {
        if (!batchable(mesh)) return;
        const key = signature(mesh);
        if (!groups.has(key)) groups.set(key, []);
        groups.get(key).push(mesh);
        count++;
      });
    if (count <= FEW) return;
    for (const meshes of groups.values()) if (meshes.length > 4) this.add(meshes);
  }

  /** @param {Three[]} meshes */
  add(meshes) {
    const material = meshes[0].material.clone();
    material.color.setRGB(1, 1, 1); // colours are the instances' own
    const shape = coarser(meshes[0].geometry, meshes.length);
    const instanced = new THREE.InstancedMesh(shape, material, meshes.length);
    instanced.frustumCulled = false;
    this.group.add(instanced);
    for (const mesh of meshes) mesh.layers.disableAll();
    this.all.push({ instanced, meshes });
  }

  update() {
    if (!this.all.length) return;
    this.scene.updateMatrixWorld();
    for (const { instanced, meshes } of this.all) {
      meshes.forEach((mesh, k) => {
        instanced.setMatrixAt(k, this.visible(mesh) ? mesh.matrixWorld : HIDDEN);
        instanced.setColorAt(k, mesh.material.color);
      });
      instanced.instanceMatrix.needsUpdate = true;
      instanced.instanceColor.needsUpdate = true;
    }
  }

  /** @param {Three} mesh */
  visible(mesh) {
    for (let at = mesh; at; at = at.parent) if (!at.visible) return false;
    return true;
  }
}
