// Buttons that push an agent along its axes, both ways, for the mouse and the keyboard.
import { element } from "./dom.js";
/** @import { Pushing } from "./push.js" */
/** @import { Push, System } from "./types.d.ts" */

/** @type {Record<string, string>} */
const SIGNS = { y: "↓↑", z: "⇓⇑" };

/**
 * @param {Pushing} pushing
 * @param {System} system
 * @param {() => number} agentOf from 0
 * @param {string} whom in words
 */
export const arrows = (pushing, system, agentOf, whom) => {
  const push = /** @type {Push} */ (pushing.pushes.get(system.name));
  const arrow = (/** @type {string} */ axis, /** @type {number} */ k, sign = 1) => {
    const what = `push ${whom} ${sign < 0 ? "against" : "along"} ${axis || "its axis"}`;
    const forces = () => push.axes.map((_, each) => (each === k ? sign * push.force : 0));
    return element("button", {
      type: "button",
      class: "push",
      text: (SIGNS[axis] ?? "←→")[sign < 0 ? 0 : 1],
      title: what,
      "aria-label": what,
      onclick: () => pushing.send({ system: system.name, agent: agentOf() }, forces().slice(0, k + 1)),
    });
  };
  return push.axes.flatMap((axis, k) => [-1, 1].map((sign) => arrow(axis, k, sign)));
};
