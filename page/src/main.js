// Where the page begins: of many in a notebook those that are not seen need not be there.
import { byId } from "./dom.js";
import { handleOf } from "./handle.js";
import { Page } from "./page.js";
import { watchSight } from "./sight.js";

const { mode = "served" } = JSON.parse(byId("settings").textContent || "{}");
/** @type {Page | null} */
let page = null;
watchSight((seen) => {
  if (page) return page.setSeen(seen);
  if (!seen) return;
  page = new Page(mode);
  window.gne = handleOf(page);
});
