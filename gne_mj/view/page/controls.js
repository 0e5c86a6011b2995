"use strict";
// What users press: transport, tuning, keys, notices.
(() => {
  const MOST_PUSHED = 8; // agents, up to which each has push buttons of its own
  const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];

  const speedName = (speed) => (speed === null ? "max" : `×${speed}`);

  /** Play, step, speed and time. */
  GNE.Transport = class {
    /** page: what is to be driven: playPause, step, restart, setSpeed, seek. */
    constructor(page) {
      this.page = page;
      this.play = GNE.byId("play");
      this.speed = GNE.byId("speed");
      this.slider = GNE.byId("time-slider");
      this.marks = GNE.byId("time-marks");
      this.play.onclick = () => page.playPause();
      GNE.byId("step").onclick = (event) => page.step(1, event.shiftKey);
      GNE.byId("back").onclick = (event) => page.step(-1, event.shiftKey);
      GNE.byId("restart").onclick = () => page.restart();
      this.speed.onchange = () =>
        page.setSpeed(this.speed.value === "max" ? null : Number(this.speed.value));
      this.slider.oninput = () => page.seek(Number(this.slider.value));
    }

    setSpeeds(live, speed) {
      const all = live ? [...SPEEDS, null] : [...SPEEDS];
      if (!all.includes(speed)) all.unshift(speed);
      const key = JSON.stringify([all, speed]);
      if (key === this.speedKey) return;
      this.speedKey = key;
      this.speed.replaceChildren(
        ...all.map((each) =>
          GNE.element("option", {
            value: each ?? "max",
            text: speedName(each),
            selected: each === speed,
          }),
        ),
      );
    }

    /** state: {playing, seekable, live, connected, time, end, speed} */
    show(state) {
      const { playing, seekable } = state;
      this.play.dataset.playing = playing;
      this.play.setAttribute("aria-label", playing ? "pause" : "play");
      this.play.title = playing ? "Pause (space)" : "Play (space)";
      const dead = !seekable && !state.connected;
      for (const id of ["play", "step", "speed"]) GNE.byId(id).disabled = dead;
      GNE.byId("back").disabled = !seekable;
      const restart = GNE.byId("restart");
      restart.disabled = state.live && !state.connected;
      restart.title = state.live ? "Restart the simulation (R)" : "To the start (R)";
      restart.setAttribute("aria-label", state.live ? "restart the simulation" : "to the start");
      this.setSpeeds(!seekable, state.speed);
      this.showTime(state);
    }

    showTime({ time, end, seekable }) {
      this.slider.disabled = !seekable;
      GNE.byId("time-track").title = seekable
        ? ""
        : "Time cannot be turned back while the simulation runs; it can when the run has ended.";
      if (Number(this.slider.max) !== end) this.slider.max = end;
      this.slider.value = time;
      this.slider.setAttribute("aria-valuetext", `${time.toFixed(2)} seconds of ${end}`);
      this.slider.style.setProperty("--done", `${end ? (100 * time) / end : 0}%`);
    }

    /** Marks along the slider: exits and interventions. */
    mark(marks, end) {
      this.marks.replaceChildren(
        ...marks.map(({ time, what, bad }) =>
          GNE.element("span", {
            class: bad ? "mark bad" : "mark",
            title: `${time.toFixed(2)} s: ${what}`,
            style: `left: ${(100 * time) / (end || 1)}%`,
          }),
        ),
      );
    }
  };

  /** Sliders and pushes of a live simulation. */
  GNE.Tuning = class {
    constructor(send) {
      this.send = send;
      this.panel = GNE.byId("tuning");
      this.body = GNE.byId("tuning-body");
      this.sliders = new Map();
    }

    build(meta) {
      this.sliders.clear();
      this.body.replaceChildren();
      const controls = meta.controls || [];
      const pushes = meta.pushes || [];
      this.panel.hidden = controls.length + pushes.length === 0;
      this.panel.open = innerWidth > 1000 && innerHeight > 600; // else the view needs the room
      for (const { name } of meta.systems) {
        const own = controls.filter((control) => control.system === name);
        const push = pushes.filter((each) => each.system === name);
        if (!own.length && !push.length) continue;
        const system = meta.systems.find((each) => each.name === name);
        this.body.append(
          GNE.element(
            "div",
            { class: "tuning-row", role: "group", "aria-label": name },
            GNE.element("h3", { text: name }),
            ...own.map((control) => this.slider(control)),
            ...push.map((each) => this.pushes(each, system)),
          ),
        );
      }
    }

    slider(control) {
      const { key, label, unit, min, max, scale, value } = control;
      const log = scale === "log" && min > 0;
      const toPlace = log
        ? (v) => Math.log(v / min) / Math.log(max / min)
        : (v) => (v - min) / (max - min);
      const fromPlace = log ? (p) => min * (max / min) ** p : (p) => min + (max - min) * p;
      const range = GNE.element("input", {
        type: "range",
        min: 0,
        max: 1,
        step: 0.002,
        "aria-label": label,
        title: key,
      });
      const number = GNE.element("input", {
        type: "number",
        min,
        max,
        step: "any",
        "aria-label": `${label}, as a number`,
      });
      const show = (v) => {
        range.value = toPlace(v);
        range.setAttribute("aria-valuetext", GNE.withUnit(v, unit));
        range.style.setProperty("--done", `${100 * toPlace(v)}%`);
        if (!typing) number.value = Number(v.toPrecision(3));
      };
      let typing = false;
      let touched = -Infinity;
      let held = value;
      const set = this.atMost(12, (v) => this.send({ do: "set", key, value: v }));
      range.oninput = () => {
        touched = performance.now();
        const v = Number(fromPlace(Number(range.value)).toPrecision(3));
        show((held = v));
        set(v);
      };
      number.oninput = () => (typing = true);
      number.onblur = () => {
        typing = false;
        show(held); // nothing, or half a number, was left there
      };
      number.onchange = () => {
        typing = false;
        const v = Number(number.value);
        if (number.value !== "" && Number.isFinite(v)) set((held = v));
      };
      show(value);
      let told;
      const follow = (v) => {
        held = v;
        // echoes of a moment ago must not pull the slider back under the hand
        clearTimeout(told);
        const wait = touched + 400 - performance.now();
        if (wait > 0) told = setTimeout(follow, wait, v);
        else show(v);
      };
      this.sliders.set(key, follow);
      return GNE.element(
        "div",
        { class: "control" },
        GNE.element("span", { class: "control-label", text: label }),
        range,
        number,
        GNE.element("span", { class: "unit", text: unit }),
      );
    }

    /** Calls at most so many times per second; the last value is never dropped. */
    atMost(perSecond, call) {
      let waiting = null;
      let latest;
      return (value) => {
        latest = value;
        waiting ??= setTimeout(() => {
          waiting = null;
          call(latest);
        }, 1000 / perSecond);
      };
    }

    pushes(push, system) {
      const force = GNE.withUnit(push.force, push.unit);
      const title = `Push with ${force} for ${GNE.number(push.duration)} s`;
      return GNE.element(
        "div",
        { class: "pushes", role: "group", "aria-label": title },
        GNE.element("p", { class: "small", text: title }),
        system.agents <= MOST_PUSHED ? this.pushList(push, system) : this.pushChoice(push, system),
      );
    }

    /** Buttons for each agent. */
    pushList(push, { agents, agent_name: noun }) {
      const list = GNE.element("div", { class: "push-list" });
      for (let agent = 1; agent <= agents; agent++) {
        const buttons = this.arrows(push, () => agent, `${noun} ${agent}`);
        const number = GNE.element("b", { text: agent });
        list.append(GNE.element("span", { class: "push-one" }, number, ...buttons));
      }
      return list;
    }

    /** Buttons for the agent that is chosen, when agents are many. */
    pushChoice(push, { agents, agent_name: noun }) {
      const select = GNE.element("select", { "aria-label": `${noun} to push` });
      for (let agent = 1; agent <= agents; agent++)
        select.append(GNE.element("option", { value: agent, text: `${noun} ${agent}` }));
      const buttons = this.arrows(push, () => Number(select.value), `the chosen ${noun}`);
      return GNE.element("span", { class: "push-one" }, select, ...buttons);
    }

    arrows({ system, axes, force }, agentOf, whom) {
      const arrow = (axis, k, sign) => {
        const what = `push ${whom} ${sign < 0 ? "against" : "along"} ${axis || "its axis"}`;
        return GNE.element("button", {
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

    follow(values) {
      for (const [key, value] of Object.entries(values)) this.sliders.get(key)?.(value);
    }
  };

  /** A sentence that goes away by itself; errors stay longer and are announced at once. */
  GNE.toast = (text, level = "info") => {
    const error = level === "error";
    const toast = GNE.element(
      "div",
      { class: `toast ${error ? "error" : ""}` },
      GNE.element("span", { "aria-hidden": true, text: error ? "⚠" : "ℹ" }),
      GNE.element("span", { text }),
    );
    const place = GNE.byId(error ? "alerts" : "notices");
    place.append(toast);
    while (place.children.length > 3) place.firstChild.remove();
    setTimeout(() => toast.remove(), error ? 12000 : 5000);
  };

  /** Keys by name; not while one types, nor where a key means something to the focused element. */
  GNE.keys = (actions) => {
    addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const { target } = event;
      const type = target.tagName === "INPUT" ? target.type : target.tagName;
      if (["number", "text", "SELECT", "TEXTAREA"].includes(type)) return;
      const steers =
        type === "range" && target.id !== "time-slider" && event.key.startsWith("Arrow");
      const separates =
        target.getAttribute("role") === "separator" && event.key.startsWith("Arrow");
      const presses = event.key === " " && ["BUTTON", "SUMMARY", "checkbox"].includes(type);
      if (steers || separates || presses || document.querySelector("dialog[open]")) return;
      const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!action) return;
      event.preventDefault();
      action(event);
    });
  };
})();
