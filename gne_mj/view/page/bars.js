"use strict";
// Agents without a body: a bar for each action, a taller gauge for each bounded single quantity.
(() => {
  const THREE = MeshCat.THREE;
  const PITCH = 0.62; // m between bars, at scale 1
  const WIDTH = 0.4;
  const TALL = 1.9; // m, of the greatest action and of a bound
  const BOX = new THREE.BoxGeometry(1, 1, 1).translate(0, 0, 0.5);
  const EDGES = new THREE.EdgesGeometry(BOX);

  const mesh = (colour, opacity = 1) =>
    new THREE.Mesh(
      BOX,
      new THREE.MeshPhongMaterial({
        color: colour,
        transparent: opacity < 1,
        opacity,
        shininess: 12,
      }),
    );

  const setHeight = (object, height) => {
    object.scale.z = Math.abs(height) < 1e-4 ? 1e-4 : height;
  };

  GNE.Bars = class {
    constructor(scene, system) {
      this.scene = scene;
      this.system = system;
      this.group = new THREE.Group();
      scene.viewer.scene.add(this.group);
      const m = system.action.owner.length;
      this.perRow = m <= 24 ? m : Math.ceil(Math.sqrt(4 * m));
      this.rows = Math.ceil(m / this.perRow);
      this.bars = system.action.owner.map((_, k) => this.addBar(k));
      this.gauges = this.boundedNumbers().map((quantity, k) => this.addGauge(quantity, k));
      this.width = PITCH * this.perRow + 1.7 * this.gauges.length;
      this.depth = PITCH * this.rows;
      this.addSlab();
      this.restyle();
    }

    boundedNumbers() {
      return this.system.quantities.filter(
        (quantity) => quantity.labels.length === 1 && Number.isFinite(quantity.bound?.[0]),
      );
    }

    /** Where the k-th bar stands, from the middle of the group. */
    spot(k) {
      const row = Math.floor(k / this.perRow);
      const all = PITCH * this.perRow + 1.7 * this.boundedNumbers().length;
      return [PITCH * ((k % this.perRow) + 0.5) - all / 2, PITCH * row];
    }

    addBar(k) {
      const bar = mesh(0x888888);
      const [x, y] = this.spot(k);
      bar.position.set(x, y, 0);
      bar.scale.set(WIDTH, WIDTH, 1);
      this.group.add(bar);
      return bar;
    }

    addGauge(quantity, k) {
      const all = PITCH * this.perRow + 1.7 * this.boundedNumbers().length;
      const x = PITCH * this.perRow + 1.7 * (k + 0.5) + 0.1 - all / 2;
      const place = (object, width, z) => {
        object.position.set(x, 0, z);
        object.scale.set(width, width, 1);
        this.group.add(object);
        return object;
      };
      const bar = place(mesh(0x888888), 0.7, 0);
      const frame = place(new THREE.LineSegments(EDGES, new THREE.LineBasicMaterial()), 0.72, 0);
      setHeight(frame, TALL);
      const plate = place(mesh(0xffffff, 0.55), 1.15, TALL);
      setHeight(plate, 0.03);
      const rim = place(new THREE.LineSegments(EDGES, new THREE.LineBasicMaterial()), 1.15, TALL);
      setHeight(rim, 0.03);
      return { quantity, bar, frame, plate, rim, x, value: NaN };
    }

    addSlab() {
      this.slab = mesh(0x888888, 0.5);
      this.slab.scale.set(this.width + 0.3, this.depth + 0.5, 0.03);
      this.slab.position.set(0, (this.depth - PITCH) / 2, -0.032);
      this.group.add(this.slab);
    }

    restyle() {
      this.slab.material.color.set(GNE.colour("slab"));
      for (const { frame, plate, rim } of this.gauges) {
        frame.material.color.set(GNE.colour("muted"));
        plate.material.color.set(GNE.colour("limit"));
        rim.material.color.set(GNE.colour("limit"));
      }
    }

    remove() {
      this.group.parent?.remove(this.group);
    }

    update(instant, store, [x, y, z], scale) {
      const own = instant.systems[this.system.name];
      this.reference = store.greatest(`${this.system.name}/action`) || 1;
      this.origin = [x, y, z];
      this.scale = scale;
      this.group.position.set(x, y, z + 0.035);
      this.group.scale.setScalar(scale);
      this.values = own.action || [];
      this.bars.forEach((bar, k) => {
        const agent = this.system.action.owner[k] - 1;
        bar.material.color.setRGB(...GNE.ramp(own.share ? own.share[agent] : NaN));
        setHeight(bar, this.heightOf(this.values[k]));
      });
      for (const gauge of this.gauges) this.updateGauge(gauge, own);
    }

    updateGauge(gauge, own) {
      const bound = gauge.quantity.bound[0];
      gauge.value = own[`quantity/${gauge.quantity.name}`]?.[0] ?? NaN;
      gauge.share = gauge.value / bound;
      setHeight(gauge.bar, TALL * (Number.isFinite(gauge.share) ? gauge.share : 0));
      gauge.bar.material.color.setRGB(...GNE.ramp(gauge.share));
    }

    heightOf(value) {
      return Number.isFinite(value) ? (TALL * value) / this.reference : 0;
    }

    /** A point of the group, in MuJoCo's coordinates. */
    point(x, y, z) {
      const [ox, oy, oz] = this.origin;
      return [ox + this.scale * x, oy + this.scale * y, oz + 0.035 + this.scale * z];
    }

    top(k) {
      const [x, y] = this.spot(k);
      return this.point(x, y, Math.max(0, this.heightOf(this.values[k])));
    }

    topOfAgent(agent) {
      return this.top(this.system.action.owner.indexOf(agent + 1));
    }

    foot(k) {
      const [x, y] = this.spot(k);
      return this.point(x, y - WIDTH / 2, 0);
    }

    corners() {
      const [w, d] = [this.width / 2 + 0.3, this.depth];
      return [
        [-w, -0.4, -0.35],
        [w, -0.4, -0.35],
        [-w, d, TALL + 0.5],
        [w, d, TALL + 0.5],
        [w, -0.4, TALL + 0.5],
      ].map((corner) => this.point(...corner));
    }

    /** Texts of the gauges: value on top, what it is below, the limit beside its plate. */
    title() {
      const { name, action } = this.system;
      const [x, y] = this.spot(0);
      const unit = action.unit ? ` / ${action.unit}` : "";
      const point = this.point(x - WIDTH / 2, y, TALL);
      return {
        point,
        text: `${name}: ${action.name}${unit}`,
        shift: -34,
        align: "left",
        title: true,
      };
    }

    gaugeTexts() {
      return this.gauges.flatMap(({ quantity, x, value, share }) => [
        {
          point: this.point(x, 0, Math.max(TALL * (share || 0), TALL) + 0.1),
          text: GNE.withUnit(value, quantity.unit),
          bold: true,
          bad: share > 1,
          shift: -14,
        },
        {
          point: this.point(x + 0.6, 0, TALL),
          text: `limit ${GNE.withUnit(quantity.bound[0], quantity.unit)}`,
          limit: true,
          align: "left",
        },
        { point: this.point(x, -0.45, -0.05), text: quantity.long_name, shift: 12 },
      ]);
    }
  };
})();
