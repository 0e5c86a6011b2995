// What keys, buttons and the mouse do.
import { byId, press } from "./dom.js";
import { onKeys } from "./keys.js";
import { placeNotes } from "./notices.js";
import { leaveWheel } from "./sight.js";
/** @import { Page } from "./page.js" */

const NARROWEST = 280; // px of the plots
const VIEW = 380; // px that the 3-D view keeps

/** @param {Page} page */
export const wire = (page) => {
  const { scene, toolbar } = page;
  const actions = {
    " ": () => page.playPause(),
    ArrowRight: (/** @type {KeyboardEvent} */ { shiftKey }) => page.step(1, shiftKey),
    ArrowLeft: (/** @type {KeyboardEvent} */ { shiftKey }) => page.step(-1, shiftKey),
    r: () => page.restart(),
    f: () => toolbar.fit(),
    l: () => toolbar.toggleLabels(),
    c: () => toolbar.toggleLinks(),
    g: () => toolbar.toggleGhosts(),
    p: fold,
    b: () => page.comparison.toggle(),
    d: () => page.switchTheme(),
    "?": () => byId("help").showModal(),
    "[": () => scene.camera.nudge(-6, 1),
    "]": () => scene.camera.nudge(6, 1),
    "+": () => scene.camera.nudge(0, 0.88),
    "=": () => scene.camera.nudge(0, 0.88),
    "-": () => scene.camera.nudge(0, 1.14),
  };
  placeNotes();
  onKeys(actions);
  byId("fit").onclick = actions.f;
  byId("labels").onclick = actions.l;
  byId("links").onclick = actions.c;
  byId("ghosts").onclick = actions.g;
  byId("fold").onclick = actions.p;
  byId("theme").onclick = actions.d;
  byId("help-open").onclick = actions["?"];
  byId("banner-close").onclick = () => (byId("banner").hidden = true);
  byId("banner-show").onclick = () => page.seekExit();
  wirePane(page);
  leaveWheel();
  wireDivider();
  leaveKeys();
};

/** Folds the plots away, or shows them. */
const fold = () => press(byId("fold"), !document.body.classList.toggle("folded"));

/** What was pressed by mouse does not keep the keys: space is to play and pause. */
const leaveKeys = () => {
  /** @param {Event} event */
  const pressedBy = ({ target }) =>
    target instanceof Element
      ? /** @type {HTMLElement | null} */ (target.closest("button, summary, select"))
      : null;
  /** @param {HTMLElement | null} pressed */
  const release = (pressed) => {
    if (pressed && !pressed.matches(":focus-visible")) pressed.blur();
  };
  document.addEventListener("change", (event) => release(pressedBy(event)));
  document.addEventListener("click", (event) => {
    const pressed = pressedBy(event);
    if (pressed?.tagName !== "SELECT") release(pressed);
  });
};

/** @param {Page} page */
const wirePane = (page) => {
  const pane = byId("pane");
  const near = (/** @type {MouseEvent} */ event) => {
    const box = pane.getBoundingClientRect();
    return page.overlay.agentNear(event.clientX - box.left, event.clientY - box.top);
  };
  pane.addEventListener("mousemove", (event) => {
    if (event.buttons) return;
    const which = near(event);
    if (JSON.stringify(which) !== JSON.stringify(page.overlay.highlighted)) page.highlight(which);
  });
  pane.addEventListener("mouseleave", () => page.highlight(null));
  pane.addEventListener("dblclick", (event) => page.toolbar.followAgent(near(event)));
};

const wireDivider = () => {
  const divider = byId("divider");
  const set = (/** @type {number} */ width) => {
    const fitting = Math.round(Math.min(Math.max(width, NARROWEST), innerWidth - VIEW));
    document.documentElement.style.setProperty("--plots", `${fitting}px`);
    divider.setAttribute("aria-valuenow", String(fitting));
  };
  divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
  divider.addEventListener("pointermove", (event) => {
    if (divider.hasPointerCapture(event.pointerId)) set(innerWidth - event.clientX);
  });
  divider.addEventListener("dblclick", fold);
  divider.addEventListener("keydown", ({ key }) => {
    const now = byId("plots").clientWidth;
    if (key === "ArrowLeft") set(now + 24);
    if (key === "ArrowRight") set(now - 24);
  });
};
