// What hands do in the 3-D view besides turning it: choose a robot, push it, lose a link.
import { Chosen } from "./chosen.js";
import { Pushing } from "./push.js";
import { Switching } from "./switching.js";
/** @import { Page } from "./page.js" */
/** @import { Instant, Scene, Source } from "./types.d.ts" */

export class HandsOn {
  /** @param {Page} page */
  constructor(page) {
    const { overlay } = page;
    this.page = page;
    this.pushing = new Pushing(page);
    this.switching = new Switching(page);
    this.chosen = new Chosen(page);
    overlay.hands = this.pushing;
    overlay.links.isLost = (system, pair) => this.switching.isLost(system, pair);
  }

  /** The simulation that hands act on; none while a replay is shown. */
  get running() {
    return this.page.playback ? null : this.page.live;
  }

  /** @param {Scene} meta */
  setMeta(meta) {
    this.pushing.setMeta(meta);
    this.chosen.setMeta(meta);
  }

  /** Another source of the same scene: what can be done is another thing. */
  renew() {
    this.chosen.choose(this.chosen.which);
  }

  /**
   * Before a picture.
   * @param {Source} source
   * @param {Instant} instant
   */
  follow({ interventions }, { time }) {
    this.switching.follow(interventions, time);
  }
}
