// What one takes along: a link to a moment, the run as a file, the scenario with what was done.
import { byId } from "./dom.js";
import { download } from "./export.js";
import { notify } from "./notices.js";
/** @import { Page } from "./page.js" */

/** The time that the page's address asks for, in s, or null. */
export const momentAsked = () => {
  const found = /^#t=(\d+(?:\.\d+)?)$/.exec(location.hash);
  return found ? Number(found[1]) : null;
};

/**
 * Copies a text or, where that is not allowed, saves it.
 * @param {string} text
 * @param {string} what
 * @param {string} file
 */
const copy = async (text, what, file) => {
  try {
    await navigator.clipboard.writeText(text);
    notify(`${what} is copied.`, "info", what);
  } catch {
    download(file, new Blob([text], { type: "text/plain" }));
    notify(`${what} is saved as ${file}.`, "info", what);
  }
};

/** @param {string | null | undefined} text of a scenario's file */
export const keepScenario = (text) => {
  if (text) copy(text, "The scenario with what was done", "scenario.toml");
  else notify("What was done to this run is not said by any keys of a scenario.", "error");
};

export class Keep {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    byId("keep-link").onclick = () => this.link();
    byId("keep-scenario").onclick = () => this.scenario();
    addEventListener("hashchange", () => this.go());
    addEventListener("click", ({ target }) => {
      if (target instanceof Element && !target.closest("#keep summary")) byId("keep").open = false;
    });
  }

  /** To the moment that the address asks for, in a replay. */
  go() {
    const time = momentAsked();
    if (time !== null && this.page.playback) this.page.seek(time);
  }

  link() {
    location.hash = `t=${Number((this.page.source?.time ?? 0).toFixed(4))}`;
    copy(location.href, "The link to this moment", "link.txt");
  }

  scenario() {
    const { live, playback } = this.page;
    if (playback) keepScenario(playback.meta.scenario);
    else live?.send({ do: "scenario" });
  }

  /** Says what can be kept now: a run when it has ended, unless it is a file already. */
  show() {
    const { mode, playback } = this.page;
    byId("keep-run").hidden = mode === "file" || !playback;
    byId("keep-link").hidden = byId("keep-video").hidden = !playback;
    byId("keep-scenario").hidden = Boolean(playback?.meta.runs);
  }
}
