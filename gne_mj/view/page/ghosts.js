"use strict";
// What one agent takes the others to be: a translucent copy of each robot, ahead of it by what is
// thought too fast times one second; for bars, outlines at the height thought.
(() => {
  const THREE = MeshCat.THREE;
  const EDGES = new THREE.EdgesGeometry(new THREE.BoxGeometry(1, 1, 1).translate(0, 0, 0.5));
  const SECOND = 1;
  const DIRECTIONS = { "": 0, x: 0, y: 1, z: 2 };

  GNE.Ghosts = class {
    constructor(scene) {
      this.scene = scene;
      this.group = new THREE.Group();
      scene.viewer.scene.add(this.group);
      this.shown = null; // {system, agent}
      this.copies = new Map();
    }

    restyle() {
      this.forget();
    }

    remove() {
      this.group.parent?.remove(this.group);
    }

    /** Makes the copies anew when they are next needed. */
    forget() {
      for (const mesh of [...this.group.children]) this.group.remove(mesh);
      this.copies.clear();
    }

    show(shown) {
      this.forget();
      this.shown = shown;
      if (this.scene.instant) this.apply(this.scene.instant);
      this.scene.dirty();
    }

    apply(instant) {
      this.group.visible = Boolean(this.shown);
      if (!this.shown) return;
      const system = this.scene.meta.systems.find((each) => each.name === this.shown.system);
      const { estimate, action } = instant.systems[system.name];
      if (!estimate || !action) return void (this.group.visible = false);
      const row = estimate.subarray(
        this.shown.agent * action.length,
        (this.shown.agent + 1) * action.length,
      );
      if (system.drawn_as === "bars") this.outlines(system, row);
      else this.shadows(system, row, action);
    }

    outlines(system, row) {
      const bars = this.scene.bars.find((each) => each.system === system);
      system.action.owner.forEach((owner, k) => {
        if (owner === this.shown.agent + 1) return;
        if (!this.copies.has(k)) this.copies.set(k, [this.outline()]);
        const [outline] = this.copies.get(k);
        const [x, y] = bars.spot(k);
        outline.position.set(...bars.point(x, y, 0));
        const height = bars.scale * bars.heightOf(row[k]);
        outline.scale.set(0.5 * bars.scale, 0.5 * bars.scale, height || 1e-4);
      });
    }

    outline() {
      const material = new THREE.LineBasicMaterial({ color: GNE.colour("ghost") });
      const lines = new THREE.LineSegments(EDGES, material);
      this.group.add(lines);
      return lines;
    }

    shadows(system, row, action) {
      for (let agent = 0; agent < system.agents; agent++) {
        if (agent === this.shown.agent) continue;
        const ahead = this.ahead(system, agent, row, action);
        const sources = this.scene.tinted.get(system.name)[agent];
        if (!this.copies.has(agent))
          this.copies.set(
            agent,
            sources.map((mesh) => this.copy(mesh)),
          );
        this.copies.get(agent).forEach((copy, k) => {
          copy.matrix.copy(this.scene.matrixOf(sources[k]));
          ahead.forEach((v, axis) => (copy.matrix.elements[12 + axis] += v));
          // where nothing is mistaken the copy would only flicker in the robot's surface
          copy.visible = Math.hypot(...ahead) > 0.01;
        });
      }
    }

    ahead(system, agent, row, action) {
      const ahead = [0, 0, 0];
      system.action.owner.forEach((owner, k) => {
        const wrong = (row[k] - action[k]) * SECOND;
        if (owner === agent + 1 && Number.isFinite(wrong))
          ahead[DIRECTIONS[system.action.axis[k]] ?? 0] += wrong;
      });
      return ahead;
    }

    copy(mesh) {
      const material = new THREE.MeshPhongMaterial({
        color: GNE.colour("ghost"),
        transparent: true,
        opacity: 0.5,
        depthWrite: false,
      });
      material.emissive.set(GNE.colour("ghost")).multiplyScalar(0.35);
      const copy = new THREE.Mesh(mesh.geometry, material);
      copy.matrixAutoUpdate = false;
      this.group.add(copy);
      return copy;
    }
  };
})();
