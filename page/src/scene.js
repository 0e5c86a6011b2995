// The 3-D scene: what meshcat draws, with the poses, tints and bars of an instant.
import { Bars } from "./bars.js";
import { Batches } from "./batches.js";
import { Camera } from "./camera.js";
import { ramp } from "./colours.js";
import { Ghosts } from "./ghosts.js";
import { Hidden } from "./hidden.js";
import { Layout } from "./layout.js";
import { THREE } from "./meshcat.js";
import { plansOf } from "./plan.js";
import { Surroundings } from "./surroundings.js";
import { theme } from "./theme.js";
import { drawnIn, empty, matrixIn, nodeAt, viewerIn } from "./viewer.js";
/** @import { Plan } from "./plan.js" */
/** @import { Instant, Numbers, Scene as Meta, Store, System, Three } from "./types.d.ts" */

const FAINT = 0.4; // opacity of what lies over another run
const BELOW = 0.02; // m from one floor to the next system's, so that none flickers in another
const AGAIN = 500; // ms until objects that are not there yet are looked for again

export class Scene {
  /** @param {HTMLElement} pane */
  constructor(pane) {
    this.viewer = viewerIn(pane, () => (this.stale = true));
    this.layout = new Layout();
    this.camera = new Camera(this.viewer, pane, this.layout);
    this.surroundings = new Surroundings(this.viewer.scene);
    this.batches = new Batches(this.viewer.scene);
    this.ghosts = new Ghosts(this);
    this.hidden = new Hidden();
    /** @type {Bars[]} */
    this.bars = [];
    /** @type {Plan[]} */
    this.plans = [];
    /** @type {Three[]} */
    this.objects = []; // what has a pose
    /** @type {Map<string, Three[][]>} */
    this.tinted = new Map(); // meshes of each agent that take its colour, by system
    /** @type {Three[]} */
    this.statics = []; // meshes of what never moves: a model's floor, walls
    /** @type {Meta | null} */
    this.meta = null;
    /** @type {Instant | null} */
    this.instant = null;
    /** @type {System[]} */
    this.fleets = []; // systems that are drawn as robots
    this.complete = false; // all objects are there
    this.floorKnown = false;
    this.quality = 1;
    this.stale = true; // objects may have come, gone or been replaced
    this.nextLook = 0;
    this.restyle();
    new ResizeObserver(() => this.resized()).observe(pane);
  }

  resized() {
    this.viewer.set_3d_pane_size();
    if (this.layout.known && this.meta) this.camera.move();
  }

  restyle() {
    this.surroundings.restyle();
    for (const each of [...this.bars, ...this.plans]) each.restyle();
    this.dimStatics();
    this.ghosts.forget();
    this.dirty();
  }

  dirty() {
    this.viewer.set_dirty();
  }

  /**
   * One of meshcat's commands.
   * @param {Uint8Array} bytes
   */
  command(bytes) {
    this.viewer.handle_command_bytearray(bytes);
    this.stale = true;
  }

  /** Forgets a scene, as another one comes. */
  clear() {
    empty(this.viewer);
    for (const each of [...this.bars, ...this.plans]) each.remove();
    this.ghosts.show(null);
    this.batches.clear();
    this.bars = [];
    this.plans = [];
    this.meta = null;
    this.instant = null;
    this.stale = true;
  }

  /** @param {Meta} meta */
  setMeta(meta) {
    this.meta = meta;
    this.fleets = meta.systems.filter((system) => system.drawn_as === "fleet");
    for (const each of [...this.bars, ...this.plans]) each.remove();
    this.surroundings.setMeta(meta);
    this.plans = plansOf(this.viewer.scene, this.fleets);
    this.bars = meta.systems
      .filter((system) => system.drawn_as === "bars")
      .map((system) => new Bars(this.viewer.scene, system));
    this.instant = null;
    this.ghosts.show(null);
    this.layout.begin(this.fleets, this.bars, this.plans);
    this.camera.placed = false;
    this.floorKnown = false;
    this.stale = true;
  }

  /**
   * Finds the objects of the scene, again when some have come or are missing.
   * @param {Meta} meta
   */
  resolve(meta) {
    const now = Date.now();
    if (!this.stale && (this.complete || now < this.nextLook)) return;
    this.objects = meta.items.map((path) => nodeAt(this.viewer, path)?.object);
    this.tinted = new Map(this.fleets.map((system) => [system.name, this.tintedOf(system)]));
    this.hidden.build(this.tinted.values());
    this.statics = this.staticMeshes();
    this.dimStatics();
    this.complete = !this.objects.includes(undefined);
    this.nextLook = now + AGAIN;
    this.stale = false;
    this.ghosts.forget();
    for (const system of this.fleets) this.fade(system);
    this.batches.build(this.objects);
  }

  /**
   * What never moves of a system goes where it is drawn; what lies over another run is translucent.
   * @param {System} system
   */
  fade(system) {
    const { items: [first, count], world = "", shown } = system;
    const still = nodeAt(this.viewer, world)?.children["<object>"]?.object;
    if (still) {
      still.position.set(...shown.offset, -BELOW * this.fleets.indexOf(system));
      still.visible = !shown.faint && !shown.off;
    }
    for (const object of this.objects.slice(first, first + count))
      object?.traverse((/** @type {Three} */ { material, userData }) => {
        if (!material?.color) return;
        const { opacity, transparent, depthWrite } = (userData.solid ??= { ...material });
        material.opacity = shown.faint ? FAINT * opacity : opacity;
        material.transparent = shown.faint || transparent;
        material.depthWrite = !shown.faint && depthWrite;
      });
  }

