// Sliders and pushes of a live simulation.
import { byId, element } from "./dom.js";
import { Slider } from "./slider.js";
import { number, withUnit } from "./words.js";
/** @import { Control, Push, Scene, System } from "./types.d.ts" */

const MOST_PUSHED = 8; // agents, up to which each has push buttons of its own

export class Tuning {
  /** @param {(message: object) => void} send to the simulation */
  constructor(send) {
    this.send = send;
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
      ...controls.map((control) => this.slider(control)),
      ...pushes.map((push) => this.pushes(push, system)),
    );
  }

  /** @param {Control} control */
  slider(control) {
    const { key } = control;
    const slider = new Slider(control, (value) => this.send({ do: "set", key, value }));
    this.sliders.set(key, slider);
    return slider.root;
  }

  /**
   * @param {Push} push
   * @param {System} system
   */
  pushes(push, system) {
    const force = withUnit(push.force, push.unit);
    const title = `Push with ${force} for ${number(push.duration)} s`;
    return element(
      "div",
      { class: "pushes", role: "group", "aria-label": title },
      element("p", { class: "small", text: title }),
      system.agents <= MOST_PUSHED ? this.pushList(push, system) : this.pushChoice(push, system),
    );
  }

  /**
   * Buttons for each agent.
   * @param {Push} push
   * @param {System} system
   */
  pushList(push, { agents, agent_name: noun }) {
    const list = element("div", { class: "push-list" });
    for (let agent = 1; agent <= agents; agent++) {
      const buttons = this.arrows(push, () => agent, `${noun} ${agent}`);
      const name = element("b", { text: agent });
      list.append(element("span", { class: "push-one" }, name, ...buttons));
    }
    return list;
  }

  /**
   * Buttons for the agent that is chosen, when agents are many.
   * @param {Push} push
   * @param {System} system
   */
  pushChoice(push, { agents, agent_name: noun }) {
    const select = element("select", { "aria-label": `${noun} to push` });
    for (let agent = 1; agent <= agents; agent++)
      select.append(element("option", { value: agent, text: `${noun} ${agent}` }));
    const buttons = this.arrows(push, () => Number(select.value), `the chosen ${noun}`);
    return element("span", { class: "push-one" }, select, ...buttons);
  }

  /**
   * @param {Push} push
   * @param {() => number} agentOf from 1
   * @param {string} whom in words
   */
  arrows({ system, axes, force }, agentOf, whom) {
    const arrow = (/** @type {string} */ axis, /** @type {number} */ k, sign = 1) => {
      const what = `push ${whom} ${sign < 0 ? "against" : "along"} ${axis || "its axis"}`;
      return element("button", {
        type: "button",
        class: "push",
        text: (axis === "y" ? "↓↑" : "←→")[sign < 0 ? 0 : 1],
        title: what,
        "aria-label": what,
        onclick: () =>
          this.send({ do: "push", system, agent: agentOf(), axis: k, force: sign * force }),
      });
    };
    return axes.flatMap((axis, k) => [-1, 1].map((sign) => arrow(axis, k, sign)));
  }

  /**
   * The simulation's values.
   * @param {Record<string, number>} values
   */
  follow(values) {
    for (const [key, value] of Object.entries(values)) this.sliders.get(key)?.follow(value);
  }
}
