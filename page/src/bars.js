// Agents without a body: a bar for each action, a taller gauge for each bounded single quantity.
import { ramp } from "./colours.js";
import { THREE } from "./meshcat.js";
import { colour } from "./theme.js";
import { withUnit } from "./words.js";
/** @import { Instant, Numbers, Point, Quantity, Store, System, Text, Three } from "./types.d.ts" */

const PITCH = 0.62; // m between bars, at scale 1
const WIDTH = 0.4;
const FAINT = 0.35; // opacity over another run's
const WIDER = 1.25; // than those of the other run
const GAUGE = 1.7; // between gauges
const TALL = 1.9; // m, of the greatest action and of a bound
const BOX = new THREE.BoxGeometry(1, 1, 1).translate(0, 0, 0.5);
const EDGES = new THREE.EdgesGeometry(BOX);

/** @param {number} color */
const mesh = (color, opacity = 1) =>
  new THREE.Mesh(
    BOX,
    new THREE.MeshPhongMaterial({
      color,
      transparent: opacity < 1,
      opacity,
      shininess: 12,
    }),
  );

/**
 * @param {Three} object
 * @param {number} height
 */
const setHeight = (object, height) => {
  object.scale.z = Math.abs(height) < 1e-4 ? 1e-4 : height;
};

export class Bars {
  /**
   * @param {Three} parent
   * @param {System} system
   */
  constructor(parent, system) {
    this.system = system;
    this.group = new THREE.Group();
    parent.add(this.group);
    const m = system.action.owner.length;
    this.perRow = m <= 24 ? m : Math.ceil(Math.sqrt(4 * m));
    this.rows = Math.ceil(m / this.perRow);
    const bounded = this.boundedNumbers();
    this.width = PITCH * this.perRow + GAUGE * bounded.length;
    this.depth = PITCH * this.rows;
    this.bars = system.action.owner.map((_, k) => this.addBar(k));
    this.gauges = bounded.map((quantity, k) => this.addGauge(quantity, k));
    /** @type {Point} */
    this.origin = [0, 0, 0];
    this.scale = 1;
    this.reference = 1; // the action that is as tall as a bound
    /** @type {ArrayLike<number>} */
    this.values = [];
    this.addSlab();
    this.restyle();
  }

  boundedNumbers() {
    return this.system.quantities.filter(
      ({ bound, labels, moving_bounds: moving }) =>
        labels.length === 1 && (typeof bound?.[0] === "number" || moving.bound !== undefined),
    );
  }

  /**
   * Where the k-th bar stands, from the middle of the group.
   * @param {number} k
   */
  spot(k) {
    const row = Math.floor(k / this.perRow);
    return [PITCH * ((k % this.perRow) + 0.5) - this.width / 2, PITCH * row];
  }

  /** @param {number} k */
  addBar(k) {
    const bar = mesh(0x888888);
    const [x, y] = this.spot(k);
    bar.position.set(x, y, 0);
    bar.scale.set(WIDTH, WIDTH, 1);
    this.group.add(bar);
    return bar;
  }

  /**
   * @param {Quantity} quantity
   * @param {number} k
   */
  addGauge(quantity, k) {
    const x = PITCH * this.perRow + GAUGE * (k + 0.5) + 0.1 - this.width / 2;
    const place = (/** @type {Three} */ object, /** @type {number} */ width, z = 0) => {
      object.position.set(x, 0, z);
      object.scale.set(width, width, 1);
      this.group.add(object);
      return object;
    };
    const bar = place(mesh(0x888888), 0.7);
    const frame = place(new THREE.LineSegments(EDGES, new THREE.LineBasicMaterial()), 0.72);
    setHeight(frame, TALL);
    const plate = place(mesh(0xffffff, 0.55), 1.15, TALL);
    setHeight(plate, 0.03);
    const rim = place(new THREE.LineSegments(EDGES, new THREE.LineBasicMaterial()), 1.15, TALL);
    setHeight(rim, 0.03);
    const limit = quantity.bound?.[0] ?? NaN;
    return { quantity, limit, bar, frame, plate, rim, x, value: NaN, share: NaN };
  }

  addSlab() {
    this.slab = mesh(0x888888, 0.5);
    this.slab.scale.set(this.width + 0.3, this.depth + 0.5, 0.03);
    this.slab.position.set(0, (this.depth - PITCH) / 2, -0.032);
    this.group.add(this.slab);
  }

