// Pushes of the running simulation: a robot is dragged, and an arrow shows the force.
import { byId } from "./dom.js";
import { notify } from "./notices.js";
import { colour } from "./theme.js";
import { number, withUnit } from "./words.js";
/** @import { Box } from "./overlay.js" */
/** @import { Page } from "./page.js" */
/** @import { Agent, Point, Push, Scene, System, Way } from "./types.d.ts" */

/** @typedef {{x: number, y: number}} Place in the pane, px */

const STILL = 6; // px, up to which a hand is where it was
const FULL = 50; // px, a drag of which is the force that is set
const TIP = 12; // px around an arrow's tip that are its own
const HIGH = 18; // px of the text of a force
const ROWS = [0, -1, 1, -2, 2, -3, 3, -4, 4, -5, 5, -6, 6]; // above and below an arrow's tip

/** @param {Place} a */
const sizeOf = ({ x, y }) => Math.hypot(x, y);

/**
 * @param {Place} from
 * @param {Place} to
 * @returns {Place}
 */
const between = (from, to) => ({ x: to.x - from.x, y: to.y - from.y });

export class Pushing {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** @type {Map<string, Push>} */
    this.pushes = new Map(); // by system, with the force and duration that are set
    /** @type {{which: Agent, system: System, from: Place, to: Place, up: boolean} | null} */
    this.drag = null;
    /** @type {Place | null} */
    this.pressed = null; // where a hand went down on nobody
    /** @type {{text: string, tip: Place, side: number, box: Box | null} | null} */
    this.shown = null; // what an arrow says, and where
    const pane = byId("pane");
    pane.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    pane.addEventListener("pointermove", (event) => this.move(event), { capture: true });
    pane.addEventListener("pointerup", (event) => this.release(event), { capture: true });
    pane.addEventListener("pointercancel", () => this.abandon(), { capture: true });
    addEventListener("keydown", ({ key }) => key === "Escape" && this.abandon());
  }

  /** @param {Scene} meta */
  setMeta({ pushes = [] }) {
    this.pushes = new Map(pushes.map((push) => [push.system, { ...push }]));
    this.drag = null;
  }

  // ---- hands

  /**
   * @param {PointerEvent} event
   * @returns {Place}
   */
  place({ clientX, clientY }) {
    const box = byId("pane").getBoundingClientRect();
    return { x: clientX - box.left, y: clientY - box.top };
  }

  /** @param {PointerEvent} event */
  press(event) {
    this.pressed = null;
    if (!event.isPrimary || event.button !== 0) return this.abandon();
    const from = this.place(event);
    const which = this.page.overlay.agentAt(from.x, from.y);
    const system = this.page.meta?.systems.find(({ name }) => name === which?.system);
    if (!which || !system) return void (this.pressed = from);
    this.drag = { which, system, from, to: from, up: false };
    if (!this.page.hands.running) return; // the camera is turned, or it is chosen
    event.stopImmediatePropagation(); // else the camera would turn
    byId("pane").setPointerCapture(event.pointerId);
    byId("pane").focus({ preventScroll: true });
  }

  /** @param {PointerEvent} event */
  move(event) {
    const { drag, pushing } = this;
    if (!drag) return;
    drag.to = this.place(event);
    drag.up = event.shiftKey;
    if (!pushing) return;
    event.stopImmediatePropagation();
    this.page.scene.dirty();
  }

  /** @param {PointerEvent} event */
  release(event) {
    const { drag, pressed } = this;
    const at = this.place(event);
    const from = drag?.from ?? pressed;
    const still = from !== null && sizeOf(between(from, at)) <= STILL;
    this.abandon();
    if (still && drag) return this.page.hands.chosen.choose(drag.which);
    if (still && from) return this.page.hands.switching.click(from.x, from.y, event.pointerType);
    if (!drag || !this.page.hands.running) return;
    event.stopImmediatePropagation();
    drag.to = at;
    const forces = this.forces(drag);
    if (forces) this.send(drag.which, forces);
    else notify(this.refusal(drag.system), "info", `push ${drag.system.name}`);
  }

  abandon() {
    if (this.drag) this.page.scene.dirty();
    this.drag = null;
    this.pressed = null;
  }

  /** Whether a robot is dragged that can be pushed. */
  get pushing() {
    return this.drag !== null && this.page.hands.running !== null;
  }

  // ---- forces

  /**
   * @param {System} system
   * @param {number} agent
   * @returns {(Way | null)[]}
   */
  waysOf({ name }, agent) {
    return this.pushes.get(name)?.ways[agent] ?? [];
  }

  /** @param {System} system */
  refusal({ name, agent_name: noun }) {
    return this.pushes.has(name)
      ? `${name}: this ${noun} cannot be pushed, since a sensor alone tells its output.`
      : `${name}: only robots that MuJoCo moves can be pushed.`;
  }

  /**
   * The unit that an agent is pushed in.
   * @param {System} system
   * @param {number} agent
   */
  unitOf(system, agent) {
    return this.waysOf(system, agent).find((way) => way)?.unit ?? "N";
  }

  /**
   * Along which way on the screen an axis goes now, px a m; to the right where it turns.
   * @param {System} system
   * @param {number} agent
   * @param {Way} way
   * @returns {Place}
   */
  onScreen(system, agent, { along, item }) {
    const { camera, layout } = this.page.scene;
    const here = /** @type {Point} */ (Array.from(layout.agentAt(system, agent)));
    const way = along && item !== null ? layout.turned(item, along) : along;
    const a = camera.project(here);
    const b = way && camera.project(here.map((v, k) => v + 0.1 * way[k]));
    if (!a || !b) return { x: 1, y: 0 };
    return { x: (b.x - a.x) / 0.1, y: (b.y - a.y) / 0.1 };
  }

  /**
   * The force along each axis that a drag asks for, or null where none can act: along the only
   * axis; in the plane of the first two; with shift along the third.
   * @param {NonNullable<Pushing["drag"]>} drag
   */
  forces({ which, system, from, to, up }) {
    const push = this.pushes.get(system.name);
    const ways = this.waysOf(system, which.agent);
    const there = [...ways.keys()].filter((k) => ways[k]);
    if (!push || !there.length) return null;
    const by = between(from, to);
    const force = push.force / FULL;
    const forces = ways.map(() => 0);
    const screen = (/** @type {number} */ k) =>
      this.onScreen(system, which.agent, /** @type {Way} */ (ways[k]));
    const [k, l] = up && there.length > 2 ? [there[2]] : there;
    const p = screen(k);
    const q = l === undefined ? null : screen(l);
    const area = q ? p.x * q.y - p.y * q.x : 0;
    if (!q || Math.abs(area) < 1e-3 * sizeOf(p) * sizeOf(q)) {
      const part = (by.x * p.x + by.y * p.y) / (sizeOf(p) || 1);
      forces[k] = Number((force * part).toPrecision(3));
      return forces;
    }
    const a = (by.x * q.y - by.y * q.x) / area;
    const b = (p.x * by.y - p.y * by.x) / area;
    const scale = (force * sizeOf(by)) / (Math.hypot(a, b) || 1);
    forces[k] = Number((scale * a).toPrecision(3));
    forces[l] = Number((scale * b).toPrecision(3));
    return forces;
  }

  /**
   * @param {Agent} which
   * @param {number[]} forces along its axes
   */
  send({ system, agent }, forces) {
    const { duration } = /** @type {Push} */ (this.pushes.get(system));
    this.page.live?.send({ do: "push", system, agent: agent + 1, forces, duration });
  }

  // ---- the arrow

  /**
   * The arrow, under labels, which make way for its tip.
   * @param {CanvasRenderingContext2D} context of the overlay
   */
  drawUnder(context) {
    const { drag } = this;
    this.shown = null;
    if (!drag || !this.pushing) return;
    const forces = this.forces(drag);
    if (!forces || sizeOf(between(drag.from, drag.to)) <= STILL) return;
    const { which, system } = drag;
    const force = Math.hypot(...forces);
    const { duration } = /** @type {Push} */ (this.pushes.get(system.name));
    const from = this.page.scene.camera.project(this.page.scene.layout.headOf(system, which.agent));
    if (!from || !force) return;
    const tip = this.tip(drag, from, forces);
    arrow(context, from, tip);
    this.page.overlay.taken.push({ x: tip.x - TIP, y: tip.y - TIP, w: 2 * TIP, h: 2 * TIP });
    const unit = this.unitOf(system, which.agent);
    const text = `${withUnit(force, unit)} for ${number(duration)} s`;
    this.shown = { text, tip, side: tip.x >= from.x ? 1 : -1, box: null };
  }

  /**
   * Its text, beside them.
   * @param {CanvasRenderingContext2D} context of the overlay
   */
  draw(context) {
    const { shown } = this;
    if (!shown) return;
    const { overlay } = this.page;
    context.font = "600 13px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillStyle = colour("accent");
    shown.box = this.room(context.measureText(shown.text).width + 4, shown.tip, shown.side);
    overlay.taken.push(shown.box);
    overlay.haloed(shown.text, shown.box.x + 2, shown.box.y + shown.box.h / 2);
  }

  /**
   * Room for the text at an arrow's tip: within the pane, off all labels if there is any such place.
   * @param {number} w of the text, px
   * @param {Place} tip
   * @param {number} side that is tried first: 1 to the right of it, -1 to the left
   * @returns {Box}
   */
  room(w, tip, side) {
    const { overlay } = this.page;
    const { clientWidth: wide, clientHeight: high } = overlay.canvas;
    const within = (/** @type {number} */ v, /** @type {number} */ most) =>
      Math.max(Math.min(v, most - 2), 2);
    const places = ROWS.flatMap((row) => (row ? [side, -side, 0] : [side, -side]).map((at) => ({
      x: within(tip.x - w / 2 + at * (TIP + 2 + w / 2), wide - w),
      y: within(tip.y - HIGH / 2 + row * (HIGH + 6), high - HIGH),
      w,
      h: HIGH,
    }))); // prettier-ignore
    return places.find((box) => overlay.free(box)) ?? places[0];
  }

  /**
   * Where the arrow ends: along what acts, as far as was dragged.
   * @param {NonNullable<Pushing["drag"]>} drag
   * @param {Place} from
   * @param {number[]} forces
   */
  tip({ which, system, from: begun, to }, from, forces) {
    const along = { x: 0, y: 0 };
    this.waysOf(system, which.agent).forEach((way, k) => {
      if (!way || !forces[k]) return;
      const { x, y } = this.onScreen(system, which.agent, way);
      along.x += forces[k] * x;
      along.y += forces[k] * y;
    });
    const far = sizeOf(between(begun, to)) / (sizeOf(along) || 1);
    return { x: from.x + far * along.x, y: from.y + far * along.y };
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Place} from
 * @param {Place} to
 */
const arrow = (context, from, to) => {
  const angle = Math.atan2(to.y - from.y, to.x - from.x);
  context.strokeStyle = context.fillStyle = colour("accent");
  context.lineWidth = 3;
  context.lineCap = "round";
  context.beginPath();
  context.moveTo(from.x, from.y);
  context.lineTo(to.x, to.y);
  context.stroke();
  context.beginPath();
  context.moveTo(to.x + 4 * Math.cos(angle), to.y + 4 * Math.sin(angle));
  for (const side of [2.6, -2.6])
    context.lineTo(to.x + 13 * Math.cos(angle + side), to.y + 13 * Math.sin(angle + side));
  context.fill();
};
