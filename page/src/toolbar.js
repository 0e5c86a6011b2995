// Above and below the 3-D view: what to follow, labels, links, estimates, and the legend.
import { rampGradient } from "./colours.js";
import { byId, element, press } from "./dom.js";
/** @import { Overlay } from "./overlay.js" */
/** @import { Scene as Drawn } from "./scene.js" */
/** @import { Agent, Instant, Scene, System } from "./types.d.ts" */

/**
 * @param {System} system
 * @param {number} agent
 */
const nameOf = (system, agent) => `${system.agent_name} ${agent + 1}`;

/**
 * An option for each agent of a system; the value is an Agent as JSON.
 * @param {System} system
 */
const optionsOf = (system) =>
  [...Array(system.agents).keys()].map((agent) =>
    element("option", {
      value: JSON.stringify({ system: system.name, agent }),
      text: nameOf(system, agent),
    }),
  );

export class Toolbar {
  /**
   * @param {Drawn} scene
   * @param {Overlay} overlay
   */
  constructor(scene, overlay) {
    this.scene = scene;
    this.overlay = overlay;
    /** @type {System[]} */
    this.systems = [];
    byId("ghost-agent").onchange = () => this.setGhosts(true);
    byId("follow").onchange = () => this.setFollow(byId("follow").value);
    byId("ramp").style.background = rampGradient();
  }

  /** @param {Scene} meta */
  setMeta({ systems, controls }) {
    this.systems = systems;
    const live = controls !== undefined; // a run that goes on
    this.fillFollow();
    this.setFollow(byId("follow").value); // which is everything again
    this.fillGhosts();
    this.describeLinks(live);
  }

  // ---- labels and links

  toggleLabels() {
    this.overlay.labelled = !this.overlay.labelled;
    press(byId("labels"), this.overlay.labelled);
    this.scene.dirty();
  }

  toggleLinks() {
    const { links } = this.overlay;
    links.shown = !links.shown;
    press(byId("links"), links.shown);
    this.scene.dirty();
  }

  /** @param {boolean} live whether they can be lost */
  describeLinks(live) {
    const linked = this.systems.filter((system) => system.edges.length > 0);
    byId("links").hidden = linked.length === 0;
    const words = new Set(linked.map((system) => system.edges_are));
    const parts = [];
    if (words.has("messages")) parts.push("lines: messages pass");
    if (words.has("measurements")) parts.push("dashed lines: measured directly");
    if (linked.some((system) => system.links.length && system.message_period !== null))
      parts.push("✕ lost");
    if (words.has("messages") && live) parts.push("click a line: the link is lost, or there again");
    if (linked.some((system) => system.triggered)) parts.push("sent by triggers: see the plot");
    const planned = this.systems.filter(({ plan }) => plan);
    if (planned.length) parts.push("rings: outputs, where robots head");
    if (planned.some(({ quantities }) => quantities.some(({ between }) => between.length)))
      parts.push("strips: bounded distances");
    if (planned.some(({ plan }) => plan?.radius.some((radius) => radius !== null)))
      parts.push("circles: half of the least distance");
    const note = byId("link-note");
    note.textContent = parts.join(" · ");
    note.hidden = parts.length === 0;
  }

  // ---- what the camera follows

  fillFollow() {
    const fleets = this.systems.filter((system) => system.drawn_as === "fleet");
    byId("follow-label").hidden = fleets.length === 0;
    byId("follow").replaceChildren(
      element("option", { value: "fleet", text: "all" }),
      ...(fleets.length > 1
        ? fleets.map((fleet) => element("optgroup", { label: fleet.name }, ...optionsOf(fleet)))
        : fleets.flatMap(optionsOf)),
      element("option", { value: "none", text: "nothing" }),
    );
  }

  /** Everything in view again, whatever was followed. */
  fit() {
    byId("follow").value = "fleet";
    this.setFollow("fleet");
  }

  /** @param {string} value of an option */
  setFollow(value) {
    const { camera } = this.scene;
    if (value === "fleet" || value === "none") camera.setFollow({ kind: value });
    else camera.setFollow({ kind: "agent", ...JSON.parse(value) });
  }

  /**
   * Follows an agent, if that can be.
   * @param {Agent | null} which
   */
  followAgent(which) {
    const select = byId("follow");
    const value = JSON.stringify(which);
    if (![...select.options].some((option) => option.value === value)) return;
    select.value = value;
    this.setFollow(value);
  }

  // ---- estimates

  fillGhosts() {
    const systems = this.systems.filter((system) => system.estimates);
    byId("ghost-tools").hidden = systems.length === 0;
    byId("ghost-agent").replaceChildren(
      ...systems.map((system) =>
        element("optgroup", { label: system.name }, ...optionsOf(system)),
      ),
    );
    this.setGhosts(false);
  }

  toggleGhosts() {
    this.setGhosts(this.scene.ghosts.shown === null);
  }

  /** @param {boolean} on */
  setGhosts(on) {
    const { value } = byId("ghost-agent");
    /** @type {Agent | null} */
    const shown = on && value ? JSON.parse(value) : null;
    press(byId("ghosts"), shown !== null);
    byId("ghost-label").hidden = shown === null;
    byId("ghost-note").hidden = shown === null;
    if (shown) byId("ghost-note").textContent = this.ghostNote(shown);
    this.scene.ghosts.show(shown);
  }

  /** @param {Agent} agent */
  ghostNote({ system: name, agent }) {
    const system = /** @type {System} */ (this.systems.find((each) => each.name === name));
    const who = nameOf(system, agent);
    const others = system.kept ? "those that it estimates" : "the others";
    if (system.drawn_as === "bars")
      return `Outlines: ${system.action.name}s of ${others} as ${who} takes them to be.`;
    const wrong = `(estimate − actual ${system.action.name})`;
    return `Pale copies: ${others} as ${who} takes them to be, displaced by ${wrong} × 1 s.`;
  }

  // ---- legend

  /**
   * Explains the colour of shares that are not known, where there are some.
   * @param {Instant | null} instant
   */
  showLegend(instant) {
    const shares = Object.values(instant?.systems ?? {}).map((own) => own.share ?? [NaN]);
    byId("unknown").hidden = !shares.some((share) => share.some((each) => Number.isNaN(each)));
  }
}
