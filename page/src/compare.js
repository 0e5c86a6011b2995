// Several runs on one clock: beside each other, or as translucent copies at the same place, and
// which of them are seen.
import { swatchOf } from "./caption.js";
import { dashOf } from "./colours.js";
import { byId, element, press } from "./dom.js";
import { colour } from "./theme.js";
import { number } from "./words.js";
/** @import { Layout } from "./layout.js" */
/** @import { Page } from "./page.js" */
/** @import { Instant, Run, Scene, System, Text } from "./types.d.ts" */

const BELOW = 0.7; // m in front of a fleet, where its run's heading stands

/** @param {System} system */
export const isSolid = ({ shown }) => !shown.faint && !shown.off;

/**
 * How far from where it was simulated a system is drawn.
 * @param {System} system
 * @param {boolean} ghosts
 * @returns {[number, number]}
 */
const offsetOf = ({ shift, beside }, ghosts) =>
  ghosts ? shift : [shift[0] + beside[0], shift[1] + beside[1]];

export class Comparison {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    this.hidden = page.plots.hiddenRuns;
    this.ghosts = false;
    /** @type {Scene | null} */
    this.meta = null;
    byId("compare").onchange = () => this.setGhosts(byId("compare").value === "ghosts");
  }

  /** @returns {Run[]} none where there is only one */
  get runs() {
    return this.meta?.runs ?? [];
  }

  /** @param {Scene} meta */
  setMeta(meta) {
    this.meta = meta;
    this.hidden.clear();
    this.arrange();
    byId("compare-label").hidden = !meta.runs;
    this.page.plots.runs.replaceChildren(...this.runs.map((run, k) => this.keyOf(run, k)));
    this.restyle();
  }

  /** Where each system is drawn, and how. */
  arrange() {
    const systems = this.meta?.systems ?? [];
    const first = systems.find(({ run }) => !this.hidden.has(run))?.run ?? 0;
    for (const system of systems) {
      const alike = systems.filter((each) => this.comparedBy(each) === this.comparedBy(system));
      const off = this.hidden.has(system.run);
      const under = alike.find(({ run }) => run === first) ?? null;
      // bars of another quantity stand where they did
      const ghost = system.drawn_as === "fleet" || under !== null;
      const faint = this.ghosts && !off && system.run !== first && ghost;
      system.shown = {
        offset: offsetOf(system, this.ghosts),
        faint,
        off,
        over: faint ? under : null,
        alike: alike.map(({ name }) => name),
      };
    }
  }

  /**
   * What systems of several runs have in common.
   * @param {System} system
   */
  comparedBy({ name, run, action }) {
    return [this.runs[run]?.systems[name] ?? name, action.name, action.unit].join("\n");
  }

  /** @param {boolean} ghosts */
  setGhosts(ghosts) {
    this.ghosts = ghosts;
    byId("compare").value = ghosts ? "ghosts" : "beside";
    this.changed();
  }

  toggle() {
    if (this.runs.length) this.setGhosts(!this.ghosts);
  }

  /** @param {number} run */
  toggleRun(run) {
    if (!this.hidden.delete(run)) this.hidden.add(run);
    this.restyle();
    this.page.plots.showLines();
    this.changed();
  }

  changed() {
    const { scene, source } = this.page;
    this.arrange();
    this.tell();
    scene.stale = true;
    source?.seek(source.time);
  }

  /** Keys of runs in the theme's colours. */
  restyle() {
    [...this.page.plots.runs.children].forEach((key, run) => {
      key.querySelector("canvas")?.replaceWith(this.swatch(run));
      press(/** @type {HTMLElement} */ (key), !this.hidden.has(run));
    });
    this.tell();
  }

  /** @param {number} run */
  swatch(run) {
    return swatchOf({ colour: colour("text"), dash: dashOf(run) });
  }

  /**
   * The key of a run, which switches it.
   * @param {Run} run
   * @param {number} k
   */
  keyOf({ name, heading, about, end }, k) {
    const ends = this.runs.some((each) => each.end !== end) ? `to ${number(end, 4)} s` : "";
    const more = [name === heading ? "" : name, ends].filter(Boolean).join(", ");
    return element(
      "button",
      {
        type: "button",
        class: "plot-chip run-key",
        title: `${name}: ${about}. A click switches this run.`,
        onclick: () => this.toggleRun(k),
      },
      this.swatch(k),
      element("b", { text: heading }),
      element("span", { class: "muted", text: more }),
    );
  }

  /** What is solid, in the legend. */
  tell() {
    const note = byId("compare-note");
    note.hidden = !this.ghosts || !this.runs.length;
    const seen = this.runs.filter((_, k) => !this.hidden.has(k)).map(({ heading }) => heading);
    const others = seen.length > 1 ? `; translucent, in rings: ${seen.slice(1).join("; ")}` : "";
    note.textContent = `solid: ${seen[0] ?? "none"}${others}`;
  }

  /**
   * An instant with all runs where they are drawn.
   * @param {Instant} instant
   */
  place(instant) {
    if (!this.runs.length || !instant.poses) return;
    const poses = Float64Array.from(instant.poses); // a replay writes those again that vary only
    instant.poses = poses;
    for (const { name, agents, items, shift, shown } of this.meta?.systems ?? []) {
      const [first, count] = items;
      for (let p = 8 * first; p < 8 * (first + count); p += 8) {
        for (const axis of [0, 1]) poses[p + axis] += shown.offset[axis] - shift[axis];
        if (shown.off) poses[p + 7] = 0;
      }
      if (shown.off) instant.systems[name].there = new Float64Array(agents);
    }
  }
}

/**
 * Headings of runs that stand beside each other, in front of each one's fleet.
 * @param {System[]} systems
 * @param {Run[]} runs
 * @param {Layout} layout
 * @returns {Text[]}
 */
export const headingTexts = (systems, runs, layout) =>
  systems
    .filter((system) => system.drawn_as === "fleet" && isSolid(system))
    .map((system) => {
      const places = [...Array(system.agents).keys()].map((k) => layout.agentAt(system, k));
      const middle = places.reduce((sum, [x]) => sum + x, 0) / places.length;
      const front = Math.min(...places.map(([, y]) => y)) - BELOW;
      const point = [middle, front, layout.floor];
      return { point, text: runs[system.run].heading, bold: true, title: true };
    });
