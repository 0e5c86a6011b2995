// A running simulation as what is shown: it has the time, and does what it is asked to.
import { History } from "./history.js";
import { instantOfFrame } from "./instant.js";
import { keepScenario } from "./keep.js";
import { dismiss, notify } from "./notices.js";
import { fetchReplay } from "./pack.js";
import { Socket } from "./socket.js";
import { number, outside } from "./words.js";
/** @import { Frame, Instant, Intervention, Numbers, Pack, Scene } from "./types.d.ts" */
/** @import { Source, State, System } from "./types.d.ts" */

/**
 * @typedef {object} Listener what is told of a simulation
 * @property {() => void} opened there is a connection, to another server perhaps
 * @property {(why: string) => void} lost
 * @property {(bytes: Uint8Array) => void} command one of meshcat's
 * @property {(meta: Scene) => void} scene
 * @property {(system: System, counts: Numbers | undefined) => void} messages
 * @property {(values: Record<string, number>) => void} controls sliders' values
 * @property {(pack: Pack) => void} ended the run has, and can be replayed
 * @property {() => void} resumed another run has begun, and the replay is over
 */

/** @implements {Source} */
export class Live {
  /** @param {Listener} listener */
  constructor(listener) {
    this.listener = listener;
    this.seekable = false;
    this.connected = false;
    this.framesReceived = 0;
    /** @type {Scene | null} */
    this.meta = null;
    /** @type {Frame | null} */
    this.frame = null; // the last one
    this.store = new History([]);
    this.time = 0;
    this.playing = false;
    /** @type {number | null} */
    this.speed = 1;
    this.grown = false;
    /** @type {Record<string, number>} */
    this.exits = {};
    /** @type {Intervention[]} */
    this.interventions = [];
    /** @type {Record<string, number>} */
    this.values = {}; // of sliders
    /** @type {Instant | null} */
    this.pending = null;
    this.told = false; // whether the simulation knows that it is seen
    this.fetching = false; // a replay
    this.replayed = false; // the run has ended, and its replay is shown
    this.socket = new Socket({
      opened: () => this.opened(),
      lost: (why) => this.lost(why),
      command: (bytes) => listener.command(bytes),
      pack: (pack) => this.receive(pack),
      message: (message) => this.hear(message),
    });
  }

  get end() {
    return this.meta?.duration ?? 0;
  }

  take() {
    const instant = this.pending;
    this.pending = null;
    return instant;
  }

  // ---- what the simulation is asked for

  /** @param {object} message */
  send(message) {
    this.socket.send(message);
  }

  playPause() {
    this.send({ do: this.playing ? "pause" : "play" });
  }

  /** @param {number} direction */
  step(direction) {
    if (direction > 0) this.send({ do: "step" });
  }

  restart() {
    this.send({ do: "restart" });
  }

  /** @param {number | null} value */
  setSpeed(value) {
    this.send({ do: "speed", value });
  }

  seek() {} // its time cannot be turned back

  advance() {} // it does so itself

  /**
   * A picture was drawn: a run that waits for its viewer begins with the first one that has all.
   * @param {boolean} whole
   */
  saw(whole) {
    if (this.told || !whole || !this.connected) return;
    this.told = true;
    this.send({ do: "seen" });
  }

  // ---- what it tells

  opened() {
    this.told = false;
    this.meta = this.pending = null;
    this.connected = true;
    this.listener.opened();
  }

  /** @param {string} why */
  lost(why) {
    this.connected = this.playing = false;
    this.listener.lost(why);
  }

  /** @param {Pack} pack */
  receive(pack) {
    const { kind } = pack.meta;
    if (kind === "scene") this.begin(pack.meta);
    else if (kind === "history") {
      this.store.fill(pack);
      this.grown = true;
    } else if (kind === "frame" && this.meta) this.takeFrame(pack, this.meta.systems);
  }

  /** @param {Scene} meta */
  begin(meta) {
    this.leaveReplay();
    this.exits = {};
    this.meta = meta;
    this.store = new History(meta.systems);
    this.listener.scene(meta);
  }

  /**
   * @param {Pack} pack
   * @param {System[]} systems
   */
  takeFrame(pack, systems) {
    this.framesReceived++;
    const frame = (this.frame = /** @type {Frame} */ (pack.meta));
    if (frame.ended) this.askForReplay();
    else this.leaveReplay();
    if (this.replayed) return;
    const instant = instantOfFrame(pack, systems);
    if (instant.time < this.time) this.exits = {};
    this.noteExits(frame);
    this.playing = frame.playing;
    this.speed = frame.speed;
    this.store.push(instant);
    this.time = instant.time;
    this.pending = instant;
    this.grown = true;
    for (const system of systems)
      this.listener.messages(system, instant.systems[system.name].messages);
  }

  /** @param {Frame} frame */
  noteExits(frame) {
    for (const [name, state] of Object.entries(frame.state))
      if (outside(state.status)) this.exits[name] ??= state.exit_time ?? frame.time;
      else delete this.exits[name];
  }

  async askForReplay() {
    if (this.fetching || this.replayed) return;
    this.fetching = true;
    try {
      const pack = await fetchReplay();
      if (!this.frame?.ended) return; // restarted meanwhile
      this.listener.ended(pack);
      this.replayed = true;
      this.playing = false;
    } catch (error) {
      notify(`The run has ended, but its replay could not be had: ${error.message}`, "error");
    } finally {
      // not asked for again at every frame, should it have failed
      this.fetching = Boolean(this.frame?.ended) && !this.replayed;
    }
  }

  leaveReplay() {
    this.fetching = false;
    if (!this.replayed) return;
    this.replayed = false;
    this.exits = {};
    this.interventions = [];
    this.store.clear();
    this.time = 0;
    this.listener.resumed();
  }

  /** @param {any} message */
  hear(message) {
    if (message.kind === "notice") notify(message.text, message.level, message.about);
    else if (message.kind === "scenario") keepScenario(message.text);
    else if (message.kind === "controls") this.takeValues(message.values);
    else if (message.kind === "interventions") this.interventions = message.done;
  }

  /** @param {Record<string, number>} values where sliders are now */
  takeValues(values) {
    // what was refused of a slider that has moved since is the past
    for (const key of Object.keys(values)) if (values[key] !== this.values[key]) dismiss(key);
    this.values = values;
    this.listener.controls(values);
  }

  // ---- in words

  /**
   * @param {System} system
   * @returns {State}
   */
  stateOf({ name }) {
    const state = this.frame?.state[name] ?? { status: "waiting" };
    if (state.status !== "running") return state;
    if (!this.connected) return { ...state, status: "not_connected" };
    if (this.playing) return state;
    return { ...state, status: this.time > 0 ? "paused" : "not_begun" };
  }

  get pace() {
    if (!this.frame) return "";
    if (!this.connected) return "not connected";
    if (!this.playing) return "paused";
    const { speed, pace } = this.frame;
    const wished = speed === null ? "as fast as possible" : `×${number(speed)}`;
    const reached = speed !== null && pace !== null && Math.abs(pace / speed - 1) < 0.05;
    return pace === null || reached ? wished : `${wished}, ×${number(pace)} reached`;
  }
}