  staticMeshes() {
    const moving = new Set(this.objects);
    /** @type {Three[]} */
    const found = [];
    const collect = (/** @type {Three} */ object) => {
      if (moving.has(object)) return;
      if (object.isMesh && object.material.color) found.push(object);
      object.children.forEach(collect);
    };
    for (const [, object] of drawnIn(this.viewer)) collect(object);
    return found;
  }

  /** A white floor would outshine a dark page and all that stands on it. */
  dimStatics() {
    const part = theme() === "dark" ? 0.35 : 1;
    for (const { material, userData } of this.statics) {
      userData.colour ??= material.color.clone();
      material.color.copy(userData.colour).multiplyScalar(part);
    }
  }

  /** @param {System} system */
  tintedOf(system) {
    return system.tints.map((paths) => {
      /** @type {Three[]} */
      const meshes = [];
      for (const path of paths)
        nodeAt(this.viewer, path)?.object.traverse((/** @type {Three} */ object) => {
          if (object.material?.color) meshes.push(object);
        });
      return meshes;
    });
  }

  /**
   * Where an item is, in MuJoCo's coordinates; null if there is none at this path.
   * @param {string} path
   */
  position(path) {
    const node = nodeAt(this.viewer, path);
    return node ? matrixIn(this.viewer, node.object).elements.slice(12, 15) : null;
  }

  // ---- an instant

  /**
   * @param {Instant} instant
   * @param {Store} store
   */
  apply(instant, store) {
    if (!this.meta) return;
    this.resolve(this.meta);
    this.instant = instant;
    this.applyPoses(instant.poses);
    this.applyTints(instant);
    this.findFloor();
    this.layout.update(instant);
    for (const plan of this.plans) plan.update(instant, this.layout);
    this.placeBars(instant, store);
    this.batches.update();
    this.ghosts.apply(instant);
    this.camera.move();
    this.dirty();
  }

  /** @param {Numbers | undefined} poses */
  applyPoses(poses) {
    if (!poses) return;
    for (let k = 0; k < this.objects.length; k++) {
      const object = this.objects[k];
      if (!object) continue;
      const p = 8 * k;
      object.position.set(poses[p], poses[p + 1], poses[p + 2]);
      object.quaternion.set(poses[p + 4], poses[p + 5], poses[p + 6], poses[p + 3]);
      object.visible = poses[p + 7] !== 0;
      object.scale.set(1, 1, poses[p + 7] || 1);
    }
  }

  /** @param {Instant} instant */
  applyTints(instant) {
    for (const [name, agents] of this.tinted) {
      const shares = instant.systems[name].share;
      agents.forEach((meshes, agent) => {
        const [r, g, b] = ramp(shares ? shares[agent] : NaN);
        for (const mesh of meshes) mesh.material.color.setRGB(r, g, b);
      });
    }
    this.hidden.colour();
  }

  /** Found once: a model's own, or under robots of a lane, which may float around z = 0. */
  findFloor() {
    if (this.floorKnown || !this.complete || this.objects.length === 0) return;
    this.viewer.scene.updateMatrixWorld(true);
    const box = new THREE.Box3();
    for (const anchor of this.fleets.flatMap(({ anchors }) => anchors))
      box.expandByObject(this.objects[anchor]);
    [this.layout.floor = Math.min(0, box.min.y)] = this.fleets.flatMap(({ floor }) => floor ?? []);
    this.floorKnown = true;
  }

  /**
   * Bars stand behind the fleets.
   * @param {Instant} instant
   * @param {Store} store
   */
  placeBars(instant, store) {
    const { box, floor } = this.layout;
    let behind = box ? box.high[1] + 2.4 : 0;
    for (const bars of this.bars) {
      const { over } = bars.system.shown;
      const under = over && this.bars.find(({ system }) => system === over);
      if (under) {
        bars.update(instant, store, under.origin, under.scale);
        continue;
      }
      const span = box ? box.high[0] - box.low[0] : 0;
      const scale = box ? Math.min(Math.max((0.6 * span) / bars.width, 0.8), 6) : 1;
      const x = box ? (box.low[0] + box.high[0]) / 2 : 0;
      bars.update(instant, store, [x, behind, floor], scale);
      behind += scale * (bars.depth + 1);
    }
  }

  // ---- pictures

  /**
   * Fewer pixels while a slow machine plays (without a graphics card); all of them at rest.
   * @param {number} quality
   */
  setQuality(quality) {
    if (quality === this.quality) return;
    this.quality = quality;
    this.viewer.renderer.setPixelRatio(quality * Math.min(devicePixelRatio, 2));
    this.viewer.set_3d_pane_size();
  }

  render() {
    this.surroundings.place(this.camera, this.layout);
    this.camera.render();
  }

  /** Gives the graphics context up, of which a browser has some sixteen for all its pages. */
  rest() {
    this.viewer.renderer.forceContextLoss();
  }

  /** Gets it back; three.js then sends everything again. */
  wake() {
    this.viewer.renderer.forceContextRestore();
    this.dirty();
  }

  get needsRender() {
    return this.viewer.needs_render;
  }
}
