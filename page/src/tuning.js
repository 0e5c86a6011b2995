// Sliders and pushes of a live simulation.
import { arrows } from "./arrows.js";
import { byId, element } from "./dom.js";
import { Slider } from "./slider.js";
/** @import { Pushing } from "./push.js" */
/** @import { Control, Push, Scene, System } from "./types.d.ts" */

const MOST_PUSHED = 8; // agents, up to which each has push buttons of its own

export class Tuning {
  /**
   * @param {(message: object) => void} send to the simulation
   * @param {Pushing} pushing
   */
  constructor(send, pushing) {
    this.send = send;
    this.pushing = pushing;
    /** @type {Map<string, Slider>} */
    this.sliders = new Map();
  }

  /** @param {Scene} meta */
  build({ systems, controls = [], pushes = [] }) {
    const [panel, body] = [byId("tuning"), byId("tuning-body")];
    this.sliders.clear();
    panel.hidden = controls.length + pushes.length === 0;
    panel.open = innerWidth > 1000 && innerHeight > 600; // else the view needs the room
    const rows = systems.map((system) => {
      const own = (/** @type {{system: string}} */ each) => each.system === system.name;
      return this.row(system, controls.filter(own), pushes.filter(own));
    });
    body.replaceChildren(...rows.filter((row) => row !== null));
  }

  /**
   * @param {System} system
   * @param {Control[]} controls
   * @param {Push[]} pushes
   */
  row(system, controls, pushes) {
    if (!controls.length && !pushes.length) return null;
    return element(
      "div",
      { class: "tuning-row", role: "group", "aria-label": system.name },
      element("h3", { text: system.name }),
      element(
        "div",
        { class: "tuning-items" },
        ...controls.map((control) => this.slider(control)),
        ...pushes.map(() => this.pushes(system)),
      ),
    );
  }

  /** @param {Control} control */
  slider(control) {
    const { key } = control;
    const slider = new Slider(control, (value) => this.send({ do: "set", key, value }));
    this.sliders.set(key, slider);
    return slider.root;
  }

  /** @param {System} system */
  pushes(system) {
    const unit = this.pushing.unitOf(system, 0);
    return element(
      "div",
      { class: "pushes", role: "group", "aria-label": `pushes of ${system.name}` },
      element(
        "p",
        { class: "small" },
        "Drag a robot to push it, or with ",
        this.field(system, "force", `force of a push, in ${unit}`, 1000),
        ` ${unit} for `,
        this.field(system, "duration", "duration of a push, in s", 100),
        " s:",
      ),
      system.agents <= MOST_PUSHED ? this.pushList(system) : this.pushChoice(system),
    );
  }

  /**
   * A number of all pushes of a system.
   * @param {System} system
   * @param {"force" | "duration"} key
   * @param {string} label
   * @param {number} max
   */
  field({ name }, key, label, max) {
    const push = /** @type {Push} */ (this.pushing.pushes.get(name));
    const field = element("input", {
      ...{ type: "number", min: 0, max, step: "any", class: "push-number", title: label },
      "aria-label": label,
      value: push[key],
    });
    field.onchange = () => {
      const value = Number(field.value);
      if (value > 0 && value <= max) push[key] = value;
      field.value = String(push[key]); // what cannot be is not taken
    };
    return field;
  }

  /**
   * Buttons for each agent.
   * @param {System} system
   */
  pushList(system) {
    const { agents, agent_name: noun } = system;
    const list = element("div", { class: "push-list" });
    for (let agent = 1; agent <= agents; agent++) {
      const buttons = arrows(this.pushing, system, () => agent - 1, `${noun} ${agent}`);
      const name = element("b", { text: agent });
      list.append(element("span", { class: "push-one" }, name, ...buttons));
    }
    return list;
  }

  /**
   * Buttons for the agent that is chosen, when agents are many.
   * @param {System} system
   */
  pushChoice(system) {
    const { agents, agent_name: noun } = system;
    const select = element("select", { "aria-label": `${noun} to push` });
    for (let agent = 1; agent <= agents; agent++)
      select.append(element("option", { value: agent, text: `${noun} ${agent}` }));
    const buttons = arrows(
      this.pushing,
      system,
      () => Number(select.value) - 1,
      `the chosen ${noun}`,
    );
    return element("span", { class: "push-one" }, select, ...buttons);
  }

  /**
   * The simulation's values.
   * @param {Record<string, number>} values
   */
  follow(values) {
    for (const [key, value] of Object.entries(values)) this.sliders.get(key)?.follow(value);
  }
}
