// The page: puts a source of instants, the scene, plots and controls together.
import { byId } from "./dom.js";
import { Comparison, isSolid } from "./compare.js";
import { HandsOn } from "./handson.js";
import { Header, warn } from "./header.js";
import { Keep, momentAsked } from "./keep.js";
import { Live } from "./live.js";
import { Overlay } from "./overlay.js";
import { fetchReplay, fromBase64, unpack } from "./pack.js";
import { Pace } from "./pace.js";
import { Playback } from "./playback.js";
import { Plots } from "./plots.js";
import { Scene } from "./scene.js";
import { setTheme, theme } from "./theme.js";
import { Toolbar } from "./toolbar.js";
import { marksOf, Transport } from "./transport.js";
import { Tuning } from "./tuning.js";
import { Video } from "./video.js";
import { wire } from "./wiring.js";
/** @import { Agent, Instant, Numbers, Pack, Scene as Meta, Source, System } from "./types.d.ts" */
/** @import { Plot } from "./plot.js" */

const SLOW = 100; // ms between refreshes of texts and, live, of plots

export class Page {
  /** @param {"live" | "served" | "file"} mode where the page and its numbers come from */
  constructor(mode) {
    this.mode = mode;
    this.scene = new Scene(byId("pane"));
    this.pace = new Pace(this.scene);
    this.overlay = new Overlay(byId("overlay"), this.scene);
    this.plots = new Plots(byId("plots"), {
      seek: (time) => this.seek(time),
      highlight: (which, plot) => this.highlight(which, plot),
    });
    this.comparison = new Comparison(this);
    this.header = new Header((time) => this.lead(time));
    this.toolbar = new Toolbar(this.scene, this.overlay);
    this.transport = new Transport(this);
    this.keep = new Keep(this);
    new Video(this);
    this.hands = new HandsOn(this);
    /** @type {Live | null} */
    this.live = null; // the simulation, in mode "live"
    /** @type {Playback | null} */
    this.playback = null; // the replay, if that is shown
    /** @type {Meta | null} */
    this.meta = null;
    /** @type {Instant | null} */
    this.instant = null; // what is drawn
    this.drawn = false; // whether anything was
    /** @type {number | null} */
    this.recording = null; // ms of a video's own clock, while one is made
    this.seen = true; // or out of sight, in a page around
    this.wasMoving = false;
    this.before = NaN; // ms, of the picture before
    this.slowDue = 0; // ms, when texts are refreshed
    wire(this);
    if (mode === "live") this.startLive();
    else this.startReplay();
    requestAnimationFrame((now) => this.loop(now));
  }

  /**
   * What is shown.
   * @returns {Source | null}
   */
  get source() {
    return this.playback ?? this.live;
  }

  // ---- where the data come from

  async startReplay() {
    try {
      const pack =
        this.mode === "file"
          ? await unpack(fromBase64(byId("replay").textContent))
          : await fetchReplay();
      this.showReplay(pack);
    } catch (error) {
      warn(`The replay cannot be read: ${error.message}`);
    }
  }

  /** @param {Pack} pack */
  showReplay(pack) {
    const { command_lengths: lengths = [] } = /** @type {Meta} */ (pack.meta);
    const commands = /** @type {Uint8Array} */ (pack.arrays.commands?.data);
    let at = 0;
    for (const length of lengths) {
      this.scene.command(commands.slice(at, at + length));
      at += length;
    }
    const playback = new Playback(pack, { messages: this.messages });
    this.playback = playback;
    this.setScene(playback.meta, playback);
    this.transport.mark(marksOf(playback), playback.end);
    playback.restart();
    this.keep.go();
  }

  startLive() {
    const tuning = new Tuning((message) => live.send(message), this.hands.pushing);
    const live = new Live({
      opened: () => this.opened(),
      lost: (why) => this.lost(why),
      command: (bytes) => this.scene.command(bytes),
      scene: (meta) => {
        this.setScene(meta, live);
        tuning.build(meta);
      },
      messages: this.messages,
      controls: (values) => tuning.follow(values),
      ended: (pack) => this.replayRun(pack, live.speed),
      resumed: () => this.leaveReplay(live),
    });
    this.live = live;
    this.tuning = tuning;
  }

  opened() {
    // another server may stand behind the address now
    if (this.meta) this.scene.clear();
    this.meta = this.instant = null;
    byId("lost").hidden = true;
  }

  /** @param {string} why */
  lost(why) {
    byId("lost").hidden = false;
    byId("lost-text").textContent = why;
    this.slowDue = 0;
  }

  /**
   * A run has ended: it can be replayed now.
   * @param {Pack} pack
   * @param {number | null} speed
   */
  replayRun(pack, speed) {
    const options = { messages: this.messages, pace: "ended; replay", speed: speed ?? 1 };
    const playback = new Playback(pack, options);
    this.playback = playback;
    this.plots.setSource(playback);
    this.transport.mark(marksOf(playback), playback.end);
    this.hands.renew();
    playback.seek(momentAsked() ?? playback.end);
  }

