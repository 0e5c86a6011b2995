// The robot that is chosen: its joints and actuators, its links, and pushes of it by buttons.
import { arrows } from "./arrows.js";
import { byId, element, press } from "./dom.js";
import { fixed } from "./words.js";
/** @import { Page } from "./page.js" */
/** @import { Agent, Instant, JointRow, Scene, System } from "./types.d.ts" */

const COLUMNS = /** @type {const} */ (["position", "velocity", "control"]);
const DIGITS = 3; // behind the point

/** @typedef {typeof COLUMNS[number]} Column */

export class Chosen {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    this.panel = byId("chosen");
    /** @type {Agent | null} */
    this.which = null;
    this.table = element("div");
    this.known = ""; // which of the robot's numbers the table has
    /** @type {{at: number, place: HTMLElement}[]} */
    this.values = [];
    /** @type {{pair: [number, number], button: HTMLElement}[]} */
    this.links = [];
    this.asked = ""; // the system whose joints the simulation was asked for
    byId("follow").addEventListener("change", () => this.chooseFollowed());
  }

  /** @param {Scene} meta */
  setMeta({ systems }) {
    this.asked = "";
    const still = systems.some(
      ({ name, agents }) => name === this.which?.system && agents > this.which.agent,
    );
    this.choose(still ? this.which : null);
  }

  chooseFollowed() {
    const { value } = byId("follow");
    if (value.startsWith("{")) this.choose(JSON.parse(value));
  }

  get system() {
    return this.page.meta?.systems.find(({ name }) => name === this.which?.system);
  }

  /** @param {Agent | null} which */
  choose(which) {
    this.which = which;
    const { system } = this;
    this.panel.hidden = !which || !system;
    this.links = [];
    this.tabulate([], () => false);
    if (!which || !system) return;
    if (system.joints.length && this.asked !== system.name) {
      this.page.live?.send({ do: "look", system: system.name });
      this.asked = system.name;
    }
    this.panel.setAttribute("aria-label", `${system.agent_name} ${which.agent + 1}`);
    this.panel.replaceChildren(
      this.head(system, which),
      ...this.pushButtons(system, which),
      this.table,
      ...this.linkButtons(system, which),
    );
    this.page.slowDue = 0;
  }

  /**
   * @param {System} system
   * @param {Agent} which
   */
  head(system, which) {
    const close = element("button", {
      type: "button",
      class: "icon",
      text: "✕",
      "aria-label": "close",
      onclick: () => this.choose(null),
    });
    const follow = element("button", {
      type: "button",
      text: "Follow",
      onclick: () => this.page.toolbar.followAgent(which),
    });
    const name = element("b", { text: `${system.agent_name} ${which.agent + 1}` });
    const fleet = system.drawn_as === "fleet";
    return element("div", { class: "chosen-head" }, name, fleet ? follow : null, close);
  }

  /**
   * @param {System} system
   * @param {Agent} which
   */
  pushButtons(system, which) {
    const { pushing, running } = this.page.hands;
    const push = pushing.pushes.get(system.name);
    const can = pushing.waysOf(system, which.agent).some((way) => way);
    if (!running || !push || !can) return [];
    const buttons = arrows(pushing, system, () => which.agent, `${system.agent_name} ${which.agent + 1}`);
    return [element("div", { class: "push-one" }, element("span", { text: "Push" }), ...buttons)];
  }

  /**
   * The table of what is known of joints and actuators: a replay has not all of their numbers.
   * @param {JointRow[]} rows of joints, then of actuators
   * @param {(at: number) => boolean} isKnown
   */
  tabulate(rows, isKnown) {
    const all = rows.flatMap((row) => COLUMNS.flatMap((column) => row[column]?.[0] ?? []));
    const known = `${all.filter(isKnown)} of ${all.length}`;
    if (known === this.known) return;
    this.known = known;
    this.values = [];
    const has = (/** @type {JointRow} */ row, /** @type {Column} */ column) =>
      row[column] !== undefined && isKnown(row[column][0]);
    const columns = COLUMNS.filter((column) => rows.some((row) => has(row, column)));
    const cell = (/** @type {JointRow} */ row, /** @type {Column} */ column) => {
      const there = row[column];
      if (!there) return element("td");
      if (!isKnown(there[0])) return element("td", { class: "muted", text: "–" });
      const place = element("span");
      this.values.push({ at: there[0], place });
      return element("td", {}, place, element("small", { text: ` ${there[1]}` }));
    };
    const body = rows
      .filter((row) => columns.some((column) => has(row, column)))
      .map((row) =>
        element(
          "tr",
          {},
          element("th", { scope: "row", text: row.name.replaceAll("_", " ") }),
          ...columns.map((column) => cell(row, column)),
        ),
      );
    const heads = columns.map((text) => element("th", { scope: "col", text }));
    const head = element("tr", {}, element("th", { scope: "col", text: "joint, actuator" }), ...heads);
    const less = this.values.length < all.length;
    this.table.replaceChildren(
      ...(body.length ? [element("table", {}, element("thead", {}, head), element("tbody", {}, ...body))] : []),
      ...(less ? [element("p", { class: "muted", text: "Its other numbers were not recorded." })] : []),
    );
  }

  /**
   * @param {System} system
   * @param {Agent} which
   */
  linkButtons(system, which) {
    const { running, switching } = this.page.hands;
    const own = system.edges.filter((edge) => edge.includes(which.agent + 1));
    if (!running || system.edges_are !== "messages" || !own.length) return [];
    const buttons = own.map((pair) => {
      const other = pair[0] === which.agent + 1 ? pair[1] : pair[0];
      const button = element("button", {
        type: "button",
        class: "toggle",
        text: String(other),
        title: `The link with ${system.agent_name} ${other}: there, or lost`,
        "aria-label": `link with ${system.agent_name} ${other}`,
        onclick: () => switching.toggle(system, pair),
      });
      this.links.push({ pair, button });
      return button;
    });
    const title = element("span", { text: "Links with" });
    return [element("div", { class: "push-one chosen-links" }, title, ...buttons)];
  }

  /**
   * The numbers of now.
   * @param {Instant | null} instant
   */
  show(instant) {
    const { which, system } = this;
    if (!which || !system || !instant) return;
    const { joints } = instant.systems[system.name] ?? {};
    const rows = joints ? (system.joints[which.agent] ?? []) : [];
    this.tabulate(rows, (at) => Number.isFinite(joints?.[at]));
    for (const { at, place } of this.values) {
      const text = fixed(joints?.[at] ?? NaN, DIGITS);
      if (place.textContent !== text) place.textContent = text;
    }
    for (const { pair, button } of this.links)
      press(button, !this.page.hands.switching.isLost(system, pair));
  }
}
