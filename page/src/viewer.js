// meshcat's viewer, as this page needs it. Points are [x, y, z] in MuJoCo's coordinates (z up);
// meshcat turns its whole scene, so three.js sees (x, z, -y).
import { THREE, Viewer } from "./meshcat.js";
/** @import { Three } from "./types.d.ts" */

const OWN = ["Background", "Cameras", "Lights", "Grid", "Axes"]; // meshcat's own objects
export const DEGREE = Math.PI / 180;

/** @param {ArrayLike<number>} point */
export const toView = (point) => new THREE.Vector3(point[0], point[2], -point[1]);

/** What meshcat's tree asks of a dat.gui folder; real folders take a second for 100 robots. */
const folder = () => ({
  domElement: document.createElement("div"),
  __folders: {},
  addFolder: folder,
  removeFolder() {},
  add: () => ({
    min() {
      return this;
    },
    max() {
      return this;
    },
    step() {
      return this;
    },
    onChange() {
      return this;
    },
    updateDisplay() {},
  }),
  remove() {},
});

/**
 * A viewer in a pane; `changed` is called whenever an object has come.
 * @param {HTMLElement} pane
 * @param {() => void} changed
 */
export const viewerIn = (pane, changed) => {
  const viewer = new Viewer(pane, false);
  const set = viewer.set_object.bind(viewer);
  const share = sharing();
  viewer.set_object = (/** @type {string[]} */ path, /** @type {Three} */ object) => {
    object.traverse?.(share);
    set(path, object);
    changed(); // one with a texture comes only when its image is loaded
  };
  const resize = viewer.set_3d_pane_size.bind(viewer);
  // meshcat takes the window's height, which is not ours
  viewer.set_3d_pane_size = () => {
    const { clientWidth: w, clientHeight: h } = pane;
    if (w && h) resize(w, h);
  };
  viewer.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  viewer.gui.domElement.style.display = "none";
  viewer.scene_tree.folder = folder();
  for (const name of ["Grid", "Axes", "Lights"]) viewer.set_property([name], "visible", false);
  viewer.hide_background(); // the page's own shines through
  return viewer;
};

/** Meshes with many numbers are sent once, and again as their identifier alone. */
const sharing = () => {
  /** @type {Map<string, Three>} */
  const known = new Map();
  /** @type {Map<string, Three[]>} */
  const waiting = new Map(); // meshes that came before what they have in common
  return (/** @type {Three} */ mesh) => {
    const { geometry } = mesh;
    if (geometry?.type !== "BufferGeometry") return;
    const { uuid } = geometry;
    if (geometry.attributes.position) {
      known.set(uuid, geometry);
      for (const each of waiting.get(uuid) ?? []) each.geometry = geometry;
      waiting.delete(uuid);
    } else if (known.has(uuid)) mesh.geometry = known.get(uuid);
    else waiting.set(uuid, [...(waiting.get(uuid) ?? []), mesh]);
  };
};

/**
 * The node of meshcat's tree at a path, or undefined.
 * @param {Three} viewer
 * @param {string} path
 */
export const nodeAt = (viewer, path) => {
  let node = viewer.scene_tree;
  for (const name of path.split("/").filter(Boolean)) node = node?.children[name];
  return node;
};

/**
 * The tops of what was drawn by commands: [name, three.js's object].
 * @param {Three} viewer
 * @returns {[string, Three][]}
 */
export const drawnIn = (viewer) =>
  Object.entries(viewer.scene_tree.children)
    .filter(([name]) => !OWN.includes(name))
    .map(([name, node]) => [name, node.object]);

/**
 * Forgets all that was drawn by commands.
 * @param {Three} viewer
 */
export const empty = (viewer) => {
  for (const [name, object] of drawnIn(viewer)) {
    object.traverse(dispose); // meshcat itself forgets what is inside groups
    viewer.delete_path([name]);
  }
};

/** @param {Three} object */
const dispose = ({ geometry, material }) => {
  geometry?.dispose();
  for (const each of [material].flat()) {
    each?.map?.dispose();
    each?.dispose();
  }
};

/**
 * Place of an object in MuJoCo's coordinates: all its own transforms below meshcat's scene.
 * @param {Three} viewer
 * @param {Three} object
 */
export const matrixIn = (viewer, object) => {
  const matrix = new THREE.Matrix4();
  for (let at = object; at && at !== viewer.scene; at = at.parent) {
    at.updateMatrix();
    matrix.premultiply(at.matrix);
  }
  return matrix;
};
