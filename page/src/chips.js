// The keys of a plot's lines, with their values: each switches its lines.
import { swatchOf } from "./caption.js";
import { MOST_CHIPS } from "./chart.js";
import { element, press } from "./dom.js";
/** @import { Plot } from "./plot.js" */

export class Chips {
  /** @param {Plot} plot */
  constructor(plot) {
    const { spec } = plot;
    const shown = spec.groups.length;
    this.plot = plot;
    this.root = element("div", { class: "plot-chips" });
    this.several = spec.total > shown ? `${shown} of ${spec.total} shown` : "";
    this.note = element("span", { class: "plot-note", text: this.several });
    this.values = shown > MOST_CHIPS ? [] : spec.groups.map((_, group) => this.add(group));
    this.readout = element("span", { class: "readout" });
    this.root.append(...(this.values.length ? [] : [this.readout]), this.note);
  }

  /**
   * The chip of a group of lines; returns where their values are written.
   * @param {number} group
   */
  add(group) {
    const { plot } = this;
    const { spec, lines } = plot;
    const [k] = spec.groups[group];
    const value = element("span", { class: "chip-value" });
    const what = `${spec.noun} ${spec.lines[k].label}`.trim();
    const chip = element(
      "button",
      {
        type: "button",
        class: "plot-chip",
        title: `${what}: click switches the line, a double click shows it alone`,
        onmouseenter: () => plot.point(k),
        onmouseleave: () => plot.point(null),
        onclick: () => this.change(() => lines.toggle(group)),
        ondblclick: () => this.change(() => lines.showOnly(group)),
      },
      element("span", { class: "unseen", text: `line of ${what}: ` }),
      swatchOf(lines.lookOf(k)),
      element("span", { "aria-hidden": true, text: spec.total === 1 ? "" : spec.shorts[k] }),
      value,
      element("span", { class: "unseen", text: ` ${spec.unit}` }),
    );
    this.root.append(chip);
    return value;
  }

  /** @param {() => void} act */
  change(act) {
    act();
    this.plot.showLines();
  }

  /** Says which lines are on. */
  press() {
    const { hidden } = this.plot.lines;
    this.values.forEach(
      (value, group) => value.parentElement && press(value.parentElement, !hidden.has(group)),
    );
  }

  /**
   * The chip of a line stands out.
   * @param {number | null} k
   */
  mark(k) {
    const chosen = k === null ? -1 : this.plot.lines.groupOf(k);
    this.values.forEach((value, group) =>
      value.parentElement?.classList.toggle("chosen", group === chosen),
    );
  }

  /**
   * Values at a sample.
   * @param {number} i
   * @param {string[]} notes what else is said of the plot
   */
  write(i, notes) {
    const { plot } = this;
    const { spec, lines, focused: k } = plot;
    this.note.textContent = [this.several, ...notes].filter(Boolean).join(" · ");
    this.values.forEach((place, group) => {
      const seen = spec.groups[group].filter((each) => lines.runOn(each));
      place.textContent = seen.map((each) => plot.valueText(each, i)).join(" / ");
    });
    if (this.values.length) return;
    this.readout.textContent =
      k === null
        ? "point at a line for its value"
        : `${lines.nameOf(k)}: ${plot.valueText(k, i)} ${spec.unit}`.trim();
  }
}
