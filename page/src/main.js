// Where the page begins.
import { byId } from "./dom.js";
import { handleOf } from "./handle.js";
import { Page } from "./page.js";

const { mode = "served" } = JSON.parse(byId("settings").textContent || "{}");
window.gne = handleOf(new Page(mode));
