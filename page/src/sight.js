// A page inside another one, as the replays of a notebook: it draws while it is in sight only, and
// leaves the wheel to the page around it unless the view has the focus.
import { byId } from "./dom.js";

const inside = window.parent !== window;

/**
 * Says whether this page is in sight, at once and whenever that changes; one that is in no other page
 * always is.
 * @param {(seen: boolean) => void} tell
 */
export const watchSight = (tell) => {
  if (!inside) return tell(true);
  const watch = new IntersectionObserver((entries) => tell(entries[entries.length - 1].isIntersecting));
  watch.observe(document.documentElement);
};

/** Whether the wheel has something to scroll. */
const scrolls = () => inside || byId("main").scrollHeight > byId("main").clientHeight;

/** The wheel zooms the view where nothing scrolls, or when the view was clicked or tabbed to. */
export const leaveWheel = () => {
  const pane = byId("pane");
  const has = () => document.hasFocus() && document.activeElement === pane;
  document.body.classList.toggle("inside", inside);
  pane.addEventListener("pointerdown", () => pane.focus({ preventScroll: true }), true);
  pane.addEventListener(
    "wheel",
    (event) => {
      if (scrolls() && !has() && !event.ctrlKey) event.stopPropagation(); // before meshcat has it
    },
    true,
  );
  pane.addEventListener("keydown", ({ key }) => {
    if (key === "Escape") pane.blur();
  });
};
