"use strict";
// The 3-D scene: meshcat's viewer, poses, tints, ground and camera. Points are [x, y, z] in
// MuJoCo's coordinates (z up); meshcat turns its whole scene, so three.js sees (x, z, -y).
(() => {
  const THREE = MeshCat.THREE;
  const DEGREE = Math.PI / 180;
  const OWN = ["Background", "Cameras", "Lights", "Grid", "Axes"]; // meshcat's own objects

  GNE.toView = ([x, y, z]) => new THREE.Vector3(x, z, -y);

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

  const dispose = ({ geometry, material }) => {
    geometry?.dispose();
    for (const each of [material].flat()) {
      each?.map?.dispose();
      each?.dispose();
    }
  };

  const GROUND_VERTEX = `
    varying vec2 at;
    uniform float size;
    void main() {
      at = position.xy * size;
      gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    }`;

  // lines about a pixel wide at any distance, fading out around the middle of the view
  const GROUND_FRAGMENT = `
    varying vec2 at;
    uniform vec3 colour;
    uniform vec2 middle;
    uniform float minor, major, reach, lane, laneWidth, strength;
    float lines(float spacing) {
      vec2 width = fwidth(at / spacing);
      vec2 away = abs(fract(at / spacing - 0.5) - 0.5) / max(width, 1e-6);
      vec2 drawn = (1.0 - min(away, 1.0)) * clamp(0.5 / width - 0.5, 0.0, 1.0);
      return max(drawn.x, drawn.y);
    }
    void main() {
      float alpha = max(0.35 * lines(minor), 0.8 * lines(major));
      float inside = laneWidth > 0.0 ? 1.0 - step(laneWidth, abs(at.y - lane)) : 0.0;
      alpha = max(alpha, 0.16 * inside);
      float fade = 1.0 - smoothstep(0.25, 1.0, length(at - middle) / reach);
      gl_FragColor = vec4(colour, strength * alpha * fade);
    }`;

  class Ground {
    constructor(scene) {
      const uniform = (value) => ({ value });
      this.uniforms = {
        size: uniform(1),
        colour: uniform(new THREE.Color()),
        middle: uniform(new THREE.Vector2()),
        minor: uniform(1),
        major: uniform(10),
        reach: uniform(30),
        lane: uniform(0),
        laneWidth: uniform(0),
        strength: uniform(0.6),
      };
      const material = new THREE.ShaderMaterial({
        uniforms: this.uniforms,
        vertexShader: GROUND_VERTEX,
        fragmentShader: GROUND_FRAGMENT,
        transparent: true,
        depthWrite: false,
        side: THREE.DoubleSide,
        extensions: { derivatives: true },
      });
      this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), material);
      this.mesh.renderOrder = -1;
      this.mesh.frustumCulled = false;
      scene.add(this.mesh);
    }

    /** Follows the point that the camera looks at, in whole squares, so that lines stand still. */
    place(target, distance, floor, lane) {
      const u = this.uniforms;
      const minor = distance < 45 ? 1 : distance < 200 ? 5 : 25;
      const major = (this.major = 10 * minor);
      const snap = (v) => Math.round(v / major) * major;
      const reach = Math.max(8, 4 * distance);
      const origin = [snap(target[0]), snap(target[1])];
      this.mesh.position.set(origin[0], origin[1], floor - 0.02); // below a model's own floor
      this.mesh.scale.setScalar(2 * reach + major);
      u.size.value = 2 * reach + major;
      [u.minor.value, u.major.value, u.reach.value] = [minor, major, reach];
      u.middle.value.set(target[0] - origin[0], target[1] - origin[1]);
      u.laneWidth.value = lane === null ? 0 : 0.75;
      u.lane.value = (lane ?? 0) - origin[1];
    }
  }

  GNE.Scene = class {
    constructor(pane) {
      this.pane = pane;
      this.viewer = new MeshCat.Viewer(pane, false);
      this.prepareViewer();
      this.addLights();
      this.ground = new Ground(this.viewer.scene);
      this.batches = new GNE.Batches(this.viewer.scene);
      this.bars = [];
      this.ghosts = null;
      this.spill = 0;
      this.follow = { kind: "fleet" };
      this.following = true;
      this.zoom = 1; // distance of the camera, in distances at which all fits
      this.floor = 0;
      this.meta = null;
      this.restyle();
      new ResizeObserver(() => this.resized()).observe(pane);
    }

    resized() {
      this.viewer.set_3d_pane_size();
      if (this.instant && this.meta) this.moveCamera();
    }

    prepareViewer() {
      const viewer = this.viewer;
      const set = viewer.set_object.bind(viewer);
      viewer.set_object = (path, object) => {
        set(path, object);
        this.stale = true; // one with a texture comes only when its image is loaded
      };
      const resize = viewer.set_3d_pane_size.bind(viewer);
      // meshcat takes the window's height, which is not ours
      viewer.set_3d_pane_size = () => {
        const { clientWidth: w, clientHeight: h } = this.pane;
        if (w && h) resize(w, h);
      };
      viewer.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      viewer.gui.domElement.style.display = "none";
      viewer.scene_tree.folder = folder();
      for (const name of ["Grid", "Axes", "Lights"]) viewer.set_property([name], "visible", false);
      viewer.hide_background(); // the page's own shines through
      this.camera = viewer.camera;
      Object.assign(this.camera, { fov: 38, near: 0.05, far: 4000 });
      this.controls = viewer.controls;
      Object.assign(this.controls, {
        maxPolarAngle: 89 * DEGREE,
        minDistance: 0.8,
        maxDistance: 1500,
      });
      this.controls.addEventListener("change", () => {
        if (!this.rendering) this.rememberZoom();
      });
    }

    addLights() {
      const scene = this.viewer.scene;
      this.sky = new THREE.HemisphereLight(0xffffff, 0x8890a0, 0.72);
      this.sky.position.set(0, 0, 1);
      this.sun = new THREE.DirectionalLight(0xffffff, 0.5);
      this.sun.position.set(-3, -7, 9);
      scene.add(this.sky, this.sun, this.sun.target);
    }

    restyle() {
      this.ground.uniforms.colour.value.set(GNE.colour("grid"));
      this.ground.uniforms.strength.value = GNE.theme() === "dark" ? 0.75 : 0.85;
      for (const bars of this.bars) bars.restyle();
      this.dimStatics();
      this.ghosts?.restyle();
      this.dirty();
    }

    dirty() {
      this.viewer.set_dirty();
    }

    // ---- meshcat's tree

    command(bytes) {
      this.viewer.handle_command_bytearray(bytes);
      this.stale = true; // objects may have come, gone or been replaced
    }

    node(path) {
      let node = this.viewer.scene_tree;
      for (const name of path.split("/").filter(Boolean)) {
        node = node?.children[name];
      }
      return node;
    }

    /** Forgets a scene, as another one comes. */
    clear() {
      for (const [path, node] of Object.entries(this.viewer.scene_tree.children)) {
        if (OWN.includes(path)) continue;
        node.object.traverse(dispose); // meshcat itself forgets what is inside groups
        this.viewer.delete_path([path]);
      }
      for (const bars of this.bars) bars.remove();
      this.ghosts?.remove();
      this.batches.clear();
      this.bars = [];
      this.ghosts = null;
      this.meta = null;
      this.stale = true;
    }

    setMeta(meta) {
      this.meta = meta;
      this.fleets = meta.systems.filter((system) => system.drawn_as === "fleet");
      for (const bars of this.bars) bars.remove();
      this.bars = meta.systems
        .filter((system) => system.drawn_as === "bars")
        .map((system) => new GNE.Bars(this, system));
      this.ghosts?.remove();
      this.ghosts = new GNE.Ghosts(this);
      this.floorKnown = false;
      this.spill = 0;
      this.placed = false;
      this.stale = true;
    }

    resolve() {
      const before = Date.now();
      if (!this.stale && (this.complete || before < this.nextLook)) return;
      this.objects = this.meta.items.map((path) => this.node(path)?.object);
      this.tinted = new Map(this.fleets.map((system) => [system.name, this.tintedOf(system)]));
      this.statics = this.staticMeshes();
      this.dimStatics();
      this.complete = !this.objects.includes(undefined);
      this.nextLook = before + 500;
      this.stale = false;
      this.ghosts.forget();
      this.batches.build(this.objects);
    }

    /** Meshes of what never moves: a model's floor, walls. */
    staticMeshes() {
      const moving = new Set(this.objects);
      const found = [];
      const collect = (object) => {
        if (moving.has(object)) return;
        if (object.isMesh && object.material.color) found.push(object);
        object.children.forEach(collect);
      };
      for (const [name, node] of Object.entries(this.viewer.scene_tree.children))
        if (!OWN.includes(name)) collect(node.object);
      return found;
    }

    /** A white floor would outshine a dark page and all that stands on it. */
    dimStatics() {
      const part = GNE.theme() === "dark" ? 0.3 : 1;
      for (const { material, userData } of this.statics || []) {
        userData.colour ??= material.color.clone();
        material.color.copy(userData.colour).multiplyScalar(part);
      }
    }

    /** Meshes of each agent that take its colour. */
    tintedOf(system) {
      return system.tints.map((paths) => {
        const meshes = [];
        for (const path of paths)
          this.node(path)?.object.traverse((object) => {
            if (object.material?.color) meshes.push(object);
          });
        return meshes;
      });
    }

    /** Place of an object in MuJoCo's coordinates: all its own transforms below meshcat's scene. */
    matrixOf(object) {
      const matrix = new THREE.Matrix4();
      for (let at = object; at && at !== this.viewer.scene; at = at.parent) {
        at.updateMatrix();
        matrix.premultiply(at.matrix);
      }
      return matrix;
    }

    position(item) {
      const node = this.node(item);
      return node ? this.matrixOf(node.object).elements.slice(12, 15) : null;
    }

    // ---- an instant

    apply(instant, store) {
      this.resolve();
      this.instant = instant;
      this.applyPoses(instant.poses);
      this.applyTints(instant);
      this.findFloor();
      this.box = this.boxOf();
      this.noteSpill();
      this.placeBars(instant, store);
      this.batches.update();
      this.ghosts.apply(instant);
      this.moveCamera();
      this.dirty();
    }

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

    applyTints(instant) {
      for (const system of this.fleets) {
        const shares = instant.systems[system.name].share;
        this.tinted.get(system.name).forEach((meshes, agent) => {
          const [r, g, b] = GNE.ramp(shares ? shares[agent] : NaN);
          for (const mesh of meshes) mesh.material.color.setRGB(r, g, b);
        });
      }
    }

    /** The lowest point of what is drawn, found once: robots of a lane may float around z = 0. */
    findFloor() {
      if (this.floorKnown || !this.complete || this.objects.length === 0) return;
      this.viewer.scene.updateMatrixWorld(true);
      const box = new THREE.Box3();
      for (const system of this.fleets)
        for (const anchor of system.anchors) box.expandByObject(this.objects[anchor]);
      if (Number.isFinite(box.min.y)) this.floor = Math.min(0, box.min.y);
      this.floorKnown = true;
    }

    /** Where an agent of a fleet is. */
    agentAt(system, agent) {
      const p = 8 * system.anchors[agent];
      return this.instant.poses.slice(p, p + 3);
    }

    /** Where links of an agent begin: above a robot, on top of a bar. */
    headOf(system, agent) {
      if (system.drawn_as === "bars")
        return this.bars.find((bars) => bars.system === system).topOfAgent(agent);
      const [x, y, z] = this.agentAt(system, agent);
      return [x, y, z + 0.8 * system.height];
    }

    boxOf() {
      const low = [Infinity, Infinity];
      const high = [-Infinity, -Infinity];
      for (const system of this.fleets)
        for (const anchor of system.anchors)
          for (const axis of [0, 1]) {
            const v = this.instant.poses[8 * anchor + axis];
            low[axis] = Math.min(low[axis], v);
            high[axis] = Math.max(high[axis], v);
          }
      return Number.isFinite(low[0]) ? { low, high } : null;
    }

    /** How far bodies have swung out of the box; forgotten slowly: the view must not breathe. */
    noteSpill() {
      if (!this.box) return;
      const { time } = this.instant;
      if (time > this.spillTime) this.spill *= Math.exp((this.spillTime - time) / 3);
      this.spillTime = time;
      const { low, high } = this.box;
      const { poses } = this.instant;
      for (let p = 0; p < poses.length; p += 8)
        for (const axis of [0, 1]) {
          const out = Math.max(poses[p + axis] - high[axis], low[axis] - poses[p + axis]);
          if (poses[p + 7] !== 0 && out > this.spill) this.spill = out;
        }
    }

    get planar() {
      return this.lane === null ? 1 : 0;
    }

    get lane() {
      if (!this.box) return null;
      const { low, high } = this.box;
      return high[1] - low[1] < 0.3 ? (low[1] + high[1]) / 2 : null;
    }

    placeBars(instant, store) {
      const box = this.box;
      let behind = box ? box.high[1] + 2.4 : 0;
      for (const bars of this.bars) {
        const span = box ? box.high[0] - box.low[0] : 0;
        const scale = box ? Math.min(Math.max((0.6 * span) / bars.width, 0.8), 6) : 1;
        const x = box ? (box.low[0] + box.high[0]) / 2 : 0;
        bars.update(instant, store, [x, behind, this.floor], scale);
        behind += scale * (bars.depth + 1);
      }
    }

    // ---- camera

    /** The points that should be in view. */
    points() {
      const points = [];
      for (const system of this.fleets)
        for (let agent = 0; agent < system.agents; agent++) {
          const [x, y, z] = this.agentAt(system, agent);
          points.push([x - 0.5, y, this.floor], [x + 0.5, y, z + system.height + 0.25]);
        }
      if (this.box) {
        const { low, high } = this.box;
        for (const x of [low[0] - this.spill, high[0] + this.spill])
          for (const y of [low[1] - this.spill * this.planar, high[1] + this.spill * this.planar])
            points.push([x, y, this.floor]);
      }
      for (const bars of this.bars) points.push(...bars.corners());
      return points.length ? points.map(GNE.toView) : [new THREE.Vector3()];
    }

    /** The middle of the agents, without what swings about them. */
    middle() {
      const box = new THREE.Box3();
      for (const system of this.fleets)
        for (let agent = 0; agent < system.agents; agent++) {
          const [x, y, z] = this.agentAt(system, agent);
          box.expandByPoint(GNE.toView([x, y, this.floor]));
          box.expandByPoint(GNE.toView([x, y, z + system.height]));
        }
      for (const bars of this.bars)
        for (const corner of bars.corners()) box.expandByPoint(GNE.toView(corner));
      return box.isEmpty() ? new THREE.Vector3() : box.getCenter(new THREE.Vector3());
    }

    followed() {
      const { kind, system, agent } = this.follow;
      if (kind === "agent") {
        const fleet = this.fleets.find((each) => each.name === system);
        if (fleet) return GNE.toView(this.agentAt(fleet, agent));
      }
      return this.middle();
    }

    /** Distance from the target at which all points are in view from a direction. */
    fitDistance(direction, target) {
      const view = new THREE.Matrix4().lookAt(
        direction,
        new THREE.Vector3(),
        new THREE.Vector3(0, 1, 0),
      );
      const [right, up, back] = [0, 1, 2].map((k) =>
        new THREE.Vector3().setFromMatrixColumn(view, k),
      );
      const tangent = Math.tan((this.camera.fov / 2) * DEGREE);
      const wide = tangent * (this.pane.clientWidth / Math.max(this.pane.clientHeight, 1));
      let distance = 2.5;
      for (const point of this.points()) {
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
      const size = this.box ? this.box.high.map((v, k) => v - this.box.low[k]) : [0, 0];
      const long = Math.min(Math.max((size[0] - 40) / 60, 0), 1);
      const azimuth = (this.box ? -84 + 75 * long : -84) * DEGREE;
      const rows = Math.max(0, ...this.bars.map((bars) => bars.rows));
      const ofBars = rows > 1 ? 32 : 12;
      const ofFleet = this.planar ? 36 : 20 - 13 * long;
      const elevation = (this.box ? ofFleet : ofBars) * DEGREE;
      const flat = Math.cos(elevation);
      return GNE.toView([Math.cos(azimuth) * flat, Math.sin(azimuth) * flat, Math.sin(elevation)]);
    }

    fit() {
      if (!this.instant) return;
      if (this.follow.kind !== "agent") this.follow = { kind: "fleet" };
      const target = this.followed();
      const direction = this.defaultDirection();
      const near = this.follow.kind === "agent" ? 6 : this.fitDistance(direction, target);
      this.look(target, direction, near);
      this.zoom = 1;
      this.followPoint = target;
      this.placed = true;
    }

    look(target, direction, distance) {
      this.controls.target.copy(target);
      this.camera.position.copy(target).addScaledVector(direction, distance);
      this.camera.lookAt(target);
      this.dirty();
    }

    arm() {
      const arm = this.camera.position.clone().sub(this.controls.target);
      const distance = arm.length();
      return { direction: arm.divideScalar(distance || 1), distance };
    }

    rememberZoom() {
      if (!this.instant) return;
      const { direction, distance } = this.arm();
      this.zoom = distance / this.fitDistance(direction, this.controls.target);
    }

    /** Camera and target go with what is followed; for a fleet the distance keeps it in view. */
    moveCamera() {
      if (!this.placed) return void this.fit();
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

    setFollow(follow) {
      this.following = follow.kind !== "none";
      if (this.following) {
        this.follow = follow;
        this.fit();
      }
    }

    /** Turns about the target (degrees) and zooms (factor), for the keyboard. */
    nudge(turn, factor) {
      const { direction, distance } = this.arm();
      direction.applyAxisAngle(new THREE.Vector3(0, 1, 0), turn * DEGREE);
      this.look(this.controls.target.clone(), direction, distance * factor);
      this.rememberZoom();
    }

    /** Fewer pixels while a slow machine plays (without a graphics card); all of them at rest. */
    setQuality(quality) {
      if (quality === this.quality) return;
      this.quality = quality;
      this.viewer.renderer.setPixelRatio(quality * Math.min(devicePixelRatio, 2));
      this.viewer.set_3d_pane_size();
    }

    render() {
      const { x, y, z } = this.controls.target;
      this.ground.place([x, -z, y], this.arm().distance, this.floor, this.lane);
      this.rendering = true;
      this.viewer.render();
      this.rendering = false;
    }

    get needsRender() {
      return this.viewer.needs_render;
    }

    /** Where a point is in the pane, in CSS pixels; null behind the camera. */
    project(point) {
      const p = GNE.toView(point).project(this.camera);
      if (p.z > 1 || p.z < -1) return null;
      return {
        x: ((p.x + 1) / 2) * this.pane.clientWidth,
        y: ((1 - p.y) / 2) * this.pane.clientHeight,
        depth: p.z,
      };
    }
  };
})();
