// Links of the communication graph that are lost by a click on them, and there again by another one.
import { notify } from "./notices.js";
/** @import { Page } from "./page.js" */
/** @import { Intervention, System } from "./types.d.ts" */

const NEAR = 8; // px of a click from a link
const NEAR_FINGER = 16;

/**
 * A name of the link between two agents, from 1.
 * @param {string} system
 * @param {[number, number]} pair
 */
const nameOf = (system, [a, b]) => `${system} ${Math.min(a, b)}-${Math.max(a, b)}`;

export class Switching {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** @type {Intervention[]} */
    this.done = [];
    this.count = -1;
    this.time = NaN;
    /** @type {Set<string>} */
    this.lost = new Set();
  }

  /**
   * Whether the link between two agents, from 1, is lost at the time that is shown.
   * @param {System} system
   * @param {[number, number]} pair
   */
  isLost({ name }, pair) {
    return this.lost.size > 0 && this.lost.has(nameOf(name, pair));
  }

  /**
   * What was done up to a time in s.
   * @param {Intervention[]} done
   * @param {number} time
   */
  follow(done, time) {
    if (done === this.done && done.length === this.count && time === this.time) return;
    this.done = done;
    this.count = done.length;
    this.time = time;
    this.lost = new Set();
    for (const { system = "", link, lost, time: when } of done) {
      if (!link || when > time + 1e-9) continue;
      if (lost) this.lost.add(nameOf(system, link));
      else this.lost.delete(nameOf(system, link));
    }
  }

  /**
   * A click in the pane on nobody, px.
   * @param {number} x
   * @param {number} y
   * @param {string} by mouse, pen or touch
   */
  click(x, y, by) {
    const { hands, overlay, meta } = this.page;
    if (!hands.running || !overlay.links.shown || !meta) return;
    const near = by === "touch" ? NEAR_FINGER : NEAR;
    const found = overlay.links.nearest(meta.systems, x, y, near);
    if (found) this.toggle(found.system, found.edge);
  }

  /**
   * @param {System} system
   * @param {[number, number]} agents from 1
   */
  toggle(system, agents) {
    const { running } = this.page.hands;
    if (!running) return;
    if (system.edges_are !== "messages") {
      const text = `${system.name}: dashed lines are measurements, so that there is no link to lose.`;
      return notify(text, "info", `link ${system.name}`);
    }
    const lost = !this.isLost(system, agents);
    running.send({ do: "link", system: system.name, agents, lost });
  }
}
