// The lines of a plot: how each looks, what it is called, and whether it is on.
import { dashOf, line } from "./colours.js";
import { colour } from "./theme.js";
/** @import { Plots } from "./plots.js" */
/** @import { Spec } from "./specs.js" */

export class Lines {
  /**
   * @param {Plots} plots
   * @param {Spec} spec
   * @param {Set<number>} hidden groups of lines that are switched off
   */
  constructor(plots, spec, hidden) {
    this.plots = plots;
    this.spec = spec;
    this.hidden = hidden;
  }

  /**
   * Colour and dash of the k-th line.
   * @param {number} k
   */
  lookOf(k) {
    const { spec } = this;
    const { agent, column, system } = spec.lines[k];
    const look = spec.total === 1 ? { colour: colour("text"), dash: [] } : line(agent ?? column);
    return spec.systems.length > 1 ? { ...look, dash: dashOf(system.run) } : look;
  }

  /**
   * What the k-th line is.
   * @param {number} k
   */
  nameOf(k) {
    const { label, system } = this.spec.lines[k];
    const whose = this.spec.systems.length > 1 ? `, ${this.plots.headingOf(system.run)}` : "";
    return `${this.spec.noun} ${label}`.trim() + whose;
  }

  /**
   * The same in few characters.
   * @param {number} k
   */
  shortOf(k) {
    const { shorts, systems, lines, total } = this.spec;
    const short = total === 1 ? "" : shorts[k];
    return systems.length > 1 ? `${short} ${this.plots.headingOf(lines[k].system.run)}`.trim() : short;
  }

  /**
   * Which lines have their key in common with the k-th.
   * @param {number} k
   */
  groupOf(k) {
    return this.spec.groups.findIndex((group) => group.includes(k));
  }

  /**
   * Whether the k-th line is drawn.
   * @param {number} k
   */
  shows(k) {
    return !this.hidden.has(this.groupOf(k)) && this.runOn(k);
  }

  /**
   * Whether the run is on that the k-th line is of.
   * @param {number} k
   */
  runOn(k) {
    return !this.plots.hiddenRuns.has(this.spec.lines[k].system.run);
  }

  /** @param {number} group */
  toggle(group) {
    if (!this.hidden.delete(group)) this.hidden.add(group);
  }

  /** @param {number} group */
  showOnly(group) {
    this.hidden.clear();
    for (const each of this.spec.groups.keys()) if (each !== group) this.hidden.add(each);
  }

  /** The lines that are drawn. */
  get on() {
    return [...this.spec.lines.keys()].filter((k) => this.shows(k));
  }
}