  /**
   * Bars over those of another run are translucent and a little wider, so that no faces coincide.
   * @param {boolean} faint
   */
  fade(faint) {
    this.slab.visible = !faint;
    for (const bar of [...this.bars, ...this.gauges.map((gauge) => gauge.bar)]) {
      const width = (bar.userData.width ??= bar.scale.x) * (faint ? WIDER : 1);
      bar.scale.x = bar.scale.y = width;
      Object.assign(bar.material, {
        transparent: faint,
        opacity: faint ? FAINT : 1,
        depthWrite: !faint,
      });
    }
  }

  restyle() {
    this.slab.material.color.set(colour("slab"));
    for (const { frame, plate, rim } of this.gauges) {
      frame.material.color.set(colour("muted"));
      plate.material.color.set(colour("limit"));
      rim.material.color.set(colour("limit"));
    }
  }

  remove() {
    this.group.parent?.remove(this.group);
  }

  /**
   * @param {Instant} instant
   * @param {Store} store
   * @param {Point} origin
   * @param {number} scale
   */
  update(instant, store, [x, y, z], scale) {
    const own = instant.systems[this.system.name];
    const { alike, faint, off } = this.system.shown;
    this.reference = Math.max(...alike.map((name) => store.greatest(`${name}/action`))) || 1;
    this.fade(faint);
    this.group.visible = !off;
    this.origin = [x, y, z];
    this.scale = scale;
    this.group.position.set(x, y, z + 0.035);
    this.group.scale.setScalar(scale);
    this.values = own.action || [];
    this.bars.forEach((bar, k) => {
      const agent = this.system.action.owner[k] - 1;
      bar.material.color.setRGB(...ramp(own.share?.[agent] ?? NaN));
      setHeight(bar, this.heightOf(this.values[k]));
    });
    for (const gauge of this.gauges) this.updateGauge(gauge, own);
  }

  /**
   * @param {ReturnType<Bars["addGauge"]>} gauge
   * @param {Record<string, Numbers | undefined>} own arrays of the system
   */
  updateGauge(gauge, own) {
    const { bound } = gauge.quantity.moving_bounds;
    if (bound) gauge.limit = own[`quantity/${bound}`]?.[0] ?? NaN;
    gauge.value = own[`quantity/${gauge.quantity.name}`]?.[0] ?? NaN;
    gauge.share = gauge.value / gauge.limit;
    setHeight(gauge.bar, TALL * (Number.isFinite(gauge.share) ? gauge.share : 0));
    gauge.bar.material.color.setRGB(...ramp(gauge.share));
  }

  /** @param {number} value */
  heightOf(value) {
    return Number.isFinite(value) ? (TALL * value) / this.reference : 0;
  }

  /**
   * A point of the group, in MuJoCo's coordinates.
   * @returns {Point}
   * @param {number} x
   * @param {number} y
   * @param {number} z
   */
  point(x, y, z) {
    const [ox, oy, oz] = this.origin;
    return [ox + this.scale * x, oy + this.scale * y, oz + 0.035 + this.scale * z];
  }

  /** @param {number} k */
  top(k) {
    const [x, y] = this.spot(k);
    return this.point(x, y, Math.max(0, this.heightOf(this.values[k])));
  }

  /** @param {number} agent */
  topOfAgent(agent) {
    return this.top(this.system.action.owner.indexOf(agent + 1));
  }

  /** @param {number} k */
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
    ].map(([x, y, z]) => this.point(x, y, z));
  }

  /**
   * What the bars are.
   * @returns {Text}
   */
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

  /**
   * Value on top, what it is below, the limit beside its plate.
   * @returns {Text[]}
   */
  gaugeTexts() {
    return this.gauges.flatMap(({ quantity, limit, x, value, share }) => [
      {
        point: this.point(x, 0, Math.max(TALL * (share || 0), TALL) + 0.1),
        text: withUnit(value, quantity.unit),
        bold: true,
        bad: share > 1,
        shift: -14,
      },
      {
        point: this.point(x + 0.6, 0, TALL),
        text: `limit ${withUnit(limit, quantity.unit)}`,
        limit: true,
        align: "left",
      },
      { point: this.point(x, -0.45, -0.05), text: quantity.long_name, shift: 12 },
    ]);
  }
}