  /** @param {Live} live */
  leaveReplay(live) {
    this.playback = null;
    this.plots.setSource(live);
    this.transport.mark([], 1);
  }

  /**
   * Messages pass along a system's links now.
   * @param {System} system
   * @param {Numbers | undefined} counts
   */
  messages = (system, counts) => {
    const drawn = this.meta?.systems.find(({ name }) => name === system.name);
    const now = this.recording ?? performance.now();
    if (drawn && isSolid(drawn)) this.overlay.links.messages(system, counts, now);
  };

  /**
   * @param {Meta} meta
   * @param {Source} source
   */
  setScene(meta, source) {
    this.meta = meta;
    this.instant = null;
    document.title = `${meta.title} · gne_mj`;
    byId("title").textContent = byId("title").title = meta.title;
    byId("waiting").hidden = true;
    this.comparison.setMeta(meta);
    this.scene.setMeta(meta);
    this.overlay.setMeta(meta);
    this.plots.setScene(meta, source);
    this.toolbar.setMeta(meta);
    this.hands.setMeta(meta);
  }

  // ---- what users ask for

  playPause() {
    this.source?.playPause();
    this.slowDue = 0;
  }

  /**
   * @param {number} direction
   * @param {boolean} second
   */
  step(direction, second) {
    this.source?.step(direction, second);
  }

  /** Of the simulation, also where the replay of a run that has ended is shown. */
  restart() {
    (this.live ?? this.playback)?.restart();
  }

  /** @param {number | null} speed */
  setSpeed(speed) {
    this.source?.setSpeed(speed);
    this.slowDue = 0;
  }

  /** @param {number} time */
  seek(time) {
    this.source?.seek(time);
  }

  /**
   * To a moment, with plots around it.
   * @param {number} time
   */
  lead(time) {
    this.seek(time);
    this.plots.showAround(time);
  }

  /** To where the first system left the set. */
  seekExit() {
    if (this.source) this.seek(Math.min(...Object.values(this.source.exits)));
  }

  /**
   * @param {Agent | null} which
   * @param {Plot} [plot] that was pointed at
   */
  highlight(which, plot) {
    this.overlay.highlighted = which;
    this.plots.highlight(which, plot);
    this.scene.dirty();
  }

  switchTheme() {
    setTheme(theme() === "dark" ? "light" : "dark");
    this.scene.restyle();
    this.plots.restyle();
    this.comparison.restyle();
  }

  // ---- pictures

  /**
   * Out of sight nothing is drawn, and time stands still.
   * @param {boolean} seen
   */
  setSeen(seen) {
    if (seen === this.seen) return;
    this.seen = seen;
    this.before = NaN;
    this.plots.setSeen(seen);
    this.scene[seen ? "wake" : "rest"]();
  }

  /** @param {number} now ms */
  loop(now) {
    requestAnimationFrame((next) => this.loop(next));
    if (!this.seen || this.recording !== null) return;
    const passed = Number.isNaN(this.before) ? 0 : Math.min(now - this.before, 250) / 1000;
    this.before = now;
    const { source } = this;
    this.pace.watch(passed, source?.playing ?? false);
    source?.advance(passed);
    if (!this.meta || !source) return;
    if (source.playing) this.overlay.links.flow(this.meta.systems.filter(isSolid), now);
    this.draw(source, now);
    if (now >= this.slowDue) this.slow(this.meta, source, now);
  }

  /**
   * @param {Source} source
   * @param {number} now ms
   */
  draw(source, now) {
    const instant = source.take();
    if (instant) {
      this.comparison.place(instant);
      this.instant = instant;
      this.scene.apply(instant, source.store);
      this.plots.setTime(instant.time);
    } else if (this.instant && this.scene.stale) this.scene.apply(this.instant, source.store);
    if (!this.instant) return;
    this.hands.follow(source, this.instant);
    const render = this.scene.needsRender;
    if (render) this.scene.render();
    if (render || this.overlay.moving || this.wasMoving) this.overlay.draw(this.instant, now);
    this.wasMoving = this.overlay.moving;
    this.drawn = true;
    this.live?.saw(this.scene.complete);
  }

  /**
   * What need not be fresh at every picture.
   * @param {Meta} meta
   * @param {Source} source
   * @param {number} now ms
   */
  slow(meta, source, now) {
    const began = performance.now();
    if (source.grown) {
      source.grown = false;
      this.plots.refresh();
    } else this.plots.writeValues();
    this.header.show(meta, source);
    this.toolbar.showLegend(this.instant);
    this.hands.chosen.show(this.instant);
    this.transport.show(source, this.live);
    this.keep.show();
    // slow plots must not take more than a sixth of the time
    this.slowDue = now + Math.max(SLOW, 6 * (performance.now() - began));
  }
}
