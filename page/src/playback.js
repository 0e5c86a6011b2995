// A replay as what is shown: time is the page's own.
import { Replay } from "./replay.js";
/** @import { Instant, Numbers, Pack, Source, State, System } from "./types.d.ts" */

/** @implements {Source} */
export class Playback {
  /**
   * @param {Pack} pack
   * @param {object} options
   * @param {string} [options.pace] what is said beside the clock
   * @param {number} [options.speed]
   * @param {(system: System, counts: Numbers | undefined) => void} options.messages called with
   *     what passed while time went on
   */
  constructor(pack, { messages, pace = "", speed = 1 }) {
    this.store = this.replay = new Replay(pack);
    const { outcome = {}, interventions = [] } = this.replay.meta;
    this.outcome = outcome;
    this.interventions = interventions;
    /** @type {Record<string, number>} */
    this.exits = {};
    for (const [name, { exit_time: time }] of Object.entries(outcome))
      if (typeof time === "number") this.exits[name] = time;
    this.messages = messages;
    this.pace = pace;
    /** @type {number | null} */
    this.speed = speed;
    this.seekable = true;
    this.playing = false;
    this.grown = false;
    this.start = this.replay.time[0];
    this.end = this.replay.end;
    this.time = this.start;
    /** @type {Instant | null} */
    this.pending = null;
  }

  get meta() {
    return this.replay.meta;
  }

  take() {
    const instant = this.pending;
    this.pending = null;
    return instant;
  }

  playPause() {
    if (!this.playing && this.time >= this.end) this.seek(this.start);
    this.playing = !this.playing;
  }

  /**
   * @param {number} direction
   * @param {boolean} second
   */
  step(direction, second) {
    this.playing = false;
    if (second) return this.seek(this.time + direction);
    const { time } = this.replay;
    const { i, f } = this.replay.at(this.time);
    const to = direction > 0 ? i + 1 : f > 0 ? i : i - 1;
    this.seek(time[Math.min(Math.max(to, 0), time.length - 1)], direction > 0);
  }

  restart() {
    this.seek(this.start);
  }

  /** @param {number | null} speed */
  setSpeed(speed) {
    this.speed = speed;
  }

  /**
   * Shows a time; messages since the time before pass if it is a step on.
   * @param {number} time
   */
  seek(time, withMessages = false) {
    const before = this.time;
    this.time = Math.min(Math.max(time, this.start), this.end);
    this.pending = this.replay.instant(this.time);
    if (!withMessages) return;
    for (const system of this.meta.systems)
      this.messages(system, this.replay.messagesBetween(system.name, before, this.time));
  }

  /** @param {number} seconds that have passed */
  advance(seconds) {
    if (!this.playing) return;
    this.seek(this.time + seconds * (this.speed ?? 1), true);
    if (this.time >= this.end) this.playing = false;
  }

  /**
   * Of the whole run, also while an earlier time is shown.
   * @param {System} system
   * @returns {State}
   */
  stateOf({ name }) {
    return this.outcome[name] ?? { status: "" };
  }
}
