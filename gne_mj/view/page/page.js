"use strict";
// The page: puts data, scene, plots and controls together; live, or as a replay.
(() => {
  const SLOW = 100; // ms between refreshes of texts and, live, of plots

  class Page {
    constructor() {
      this.settings = JSON.parse(GNE.byId("settings").textContent || "{}");
      this.mode = this.settings.mode || "served";
      this.time = 0;
      this.speed = 1;
      this.playing = false;
      this.framesReceived = 0;
      this.scene = new GNE.Scene(GNE.byId("pane"));
      this.overlay = new GNE.Overlay(GNE.byId("overlay"), this.scene);
      this.plots = new GNE.Plots(GNE.byId("plots"), {
        seek: (t) => this.seek(t),
        highlight: (which, plot) => this.highlight(which, plot),
      });
      this.transport = new GNE.Transport(this);
      this.wire();
      this.expose();
      this.start();
      requestAnimationFrame((now) => this.loop(now));
    }

    /** Time at which each system left the set, of those that did. */
    get exits() {
      return this.plots.exits;
    }

    set exits(exits) {
      this.plots.exits = exits;
    }

    get live() {
      return this.mode === "live";
    }

    /** Whether time is ours: a replay is shown. */
    get replaying() {
      return Boolean(this.replay);
    }

    // ---- where the data come from

    async start() {
      if (this.live) return this.startLive();
      try {
        const packed =
          this.mode === "file"
            ? GNE.fromBase64(GNE.byId("replay").textContent)
            : await this.fetchReplay();
        this.showReplay(GNE.decodePack(await GNE.inflate(packed)));
      } catch (error) {
        this.warn(`The replay cannot be read: ${error.message}`);
      }
    }

    async fetchReplay() {
      const answer = await fetch("replay");
      if (!answer.ok) throw new Error(`the server answered ${answer.status}`);
      return new Uint8Array(await answer.arrayBuffer());
    }

    showReplay(pack) {
      const { meta, arrays } = pack;
      this.runCommands(meta.command_lengths || [], arrays.commands?.data);
      this.setReplay(pack);
      this.takeOutcome();
      this.setScene(meta, this.replay);
      this.seek(this.replay.time[0]);
    }

    runCommands(lengths, bytes) {
      let at = 0;
      for (const length of lengths) {
        this.scene.command(bytes.slice(at, at + length));
        at += length;
      }
    }

    setReplay(pack) {
      this.replay = new GNE.Replay(pack);
      this.store = this.replay;
      this.plots.seekable = true;
    }

    startLive() {
      this.tuning = new GNE.Tuning((message) => this.link.send(message));
      this.link = new GNE.Live({
        opened: () => this.opened(),
        lost: (why) => this.lost(why),
        command: (bytes) => this.scene.command(bytes),
        pack: (pack) => this.receive(pack),
        message: (message) => this.hear(message),
      });
    }

    opened() {
      // another server may stand behind the address now
      if (this.meta) this.scene.clear();
      this.meta = this.instant = this.pending = null;
      GNE.byId("lost").hidden = true;
      this.connected = true;
    }

    lost(why) {
      GNE.byId("lost").hidden = false;
      GNE.byId("lost-text").textContent = why;
      this.connected = false;
      if (!this.replaying) this.playing = false;
      this.slowDue = 0;
    }

    receive(pack) {
      const { kind } = pack.meta;
      if (kind === "scene") {
        this.endReplay();
        this.exits = {};
        this.setScene(pack.meta, new GNE.History(pack.meta.systems));
        this.tuning.build(pack.meta);
      } else if (kind === "history" && this.store) {
        this.history.fill(pack);
        this.plotsDue = true;
      } else if (kind === "frame" && this.meta) this.takeFrame(pack);
    }

    takeFrame(pack) {
      this.framesReceived++;
      const { meta } = pack;
      this.frame = meta;
      if (meta.ended) this.runEnded();
      else this.endReplay();
      if (this.replaying) return;
      const instant = GNE.instantOfFrame(pack, this.meta.systems);
      if (instant.time < this.time) this.exits = {};
      this.noteExits(meta);
      this.playing = meta.playing;
      this.speed = meta.speed;
      this.history.push(instant);
      this.time = instant.time;
      this.pending = instant;
      this.plotsDue = true;
      const now = performance.now();
      for (const system of this.meta.systems)
        this.overlay.messages(system, instant.systems[system.name].messages, now);
    }

    noteExits(meta) {
      for (const [name, state] of Object.entries(meta.state))
        if (GNE.outside(state.status)) this.exits[name] ??= state.exit_time ?? meta.time;
        else delete this.exits[name];
    }

    /** A run has ended: it can be replayed now. */
    async runEnded() {
      if (this.fetching || this.replaying) return;
      this.fetching = true;
      try {
        const pack = GNE.decodePack(await GNE.inflate(await this.fetchReplay()));
        if (!this.frame.ended) return; // restarted meanwhile
        this.setReplay(pack);
        this.playing = false;
        this.speed = Number.isFinite(this.speed) && this.speed !== null ? this.speed : 1;
        this.takeOutcome();
        this.plots.setStore(this.replay);
        this.seek(this.replay.end);
      } catch (error) {
        GNE.toast(`The run has ended, but its replay could not be had: ${error.message}`, "error");
      } finally {
        // not asked for again at every frame, should it have failed
        this.fetching = this.frame.ended && !this.replaying;
      }
    }

    endReplay() {
      this.fetching = false;
      if (!this.replaying || !this.live) return;
      this.replay = null;
      this.exits = {};
      this.store = this.history;
      this.history.clear();
      this.time = 0;
      this.plots.seekable = false;
      this.plots.interventions = [];
      this.plots.setStore(this.history);
      this.transport.mark([], 1);
    }

    hear(message) {
      if (message.kind === "notice") GNE.toast(message.text, message.level);
      else if (message.kind === "controls") this.tuning.follow(message.values);
      else if (message.kind === "interventions") this.plots.interventions = message.done;
    }

    // ---- a scene

    setScene(meta, store) {
      this.meta = meta;
      this.store = store;
      if (this.live) this.history = store;
      document.title = `${meta.title} · gne_mj`;
      GNE.byId("title").textContent = meta.title;
      GNE.byId("waiting").hidden = true;
      this.scene.setMeta(meta);
      this.overlay.setMeta(meta);
      this.plots.setScene(meta, store);
      this.fillFollow();
      this.fillGhosts();
      this.describeLinks();
    }

    /** Exits and interventions of a replay, marked in plots and along the slider. */
    takeOutcome() {
      const { outcome, interventions } = this.replay.meta;
      const exits = Object.entries(outcome || {}).filter(([, each]) =>
        Number.isFinite(each.exit_time),
      );
      this.exits = Object.fromEntries(exits.map(([name, each]) => [name, each.exit_time]));
      this.plots.interventions = interventions || [];
      const marks = exits.map(([name, { exit_time: time }]) => ({
        time,
        what: `${name} left the set`,
        bad: true,
      }));
      this.transport.mark([...this.plots.interventions, ...marks], this.replay.end);
    }

    fillFollow() {
      const option = (value, text) => GNE.element("option", { value, text });
      const { fleets } = this.scene;
      GNE.byId("follow-label").hidden = fleets.length === 0;
      GNE.byId("follow").replaceChildren(
        option("fleet", "all"),
        ...fleets.flatMap((system) =>
          [...Array(system.agents).keys()].map((agent) =>
            option(
              JSON.stringify({ system: system.name, agent }),
              `${system.agent_name} ${agent + 1}`,
            ),
          ),
        ),
        option("none", "nothing"),
      );
    }

    fillGhosts() {
      const systems = this.meta.systems.filter((system) => system.estimates);
      GNE.byId("ghost-tools").hidden = systems.length === 0;
      GNE.byId("ghost-agent").replaceChildren(
        ...systems.map((system) =>
          GNE.element(
            "optgroup",
            { label: system.name },
            ...[...Array(system.agents).keys()].map((agent) =>
              GNE.element("option", {
                value: JSON.stringify({ system: system.name, agent }),
                text: `${system.agent_name} ${agent + 1}`,
              }),
            ),
          ),
        ),
      );
      this.setGhosts(false);
    }

    describeLinks() {
      const linked = this.meta.systems.filter((system) => system.edges.length > 0);
      const button = GNE.byId("links");
      button.hidden = linked.length === 0;
      const words = new Set(linked.map((system) => system.edges_are));
      const parts = [];
      if (words.has("messages")) parts.push("lines: messages pass");
      if (words.has("measurements")) parts.push("dashed lines: measured directly");
      if (linked.some((system) => system.links.length && system.message_period !== null))
        parts.push("✕ lost");
      const note = GNE.byId("link-note");
      note.textContent = parts.join(" · ");
      note.hidden = parts.length === 0;
    }

    setGhosts(on) {
      const select = GNE.byId("ghost-agent");
      const shown = on && select.value ? JSON.parse(select.value) : null;
      GNE.byId("ghosts").setAttribute("aria-pressed", Boolean(shown));
      GNE.byId("ghost-label").hidden = !shown;
      const note = GNE.byId("ghost-note");
      note.hidden = !shown;
      if (shown) note.textContent = this.ghostNote(shown);
      this.scene.ghosts.show(shown);
    }

    ghostNote({ system: name, agent }) {
      const system = this.meta.systems.find((each) => each.name === name);
      const who = `${system.agent_name} ${agent + 1}`;
      if (system.drawn_as === "bars")
        return `Outlines: the other ${system.action.name}s as ${who} takes them to be.`;
      const wrong = `(estimate − actual ${system.action.name})`;
      return `Pale copies: the others as ${who} takes them to be, displaced by ${wrong} × 1 s.`;
    }

    highlight(which, plot) {
      this.overlay.highlighted = which;
      this.plots.highlight(which, plot);
      this.scene.dirty();
    }

    warn(text) {
      GNE.byId("banner-text").textContent = text;
      GNE.byId("banner").hidden = false;
      GNE.byId("waiting").hidden = true;
    }

    // ---- transport

    playPause() {
      if (!this.replaying) return this.command({ do: this.playing ? "pause" : "play" });
      if (!this.playing && this.time >= this.replay.end) this.seek(this.replay.time[0]);
      this.playing = !this.playing;
      this.slowDue = 0;
    }

    step(direction, second) {
      if (!this.replaying) {
        if (direction > 0) this.command({ do: "step" });
        return;
      }
      this.playing = false;
      if (second) return this.seek(this.time + direction);
      const { time } = this.replay;
      const { i, f } = this.replay.at(this.time);
      const to = direction > 0 ? i + 1 : f > 0 ? i : i - 1;
      this.seek(time[Math.min(Math.max(to, 0), time.length - 1)], direction > 0);
    }

    restart() {
      if (this.live) return this.command({ do: "restart" });
      if (this.replaying) this.seek(this.replay.time[0]);
    }

    setSpeed(speed) {
      if (this.replaying) this.speed = speed;
      else this.command({ do: "speed", value: speed });
      this.slowDue = 0;
    }

    command(message) {
      if (this.live) this.link.send(message);
    }

    /** Shows a time of the replay; messages since then pass if it is a step on. */
    seek(t, withMessages = false) {
      if (!this.replaying) return;
      const before = this.time;
      const { time, end } = this.replay;
      this.time = Math.min(Math.max(t, time[0]), end);
      this.pending = this.replay.instant(this.time);
      if (!withMessages) return;
      const now = performance.now();
      for (const system of this.meta.systems)
        this.overlay.messages(
          system,
          this.replay.messagesBetween(system.name, before, this.time),
          now,
        );
    }

    // ---- pictures

    loop(now) {
      requestAnimationFrame((next) => this.loop(next));
      const passed = Math.min(now - (this.before ?? now), 250) / 1000;
      this.before = now;
      this.watchPace(passed);
      if (this.replaying && this.playing) this.playOn(passed);
      if (!this.meta) return;
      this.flow(now);
      this.draw(now);
      if (now >= (this.slowDue ?? 0)) this.slow(now);
    }

    watchPace(passed) {
      if (!this.playing) {
        this.usual = 0.016;
        return this.scene.setQuality(1);
      }
      this.usual += 0.1 * (passed - this.usual);
      if (this.usual > 0.05) this.scene.setQuality(0.6);
    }

    playOn(passed) {
      this.seek(this.time + passed * this.speed, true);
      if (this.time >= this.replay.end) this.playing = false;
    }

    flow(now) {
      if (!this.playing) return;
      for (const system of this.meta.systems)
        if (system.links.length && system.message_period === null) this.overlay.flow(system, now);
    }

    draw(now) {
      if (this.pending) {
        this.instant = this.pending;
        this.pending = null;
        this.scene.apply(this.instant, this.store);
        this.plots.setTime(this.instant.time);
      } else if (this.instant && this.scene.stale) this.scene.apply(this.instant, this.store);
      if (!this.instant) return;
      const render = this.scene.needsRender;
      if (render) this.scene.render();
      if (render || this.overlay.moving || this.wasMoving) this.overlay.draw(this.instant, now);
      this.wasMoving = this.overlay.moving;
      window.gne.ready = true;
    }

    /** What need not be fresh at every picture. */
    slow(now) {
      const began = performance.now();
      if (this.plotsDue) {
        this.plotsDue = false;
        this.plots.refresh();
      } else this.plots.writeValues();
      this.showHeader();
      this.showBanner();
      this.showLegend();
      this.showTransport();
      // slow plots must not take more than a sixth of the time
      this.slowDue = now + Math.max(SLOW, 6 * (performance.now() - began));
    }

    showLegend() {
      const shares = Object.values(this.instant?.systems || {}).map((own) => own.share || [NaN]);
      GNE.byId("unknown").hidden = !shares.some((share) => share.some(Number.isNaN));
    }

    showTransport() {
      const { replaying } = this;
      this.transport.show({
        playing: this.playing,
        seekable: replaying,
        live: this.live,
        connected: Boolean(this.connected),
        time: this.time,
        end: replaying ? this.replay.end : this.meta.duration,
        speed: this.speed,
      });
    }

    // ---- header

    showHeader() {
      GNE.byId("time").textContent = this.time.toFixed(2);
      GNE.byId("duration").textContent = GNE.number(this.meta.duration, 6);
      GNE.byId("pace").textContent = this.pace();
      const key = JSON.stringify(this.meta.systems.map((system) => this.stateOf(system)));
      if (key === this.chipKey) return;
      this.chipKey = key;
      GNE.byId("chips").replaceChildren(...this.meta.systems.map((system) => this.chip(system)));
      this.announce();
    }

    /** Tells a screen reader of changes of status; margins change too often for that. */
    announce() {
      const words = this.meta.systems.map(
        (system) => `${system.name}: ${GNE.status(this.stateOf(system).status).words}`,
      );
      const text = words.join(", ");
      const place = GNE.byId("announcement");
      if (place.textContent !== text) place.textContent = text;
    }

    pace() {
      if (!this.live || this.replaying || !this.frame)
        return this.live && this.replaying ? "ended; replay" : "";
      if (!this.connected) return "not connected";
      if (!this.playing) return "paused";
      const { speed, pace } = this.frame;
      const wished = speed === null ? "as fast as possible" : `×${GNE.number(speed)}`;
      return Number.isFinite(pace) ? `${wished}, ${GNE.number(pace)} reached` : wished;
    }

    /** {status, message, margin, margin_name, margin_time} of a system, as of now. */
    stateOf({ name }) {
      if (!this.replaying) return this.frame?.state[name] || { status: "waiting" };
      // of the whole run, also while an earlier time is shown
      return this.replay.meta.outcome?.[name] || { status: "" };
    }

    chip(system) {
      const state = this.stateOf(system);
      const { kind, symbol, words } = GNE.status(state.status);
      const about = [
        system.game,
        `${system.agents} ${system.agent_name}s`,
        `information: ${system.information}`,
        `mode: ${system.mode}`,
        `engine: ${system.engine}`,
      ];
      return GNE.element(
        "div",
        {
          class: `chip ${kind}`,
          title: [state.message, about.join(" · ")].filter(Boolean).join("\n"),
        },
        GNE.element("span", { class: "sign", "aria-hidden": true, text: symbol }),
        GNE.element("span", {}, GNE.element("b", { text: system.name }), `: ${words}`),
        GNE.element("span", { class: "margin", text: this.marginText(state) }),
      );
    }

    marginText({ margin, margin_name: name, margin_time: time }) {
      if (!Number.isFinite(margin)) return "no margin known";
      const when = Number.isFinite(time) ? ` at ${GNE.fixed(time, time < 10 ? 2 : 1)} s` : "";
      const of = this.replaying ? "the run's least margin" : "least margin so far";
      return `${of} ${GNE.number(margin)}${name ? ` · ${name}` : ""}${when}`;
    }

    showBanner() {
      const out = this.meta.systems.filter((system) => GNE.outside(this.stateOf(system).status));
      const banner = GNE.byId("banner");
      const text = out.map((system) => this.exitText(system)).join("   ");
      GNE.byId("banner-show").hidden =
        !this.replaying || !Number.isFinite(this.exits[out[0]?.name]);
      if (text === this.bannerText) return; // closed, perhaps
      this.bannerText = text;
      banner.hidden = !text;
      GNE.byId("banner-text").textContent = text;
    }

    exitText(system) {
      const { status, message } = this.stateOf(system);
      const at = this.exits[system.name];
      const when = Number.isFinite(at) ? ` at ${GNE.number(at, 4)} s` : "";
      return `${system.name}: ${GNE.status(status).words}${when}${message ? `: ${message}` : ""}`;
    }

    // ---- wiring

    wire() {
      const press = (id, action) => GNE.byId(id).addEventListener("click", action);
      const toggle = (id, what) => {
        this.overlay.show[what] = !this.overlay.show[what];
        GNE.byId(id).setAttribute("aria-pressed", this.overlay.show[what]);
        this.scene.dirty();
      };
      const ghostsOn = () => GNE.byId("ghosts").getAttribute("aria-pressed") === "true";
      const actions = {
        " ": () => this.playPause(),
        ArrowRight: ({ shiftKey }) => this.step(1, shiftKey),
        ArrowLeft: ({ shiftKey }) => this.step(-1, shiftKey),
        r: () => this.restart(),
        f: () => this.scene.fit(),
        l: () => toggle("labels", "labels"),
        c: () => toggle("links", "links"),
        g: () => this.scene.ghosts && this.setGhosts(!ghostsOn()),
        p: () => this.fold(),
        d: () => this.switchTheme(),
        "?": () => GNE.byId("help").showModal(),
        "[": () => this.scene.nudge(-6, 1),
        "]": () => this.scene.nudge(6, 1),
        "+": () => this.scene.nudge(0, 0.88),
        "=": () => this.scene.nudge(0, 0.88),
        "-": () => this.scene.nudge(0, 1.14),
      };
      GNE.keys(actions);
      press("fit", actions.f);
      press("labels", actions.l);
      press("links", actions.c);
      press("ghosts", actions.g);
      press("fold", actions.p);
      press("theme", actions.d);
      press("help-open", actions["?"]);
      press("banner-close", () => (GNE.byId("banner").hidden = true));
      press("banner-show", () => this.seek(Math.min(...Object.values(this.exits))));
      GNE.byId("ghost-agent").onchange = () => this.setGhosts(true);
      GNE.byId("follow").onchange = (event) => this.setFollow(event.target.value);
      GNE.byId("ramp").style.background = GNE.rampGradient();
      this.wirePane();
      this.wireDivider();
      // what was pressed by mouse does not keep the keys: space is to play and pause
      const release = ({ target }) => {
        const pressed = target.closest?.("button, summary, select");
        if (pressed && !pressed.matches(":focus-visible")) pressed.blur();
      };
      document.addEventListener("change", release);
      document.addEventListener("click", (event) => {
        if (!event.target.closest("select")) release(event);
      });
    }

    setFollow(value) {
      if (value === "fleet" || value === "none") this.scene.setFollow({ kind: value });
      else this.scene.setFollow({ kind: "agent", ...JSON.parse(value) });
    }

    wirePane() {
      const pane = GNE.byId("pane");
      const near = (event) => {
        const box = pane.getBoundingClientRect();
        return this.overlay.agentNear(event.clientX - box.left, event.clientY - box.top);
      };
      pane.addEventListener("mousemove", (event) => {
        if (event.buttons) return;
        const which = near(event);
        if (JSON.stringify(which) !== JSON.stringify(this.overlay.highlighted))
          this.highlight(which);
      });
      pane.addEventListener("mouseleave", () => this.highlight(null));
      pane.addEventListener("dblclick", (event) => {
        const which = near(event);
        const value = which && JSON.stringify(which);
        const select = GNE.byId("follow");
        if (![...select.options].some((option) => option.value === value)) return;
        select.value = value;
        this.setFollow(value);
      });
    }

    wireDivider() {
      const divider = GNE.byId("divider");
      const set = (width) => {
        const fitting = Math.round(Math.min(Math.max(width, 280), innerWidth - 380));
        document.documentElement.style.setProperty("--plots", `${fitting}px`);
        divider.setAttribute("aria-valuenow", fitting);
      };
      divider.addEventListener("pointerdown", (event) =>
        divider.setPointerCapture(event.pointerId),
      );
      divider.addEventListener("pointermove", (event) => {
        if (divider.hasPointerCapture(event.pointerId)) set(innerWidth - event.clientX);
      });
      divider.addEventListener("dblclick", () => this.fold());
      divider.addEventListener("keydown", ({ key }) => {
        const now = GNE.byId("plots").clientWidth;
        if (key === "ArrowLeft") set(now + 24);
        if (key === "ArrowRight") set(now - 24);
      });
    }

    fold() {
      const folded = document.body.classList.toggle("folded");
      GNE.byId("fold").setAttribute("aria-pressed", !folded);
    }

    switchTheme() {
      GNE.setTheme(GNE.theme() === "dark" ? "light" : "dark");
      this.scene.restyle();
      this.plots.restyle();
    }

    // ---- for tests

    expose() {
      const page = this;
      window.gne = {
        ready: false,
        mode: this.mode,
        time: () => page.time,
        seek: (t) => {
          page.seek(t);
          page.draw(performance.now());
        },
        play: () => page.playing || page.playPause(),
        pause: () => page.playing && page.playPause(),
        position: (item) => page.scene.position(item),
        tint: (agentIndex, systemName) => page.tint(agentIndex, systemName),
        get plots() {
          return page.plots.describe();
        },
        get framesReceived() {
          return page.framesReceived;
        },
        state: () => page.describe(),
      };
    }

    /** CSS colour of an agent (from 0) as it is drawn. */
    tint(agent, name) {
      const bars = this.scene.bars.find(({ system }) => system.name === name);
      const drawn = bars
        ? bars.bars[bars.system.action.owner.indexOf(agent + 1)]
        : this.scene.tinted?.get(name)?.[agent]?.[0];
      return drawn ? GNE.css(drawn.material.color.toArray()) : null;
    }

    describe() {
      const systems = this.meta?.systems || [];
      return {
        mode: this.mode,
        time: this.time,
        playing: this.playing,
        speed: this.speed,
        replaying: this.replaying,
        connected: Boolean(this.connected),
        theme: GNE.theme(),
        exits: { ...this.exits },
        systems: Object.fromEntries(systems.map((s) => [s.name, this.stateOf(s)])),
        controls: [...(this.tuning?.sliders.keys() || [])],
        interventions: this.plots.interventions,
        pulses: this.overlay.pulses.length,
        following: this.scene.following,
        follow: this.scene.follow,
        ghosts: this.scene.ghosts?.shown ?? null,
      };
    }
  }

  GNE.page = new Page();
})();
