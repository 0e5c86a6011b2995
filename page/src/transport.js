// Play, step, speed and time: the bar below.
import { byId, element } from "./dom.js";
import { number } from "./words.js";
/** @import { Page } from "./page.js" */
/** @import { Playback } from "./playback.js" */
/** @import { Intervention, Source } from "./types.d.ts" */

/** @typedef {Intervention & {bad?: boolean, near?: boolean}} Mark */

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];

/** @param {number | null} speed */
const speedName = (speed) => (speed === null ? "max" : `×${speed}`);

/**
 * What is marked along the slider: exits, closest approaches and interventions of a replay.
 * @param {Playback} playback
 * @returns {Mark[]}
 */
export const marksOf = (playback) => {
  const { exits, interventions, meta } = playback;
  const left = Object.entries(exits).map(([name, time]) => ({
    time,
    what: `${name} left the set`,
    bad: true,
  }));
  const near = meta.systems.flatMap((system) => {
    const { margin, margin_time: time } = playback.stateOf(system);
    const what = `${system.name}: closest approach, margin ${number(margin)}`;
    return typeof time === "number" ? [{ time, what, near: true }] : [];
  });
  return [...interventions, ...near, ...left];
};

export class Transport {
  speedKey = ""; // of what the menu of speeds has

  /** @param {Page} page which is driven */
  constructor(page) {
    this.play = byId("play");
    this.speed = byId("speed");
    this.slider = byId("time-slider");
    this.play.onclick = () => page.playPause();
    byId("step").onclick = (event) => page.step(1, event.shiftKey);
    byId("back").onclick = (event) => page.step(-1, event.shiftKey);
    byId("restart").onclick = () => page.restart();
    this.speed.onchange = () =>
      page.setSpeed(this.speed.value === "max" ? null : Number(this.speed.value));
    this.slider.oninput = () => page.seek(Number(this.slider.value));
    this.lead = (/** @type {number} */ time) => page.lead(time);
  }

  /**
   * @param {Source} source what is shown
   * @param {{connected: boolean} | null} live the simulation, if there is one
   */
  show(source, live) {
    const { playing, seekable } = source;
    this.play.dataset.playing = String(playing);
    this.play.setAttribute("aria-label", playing ? "pause" : "play");
    this.play.title = playing ? "Pause (space)" : "Play (space)";
    const lost = live !== null && !live.connected;
    for (const button of [this.play, byId("step"), this.speed]) button.disabled = !seekable && lost;
    byId("back").disabled = !seekable;
    byId("step").title = seekable ? "A sample on (→; with shift 1 s)" : "A step on, then pause (→)";
    const restart = byId("restart");
    restart.disabled = lost;
    restart.title = live ? "Restart the simulation (R)" : "To the start (R)";
    restart.setAttribute("aria-label", live ? "restart the simulation" : "to the start");
    this.showSpeeds(source);
    this.showTime(source);
  }

  /** @param {Source} source */
  showSpeeds({ seekable, speed }) {
    const all = seekable ? [...SPEEDS] : [...SPEEDS, null];
    if (!all.includes(speed)) all.unshift(speed);
    const key = JSON.stringify([all, speed]);
    if (key === this.speedKey) return;
    this.speedKey = key;
    this.speed.replaceChildren(
      ...all.map((each) =>
        element("option", {
          value: each ?? "max",
          text: speedName(each),
          selected: each === speed,
        }),
      ),
    );
  }

  /** @param {Source} source */
  showTime({ time, end, seekable }) {
    this.slider.disabled = !seekable;
    byId("time-track").title = seekable
      ? ""
      : "Time cannot be turned back while the simulation runs; it can when the run has ended.";
    if (Number(this.slider.max) !== end) this.slider.max = String(end);
    this.slider.value = String(time);
    this.slider.setAttribute("aria-valuetext", `${time.toFixed(2)} seconds of ${end}`);
    this.slider.style.setProperty("--done", `${end ? (100 * time) / end : 0}%`);
  }

  /**
   * Marks along the slider, each of which leads there.
   * @param {Mark[]} marks
   * @param {number} end
   */
  mark(marks, end) {
    byId("time-marks").replaceChildren(
      ...marks.map(({ time, what, bad, near }) =>
        element("button", {
          type: "button",
          class: `mark ${bad ? "bad" : near ? "near" : ""}`,
          title: `${time.toFixed(2)} s: ${what}`,
          "aria-label": `${time.toFixed(2)} s: ${what}`,
          onclick: () => this.lead(time),
          style: `left: ${(100 * time) / (end || 1)}%`,
        }),
      ),
    );
  }
}
