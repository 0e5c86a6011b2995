// Built by scripts/page from page/src
"use strict";
(() => {
  // src/dom.js
  var byId = (id) => (
    /** @type {Elements[Id]} */
    document.getElementById(id)
  );
  var element = (tag, attributes = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (value === void 0 || value === null || value === false) continue;
      if (name === "text") made.textContent = value;
      else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
      else if (name.startsWith("aria-")) made.setAttribute(name, String(value));
      else made.setAttribute(name, value === true ? "" : value);
    }
    made.append(...children.filter((child) => child !== null && child !== void 0));
    return made;
  };
  var press = (button, pressed) => button.setAttribute("aria-pressed", String(pressed));

  // src/theme.js
  var KEY = "gne_mj.theme";
  var colours = /* @__PURE__ */ new Map();
  var remembered = () => {
    try {
      return localStorage.getItem(KEY);
    } catch {
      return null;
    }
  };
  var theme = () => document.documentElement.dataset.theme === "dark" ? "dark" : "light";
  var setTheme = (name, remember = true) => {
    document.documentElement.dataset.theme = name;
    colours.clear();
    if (!remember) return;
    try {
      localStorage.setItem(KEY, name);
    } catch {
    }
  };
  var colour = (name) => {
    if (!colours.has(name)) {
      const style = getComputedStyle(document.documentElement);
      colours.set(name, style.getPropertyValue(`--${name}`).trim());
    }
    return colours.get(name);
  };
  var still = matchMedia("(prefers-reduced-motion: reduce)");
  var reducedMotion = () => still.matches;
  var light = matchMedia("(prefers-color-scheme: light)").matches;
  setTheme(remembered() || (light ? "light" : "dark"), false);

  // src/colours.js
  var RAMP = [
    [0, [0.16, 0.38, 0.83]],
    [0.4, [0.36, 0.66, 0.9]],
    [0.56, [0.66, 0.84, 0.83]],
    [0.72, [0.97, 0.85, 0.3]],
    [0.9, [0.96, 0.55, 0.12]],
    [1, [0.88, 0.27, 0.08]]
  ];
  var OUTSIDE = [0.86, 0.02, 0.16];
  var UNKNOWN = [0.55, 0.58, 0.62];
  var ramp = (share) => {
    if (share === null || Number.isNaN(share)) return UNKNOWN;
    if (share > 1) return OUTSIDE;
    const above = RAMP.findIndex(([stop]) => share <= stop);
    if (above <= 0) return RAMP[0][1];
    const [[from, a], [to, b]] = [RAMP[above - 1], RAMP[above]];
    return a.map((v, k) => v + (b[k] - v) * (share - from) / (to - from));
  };
  var css = (rgb) => `rgb(${rgb.map((v) => Math.round(255 * v)).join(", ")})`;
  var rampGradient = () => `linear-gradient(to right, ${RAMP.map(([s, c]) => `${css(c)} ${100 * s}%`).join(", ")})`;
  var LINES = {
    dark: ["#56b4e9", "#e69f00", "#2fc18c", "#f0e442", "#e87c3a", "#d98cbb", "#f2f2f2", "#5a9bff"],
    light: ["#0072b2", "#c07c00", "#00805c", "#8c7a00", "#d55e00", "#a8518a", "#111111", "#2f62c9"]
  };
  var DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3], [12, 5]];
  var dashOf = (run) => DASHES[run];
  var line = (k) => {
    const colours2 = LINES[theme()];
    return {
      colour: colours2[k % colours2.length],
      dash: DASHES[Math.floor(k / colours2.length) % DASHES.length]
    };
  };

  // src/handle.js
  var handleOf = (page2) => ({
    /** Whether something has been drawn. */
    get ready() {
      return page2.drawn;
    },
    /** Simulated time that is shown, s. */
    time: () => page2.source?.time ?? 0,
    /** Shows a time of a replay, at once. */
    seek(time) {
      page2.seek(time);
      if (page2.source) page2.draw(page2.source, performance.now());
    },
    /** Shows a stretch of time in the plots, s. */
    show: (from, to) => page2.plots.show([from, to]),
    /** How fast a replay plays, times real time. */
    speed: (speed) => page2.setSpeed(speed),
    /** Where the scene graph has an object, in MuJoCo's coordinates, by its path in meshcat. */
    position: (path) => page2.scene.position(path),
    /** CSS colour of an agent (from 0) as it is drawn. */
    tint: (agent, system) => tintOf(page2, agent, system),
    /** What lies on the ground under a system's robots: outputs, the region's middle, strips. */
    plan: (system) => planOf(page2, system),
    /** How each system is drawn, beside those of other runs or over them. */
    compared: () => comparedOf(page2),
    /** What is plotted. */
    get plots() {
      return page2.plots.describe();
    },
    get framesReceived() {
      return page2.live?.framesReceived ?? 0;
    },
    /** How far the camera is, in distances at which all fits. */
    zoom: () => page2.scene.camera.zoom,
    /** Whether the 3-D view has a context, and a picture. */
    alive: () => isAlive(page2),
    /** What the page is doing. */
    state: () => stateOf(page2)
  });
  var tintOf = ({ scene }, agent, name) => {
    const bars2 = scene.bars.find(({ system }) => system.name === name);
    const drawn = bars2 ? bars2.bars[bars2.system.action.owner.indexOf(agent + 1)] : scene.tinted.get(name)?.[agent]?.[0];
    return drawn ? css(drawn.material.color.toArray()) : null;
  };
  var planOf = ({ scene }, name) => {
    const plan = scene.plans.find(({ system }) => system.name === name);
    if (!plan) return null;
    const place = (object) => object.position.toArray().slice(0, 2);
    return {
      outputs: plan.marks.map(place),
      region: plan.region && place(plan.region.edge),
      strips: plan.distances.map(({ strip }) => css(strip.material.color.toArray())),
      discs: plan.discs.map((disc) => disc && disc.geometry.parameters.outerRadius)
    };
  };
  var isAlive = ({ scene }) => {
    const gl = scene.viewer.renderer.getContext();
    if (gl.isContextLost()) return false;
    scene.camera.render();
    const { drawingBufferWidth: w, drawingBufferHeight: h } = gl;
    const pixels = new Uint8Array(4 * w * h);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return new Set(new Uint32Array(pixels.buffer)).size > 16;
  };
  var comparedOf = ({ meta, scene }) => (meta?.systems ?? []).map(({ name, items: [first], drawn_as: as, shown: shown2 }) => {
    const object = as === "fleet" ? scene.objects[first] : scene.bars.find(({ system }) => system.name === name)?.group;
    let opacity = 1;
    object?.traverse(({ material }) => {
      if (material?.color) opacity = Math.min(opacity, material.opacity);
    });
    return { name, opacity, visible: object?.visible ?? false, offset: shown2.offset };
  });
  var stateOf = ({ meta, mode: mode2, live, overlay, playback, scene, source, tuning }) => ({
    mode: mode2,
    replaying: playback !== null,
    connected: live?.connected ?? false,
    theme: theme(),
    controls: [...tuning?.sliders.keys() ?? []],
    pulses: overlay.links.pulses.length,
    following: scene.camera.following,
    follow: scene.camera.follow,
    ghosts: scene.ghosts.shown,
    ...meta && source && shownOf(meta, source)
  });
  var shownOf = (meta, source) => ({
    time: source.time,
    playing: source.playing,
    speed: source.speed,
    exits: source.exits,
    interventions: source.interventions,
    systems: Object.fromEntries(meta.systems.map((each) => [each.name, source.stateOf(each)]))
  });

  // src/export.js
  var DIGITS = 9;
  var download = (name, blob) => {
    const url = URL.createObjectURL(blob);
    element("a", { href: url, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1e4);
  };
  var fileOf = ({ spec }) => [spec.whose, spec.name, spec.axis].filter(Boolean).join("-").replace(/[^\w-]+/g, "_");
  var quoted = (text2) => /[",\n]/.test(text2) ? `"${text2.replaceAll('"', '""')}"` : text2;
  var csvOf = (plot) => {
    const { spec, plots } = plot;
    const [from, to] = plots.window;
    const { time } = plots.source.store;
    const columns = plot.columns();
    const { on: on2 } = plot.lines;
    const unit = spec.unit ? ` (${spec.unit})` : "";
    const names = on2.map((k) => quoted(plot.lines.nameOf(k) + unit));
    const rows = [["time (s)", ...names].join(",")];
    time.forEach((t, i) => {
      if (t < from || t > to) return;
      const values = on2.map((k) => columns[k][i]);
      const texts = [t, ...values].map((v) => v === null ? "" : Number(v.toPrecision(DIGITS)));
      rows.push(texts.join(","));
    });
    return [...rows, ""].join("\n");
  };
  var saveCsv = (plot) => download(`${fileOf(plot)}.csv`, new Blob([csvOf(plot)], { type: "text/csv" }));
  var pictureOf = (plot) => {
    const { lines, uplot, spec } = plot;
    if (!uplot) return null;
    const chart = uplot.ctx.canvas;
    const ratio = chart.width / uplot.width;
    const { on: on2 } = lines;
    const several = spec.systems.length > 1;
    const wide = several ? 230 : 110;
    const perRow = Math.max(1, Math.floor(uplot.width / wide));
    const key = on2.length > 14 || spec.total === 1 && !several ? [] : on2;
    const [above, below] = [26, 8 + 18 * Math.ceil(key.length / perRow)];
    const canvas = element("canvas", {
      width: chart.width,
      height: chart.height + ratio * (above + below)
    });
    const context = (
      /** @type {CanvasRenderingContext2D} */
      canvas.getContext("2d")
    );
    context.fillStyle = colour("panel");
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(chart, 0, ratio * above);
    context.scale(ratio, ratio);
    context.textBaseline = "middle";
    context.fillStyle = colour("text");
    context.font = "600 14px system-ui, sans-serif";
    context.fillText([spec.whose, spec.title].filter(Boolean).join(": "), 8, above / 2);
    context.font = "12px system-ui, sans-serif";
    key.forEach((k, n) => {
      const look = lines.lookOf(k);
      const x = 8 + wide * (n % perRow);
      const y = above + uplot.height + 12 + 18 * Math.floor(n / perRow);
      Object.assign(context, { strokeStyle: look.colour, lineWidth: 2 });
      context.setLineDash(look.dash);
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + 20, y);
      context.stroke();
      context.fillText(lines.shortOf(k), x + 26, y, wide - 30);
    });
    return canvas;
  };
  var savePng = (plot) => pictureOf(plot)?.toBlob((blob) => blob && download(`${fileOf(plot)}.png`, blob));

  // src/caption.js
  var symbolOf = (tex) => {
    const plain = tex.replace(/\\(lVert|rVert|Vert|\|)/g, "‖").replace(/\\(left|right|,|;|mathrm|text)/g, "").replace(/-/g, "−");
    if (!plain || /[\\^]/.test(plain)) return null;
    const made = element("span", { class: "symbol" });
    for (const [, sub, one, other] of plain.matchAll(/_\{([^}]*)\}|_(\w)|([^_]+)/g))
      made.append(other ?? element("sub", { text: sub ?? one }));
    return made;
  };
  var captionOf = (plot) => {
    const { spec } = plot;
    const what = `${spec.whose} ${spec.title}`.trim();
    const tool = (text2, title, act) => element("button", { type: "button", text: text2, title, "aria-label": `${title}: ${what}`, onclick: act });
    const log = tool("log", "Logarithmic scale", () => {
      plot.setLogarithmic(!plot.look.log);
      press(log, plot.look.log);
    });
    press(log, plot.look.log);
    log.className = "toggle";
    return element(
      "figcaption",
      {},
      element("span", { class: "plot-system", text: spec.whose }),
      element("span", { class: "plot-title", text: spec.title }),
      symbolOf(spec.symbol),
      element(
        "span",
        { class: "plot-tools" },
        log,
        tool("CSV", "Save the numbers that are shown", () => saveCsv(plot)),
        tool("PNG", "Save the picture", () => savePng(plot))
      )
    );
  };
  var swatchOf = (look) => {
    const made = element("canvas", { class: "swatch", width: 28, height: 6, "aria-hidden": true });
    const context = (
      /** @type {CanvasRenderingContext2D} */
      made.getContext("2d")
    );
    Object.assign(context, { strokeStyle: look.colour, lineWidth: 5 });
    context.setLineDash(look.dash.map((length) => 1.6 * length));
    context.moveTo(0, 3);
    context.lineTo(28, 3);
    context.stroke();
    return made;
  };

  // src/words.js
  var number = (value, digits = 3) => {
    if (value === null || value === void 0 || Number.isNaN(value)) return "–";
    const size = Math.abs(value);
    let text2;
    if (size !== 0 && (size < 1e-3 || size >= 1e5)) text2 = value.toExponential(digits - 1);
    else text2 = String(Number(value.toPrecision(digits)));
    return text2.replace("-", "−").replace("e+", "e");
  };
  var fixed = (value, decimals2) => value === null || Number.isNaN(value) ? "–" : value.toFixed(decimals2).replace(/^-(?=[0.]*$)/, "").replace("-", "−");
  var decimals = (greatest) => greatest > 0 ? Math.min(Math.max(2 - Math.floor(Math.log10(greatest)), 0), 8) : 2;
  var withUnit = (value, unit) => number(value) + (unit ? ` ${unit}` : "");
  var SYMBOLS = { ok: "✓", going: "▸", bad: "⚠", unknown: "?" };
  var status = (word) => {
    let kind = "unknown";
    if (/^(converged|completed)$/.test(word)) kind = "ok";
    else if (/left|outside|diverged|too_small/.test(word)) kind = "bad";
    else if (word === "running") kind = "going";
    return { kind, symbol: SYMBOLS[kind], words: String(word || "unknown").replaceAll("_", " ") };
  };
  var outside = (word) => status(word).kind === "bad";

  // src/compare.js
  var BELOW = 0.7;
  var isSolid = ({ shown: shown2 }) => !shown2.faint && !shown2.off;
  var offsetOf = ({ shift, beside }, ghosts) => ghosts ? shift : [shift[0] + beside[0], shift[1] + beside[1]];
  var Comparison = class {
    /** @param {Page} page */
    constructor(page2) {
      this.page = page2;
      this.hidden = page2.plots.hiddenRuns;
      this.ghosts = false;
      this.meta = null;
      byId("compare").onchange = () => this.setGhosts(byId("compare").value === "ghosts");
    }
    /** @returns {Run[]} none where there is only one */
    get runs() {
      return this.meta?.runs ?? [];
    }
    /** @param {Scene} meta */
    setMeta(meta) {
      this.meta = meta;
      this.hidden.clear();
      this.arrange();
      byId("compare-label").hidden = !meta.runs;
      this.page.plots.runs.replaceChildren(...this.runs.map((run, k) => this.keyOf(run, k)));
      this.restyle();
    }
    /** Where each system is drawn, and how. */
    arrange() {
      const systems = this.meta?.systems ?? [];
      const first = systems.find(({ run }) => !this.hidden.has(run))?.run ?? 0;
      for (const system of systems) {
        const alike = systems.filter((each) => this.comparedBy(each) === this.comparedBy(system));
        const off2 = this.hidden.has(system.run);
        const faint = this.ghosts && !off2 && system.run !== first;
        system.shown = {
          offset: offsetOf(system, this.ghosts),
          faint,
          off: off2,
          over: faint && alike.find(({ run }) => run === first) || null,
          alike: alike.map(({ name }) => name)
        };
      }
    }
    /**
     * What systems of several runs have in common.
     * @param {System} system
     */
    comparedBy({ name, run }) {
      return this.runs[run]?.systems[name] ?? name;
    }
    /** @param {boolean} ghosts */
    setGhosts(ghosts) {
      this.ghosts = ghosts;
      byId("compare").value = ghosts ? "ghosts" : "beside";
      this.changed();
    }
    toggle() {
      if (this.runs.length) this.setGhosts(!this.ghosts);
    }
    /** @param {number} run */
    toggleRun(run) {
      if (!this.hidden.delete(run)) this.hidden.add(run);
      this.restyle();
      this.page.plots.showLines();
      this.changed();
    }
    changed() {
      const { scene, source } = this.page;
      this.arrange();
      this.tell();
      scene.stale = true;
      source?.seek(source.time);
    }
    /** Keys of runs in the theme's colours. */
    restyle() {
      [...this.page.plots.runs.children].forEach((key, run) => {
        key.querySelector("canvas")?.replaceWith(this.swatch(run));
        press(
          /** @type {HTMLElement} */
          key,
          !this.hidden.has(run)
        );
      });
      this.tell();
    }
    /** @param {number} run */
    swatch(run) {
      return swatchOf({ colour: colour("text"), dash: dashOf(run) });
    }
    /**
     * The key of a run, which switches it.
     * @param {Run} run
     * @param {number} k
     */
    keyOf({ name, heading, about, end }, k) {
      const ends = this.runs.some((each) => each.end !== end) ? `to ${number(end, 4)} s` : "";
      const more = [name === heading ? "" : name, ends].filter(Boolean).join(", ");
      return element(
        "button",
        {
          type: "button",
          class: "plot-chip run-key",
          title: `${name}: ${about}. A click switches this run.`,
          onclick: () => this.toggleRun(k)
        },
        this.swatch(k),
        element("b", { text: heading }),
        element("span", { class: "muted", text: more })
      );
    }
    /** What is solid, in the legend. */
    tell() {
      const note = byId("compare-note");
      note.hidden = !this.ghosts || !this.runs.length;
      const seen = this.runs.filter((_2, k) => !this.hidden.has(k)).map(({ heading }) => heading);
      const others = seen.length > 1 ? `; translucent: ${seen.slice(1).join("; ")}` : "";
      note.textContent = `solid: ${seen[0] ?? "none"}${others}`;
    }
    /**
     * An instant with all runs where they are drawn.
     * @param {Instant} instant
     */
    place(instant) {
      if (!this.runs.length || !instant.poses) return;
      const poses = Float64Array.from(instant.poses);
      instant.poses = poses;
      for (const { name, agents, items, shift, shown: shown2 } of this.meta?.systems ?? []) {
        const [first, count] = items;
        for (let p = 8 * first; p < 8 * (first + count); p += 8) {
          for (const axis of [0, 1]) poses[p + axis] += shown2.offset[axis] - shift[axis];
          if (shown2.off) poses[p + 7] = 0;
        }
        if (shown2.off) instant.systems[name].there = new Float64Array(agents);
      }
    }
  };
  var headingTexts = (systems, runs, layout) => systems.filter((system) => system.drawn_as === "fleet" && isSolid(system)).map((system) => {
    const places = [...Array(system.agents).keys()].map((k) => layout.agentAt(system, k));
    const middle = places.reduce((sum, [x]) => sum + x, 0) / places.length;
    const front = Math.min(...places.map(([, y]) => y)) - BELOW;
    const point = [middle, front, layout.floor];
    return { point, text: runs[system.run].heading, bold: true, title: true };
  });

  // src/header.js
  var Header = class {
    chipKey = "";
    // of what the chips say
    bannerText = "";
    /** @param {(time: number) => void} lead to a moment */
    constructor(lead) {
      this.lead = lead;
    }
    /**
     * @param {Scene} meta
     * @param {Source} source
     */
    show(meta, source) {
      byId("time").textContent = source.time.toFixed(2);
      byId("duration").textContent = number(meta.duration, 6);
      byId("pace").textContent = source.pace;
      this.showChips(meta.systems, source);
      this.showBanner(meta.systems, source);
    }
    /**
     * @param {System[]} systems
     * @param {Source} source
     */
    showChips(systems, source) {
      const key = JSON.stringify(systems.map((system) => source.stateOf(system)));
      if (key === this.chipKey) return;
      this.chipKey = key;
      const of = source.seekable ? "closest approach" : "closest approach so far";
      const chips = systems.map((system) => chipOf(system, source.stateOf(system), of, this.lead));
      byId("chips").replaceChildren(...chips);
      announce(systems, source);
    }
    /**
     * @param {System[]} systems
     * @param {Source} source
     */
    showBanner(systems, source) {
      const out = systems.filter((system) => outside(source.stateOf(system).status));
      const text2 = out.map((system) => exitText(system, source)).join("   ");
      byId("banner-show").hidden = !source.seekable || !(out[0]?.name in source.exits);
      if (text2 === this.bannerText) return;
      this.bannerText = text2;
      byId("banner").hidden = !text2;
      byId("banner-text").textContent = text2;
    }
  };
  var warn = (text2) => {
    byId("banner-text").textContent = text2;
    byId("banner").hidden = false;
    byId("waiting").hidden = true;
  };
  var announce = (systems, source) => {
    const words = systems.map(
      (system) => `${system.name}: ${status(source.stateOf(system).status).words}`
    );
    const text2 = words.join(", ");
    const place = byId("announcement");
    if (place.textContent !== text2) place.textContent = text2;
  };
  var chipOf = (system, state, of, lead) => {
    const { kind, symbol, words } = status(state.status);
    const about = [
      system.game,
      `${system.agents} ${system.agent_name}s`,
      `information: ${system.information}`,
      `mode: ${system.mode}`,
      `engine: ${system.engine}`
    ];
    return element(
      "div",
      {
        class: `chip ${kind}`,
        title: [state.message, about.join(" · ")].filter(Boolean).join("\n")
      },
      element("span", { class: "sign", "aria-hidden": true, text: symbol }),
      element("span", {}, element("b", { text: system.name }), `: ${words}`),
      marginOf(state, of, lead)
    );
  };
  var marginOf = ({ margin, margin_name: name, margin_time: time }, of, lead) => {
    if (typeof margin !== "number") return element("span", { class: "margin", text: "no margin known" });
    const text2 = `${of}: margin ${number(margin)}${name ? ` · ${name}` : ""}`;
    if (typeof time !== "number") return element("span", { class: "margin", text: text2 });
    const when = ` at ${fixed(time, time < 10 ? 2 : 1)} s`;
    const onclick = () => lead(time);
    const title = "Show it";
    return element("button", { type: "button", class: "margin", text: text2 + when, title, onclick });
  };
  var exitText = (system, source) => {
    const { status: word, message } = source.stateOf(system);
    const at = source.exits[system.name];
    const when = at === void 0 ? "" : ` at ${number(at, 4)} s`;
    return `${system.name}: ${status(word).words}${when}${message ? `: ${message}` : ""}`;
  };

  // src/notices.js
  var MOST = 3;
  var STAYS = { info: 5e3, error: 12e3 };
  var shown = /* @__PURE__ */ new Map();
  var notify = (text2, level = "info", about = text2) => {
    shown.get(about)?.();
    const error = level === "error";
    const notice = element(
      "div",
      { class: `toast ${error ? "error" : ""}` },
      element("span", { "aria-hidden": true, text: error ? "⚠" : "ℹ" }),
      element("span", { class: "said", text: text2 }),
      element("button", {
        type: "button",
        class: "icon",
        text: "✕",
        "aria-label": "close this message",
        onclick: () => close()
      })
    );
    const due = setTimeout(() => close(), STAYS[level]);
    const close = () => {
      clearTimeout(due);
      notice.remove();
      if (shown.get(about) === close) shown.delete(about);
    };
    shown.set(about, close);
    const place = byId(error ? "alerts" : "notices");
    place.append(notice);
    while (place.children.length > MOST) place.firstChild?.remove();
  };

  // src/keep.js
  var momentAsked = () => {
    const found = /^#t=(\d+(?:\.\d+)?)$/.exec(location.hash);
    return found ? Number(found[1]) : null;
  };
  var copy = async (text2, what, file) => {
    try {
      await navigator.clipboard.writeText(text2);
      notify(`${what} is copied.`, "info", what);
    } catch {
      download(file, new Blob([text2], { type: "text/plain" }));
      notify(`${what} is saved as ${file}.`, "info", what);
    }
  };
  var keepScenario = (text2) => {
    if (text2) copy(text2, "The scenario with what was done", "scenario.toml");
    else notify("What was done to this run is not said by any keys of a scenario.", "error");
  };
  var Keep = class {
    /** @param {Page} page */
    constructor(page2) {
      this.page = page2;
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
      const { mode: mode2, playback } = this.page;
      byId("keep-run").hidden = mode2 === "file" || !playback;
      byId("keep-link").hidden = byId("keep-video").hidden = !playback;
      byId("keep-scenario").hidden = Boolean(playback?.meta.runs);
    }
  };

  // src/instant.js
  var partsOf = (system) => [
    "action",
    ...system.quantities.flatMap(
      ({ name, moving_bounds: moving }) => [name, ...Object.values(moving)].map((each) => `quantity/${each}`)
    ),
    "share",
    "margin",
    "estimate",
    "linked",
    "there"
  ];
  var isThere = (own, agent) => !own?.there || own.there[agent] > 0.5;
  var orNull = (value) => value !== void 0 && Number.isFinite(value) ? value : null;
  var instantOfFrame = (pack, systems) => {
    const instant = { time: pack.meta.time, poses: pack.arrays.poses?.data, systems: {} };
    for (const system of systems) {
      const own = instant.systems[system.name] = {};
      for (const part of [...partsOf(system), "messages"])
        own[part] = pack.arrays[`${system.name}/${part}`]?.data;
    }
    return instant;
  };

  // src/history.js
  var History = class {
    /**
     * @param {System[]} systems
     * @param {number} most samples
     */
    constructor(systems, most = 3e3) {
      this.most = most;
      this.names = systems.flatMap(
        (system) => partsOf(system).filter((part) => part !== "estimate").map((part) => `${system.name}/${part}`)
      );
      this.time = [];
      this.columns = {};
      this.spacing = 0;
      this.peaks = {};
      this.clear();
    }
    clear() {
      this.time = [];
      this.columns = Object.fromEntries(this.names.map((name) => [name, []]));
      this.spacing = 0;
      this.peaks = {};
    }
    /** @param {Pack} pack of all that was before */
    fill(pack) {
      this.clear();
      const time = pack.arrays.time.data;
      for (const name of this.names) {
        const data = pack.arrays[name]?.data;
        if (!data || time.length === 0) continue;
        const width = data.length / time.length;
        this.columns[name] = [...Array(width).keys()].map(
          (k) => Array.from(time, (_2, i) => orNull(data[i * width + k]))
        );
        this.notePeak(name, data);
      }
      this.time = Array.from(time);
      this.thin();
    }
    /**
     * @param {string} name
     * @param {Numbers | number[]} values
     */
    notePeak(name, values) {
      let most = this.peaks[name] || 0;
      for (const value of values) if (Math.abs(value) > most) most = Math.abs(value);
      this.peaks[name] = most;
    }
    /**
     * Takes an instant if it is new; one from the past means that the run began again.
     * @param {Instant} instant
     */
    push(instant) {
      const last = this.time[this.time.length - 1];
      if (instant.time < last) this.clear();
      else if (instant.time < last + this.spacing || instant.time === last) return;
      for (const name of this.names) {
        const cut = name.indexOf("/");
        const values = instant.systems[name.slice(0, cut)][name.slice(cut + 1)];
        this.append(name, values || []);
      }
      this.time.push(instant.time);
      if (this.time.length > this.most) this.thin();
    }
    /**
     * @param {string} name
     * @param {Numbers | number[]} values
     */
    append(name, values) {
      const columns = this.columns[name];
      for (let k = 0; k < Math.max(values.length, columns.length); k++) {
        columns[k] ??= Array(this.time.length).fill(null);
        columns[k].push(orNull(values[k]));
      }
      this.notePeak(name, values);
    }
    thin() {
      while (this.time.length > this.most) {
        const keep = (values) => values.filter((_2, i) => i % 2 === 0);
        this.time = keep(this.time);
        for (const name of this.names) this.columns[name] = this.columns[name].map(keep);
        this.spacing = (this.time[this.time.length - 1] - this.time[0]) / this.time.length;
      }
    }
    /**
     * @param {string} name
     * @param {number} k
     */
    column(name, k) {
      return this.columns[name][k] || this.time.map(() => null);
    }
    /** @param {string} name */
    greatest(name) {
      return this.peaks[name] || 0;
    }
  };

  // src/pack.js
  var TYPES = { f8: Float64Array, f4: Float32Array, i4: Int32Array, u1: Uint8Array };
  var unshuffled = (bytes, size) => {
    if (size === 1) return bytes.slice();
    const n = bytes.length / size;
    const out = new Uint8Array(bytes.length);
    for (let byte = 0; byte < size; byte++) {
      const group = byte * n;
      for (let k = 0; k < n; k++) out[k * size + byte] = bytes[group + k];
    }
    return out;
  };
  var isPack = (bytes) => bytes.length > 8 && String.fromCharCode(...bytes.subarray(0, 4)) === "GNE1";
  var decodePack = (bytes) => {
    if (!isPack(bytes)) throw new Error("these bytes are no pack of gne_mj");
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const length = view.getUint32(4, true);
    const header = JSON.parse(new TextDecoder().decode(bytes.subarray(8, 8 + length)));
    const start = Math.ceil((8 + length) / 8) * 8;
    const arrays = {};
    for (const entry of header.arrays) {
      const Type = TYPES[entry.dtype];
      const count = entry.shape.reduce((a, b) => a * b, 1);
      const from = start + entry.offset;
      const raw = bytes.subarray(from, from + count * Type.BYTES_PER_ELEMENT);
      const own = entry.shuffled ? unshuffled(raw, Type.BYTES_PER_ELEMENT) : raw.slice();
      arrays[entry.name] = { data: new Type(own.buffer, 0, count), shape: entry.shape };
    }
    return { meta: header.meta, arrays };
  };
  var inflate = async (bytes) => {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };
  var fromBase64 = (text2) => Uint8Array.from(atob(text2.trim()), (c) => c.charCodeAt(0));
  var unpack = async (bytes) => decodePack(await inflate(bytes));
  var fetchReplay = async () => {
    const answer = await fetch("replay");
    if (!answer.ok) throw new Error(`the server answered ${answer.status}`);
    return unpack(new Uint8Array(await answer.arrayBuffer()));
  };

  // src/socket.js
  var AGAIN = 2e3;
  var FULL = 1013;
  var Socket = class {
    /**
     * @param {object} callbacks
     * @param {() => void} callbacks.opened
     * @param {(why: string) => void} callbacks.lost
     * @param {(bytes: Uint8Array) => void} callbacks.command one of meshcat's
     * @param {(pack: Pack) => void} callbacks.pack
     * @param {(message: any) => void} callbacks.message from JSON
     */
    constructor(callbacks) {
      this.callbacks = callbacks;
      this.socket = this.connect();
    }
    connect() {
      const url = new URL("socket", location.href);
      url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
      const socket = new WebSocket(url);
      socket.binaryType = "arraybuffer";
      socket.onopen = () => this.callbacks.opened();
      socket.onmessage = ({ data }) => this.receive(data);
      socket.onclose = ({ code, reason }) => {
        this.callbacks.lost(
          code === FULL ? `this page is not connected: ${reason}` : "connection lost: the simulation has ended or the server is gone"
        );
        setTimeout(() => this.socket = this.connect(), AGAIN);
      };
      return socket;
    }
    /** @param {string | ArrayBuffer} data */
    receive(data) {
      if (typeof data === "string") return this.callbacks.message(JSON.parse(data));
      const bytes = new Uint8Array(data);
      if (!isPack(bytes)) return this.callbacks.command(bytes);
      const pack = decodePack(bytes);
      this.callbacks.pack(pack);
      if (pack.meta.kind !== "scene") this.send({ do: "shown" });
    }
    get open() {
      return this.socket.readyState === WebSocket.OPEN;
    }
    /** @param {object} message */
    send(message) {
      if (this.open) this.socket.send(JSON.stringify(message));
    }
  };

  // src/live.js
  var Live = class {
    /** @param {Listener} listener */
    constructor(listener) {
      this.listener = listener;
      this.seekable = false;
      this.connected = false;
      this.framesReceived = 0;
      this.meta = null;
      this.frame = null;
      this.store = new History([]);
      this.time = 0;
      this.playing = false;
      this.speed = 1;
      this.grown = false;
      this.exits = {};
      this.interventions = [];
      this.pending = null;
      this.told = false;
      this.fetching = false;
      this.replayed = false;
      this.socket = new Socket({
        opened: () => this.opened(),
        lost: (why) => this.lost(why),
        command: (bytes) => listener.command(bytes),
        pack: (pack) => this.receive(pack),
        message: (message) => this.hear(message)
      });
    }
    get end() {
      return this.meta?.duration ?? 0;
    }
    take() {
      const instant = this.pending;
      this.pending = null;
      return instant;
    }
    // ---- what the simulation is asked for
    /** @param {object} message */
    send(message) {
      this.socket.send(message);
    }
    playPause() {
      this.send({ do: this.playing ? "pause" : "play" });
    }
    /** @param {number} direction */
    step(direction) {
      if (direction > 0) this.send({ do: "step" });
    }
    restart() {
      this.send({ do: "restart" });
    }
    /** @param {number | null} value */
    setSpeed(value) {
      this.send({ do: "speed", value });
    }
    seek() {
    }
    // its time cannot be turned back
    advance() {
    }
    // it does so itself
    /**
     * A picture was drawn: a run that waits for its viewer begins with the first one that has all.
     * @param {boolean} whole
     */
    saw(whole) {
      if (this.told || !whole || !this.connected) return;
      this.told = true;
      this.send({ do: "seen" });
    }
    // ---- what it tells
    opened() {
      this.told = false;
      this.meta = this.pending = null;
      this.connected = true;
      this.listener.opened();
    }
    /** @param {string} why */
    lost(why) {
      this.connected = this.playing = false;
      this.listener.lost(why);
    }
    /** @param {Pack} pack */
    receive(pack) {
      const { kind } = pack.meta;
      if (kind === "scene") this.begin(pack.meta);
      else if (kind === "history") {
        this.store.fill(pack);
        this.grown = true;
      } else if (kind === "frame" && this.meta) this.takeFrame(pack, this.meta.systems);
    }
    /** @param {Scene} meta */
    begin(meta) {
      this.leaveReplay();
      this.exits = {};
      this.meta = meta;
      this.store = new History(meta.systems);
      this.listener.scene(meta);
    }
    /**
     * @param {Pack} pack
     * @param {System[]} systems
     */
    takeFrame(pack, systems) {
      this.framesReceived++;
      const frame = this.frame = /** @type {Frame} */
      pack.meta;
      if (frame.ended) this.askForReplay();
      else this.leaveReplay();
      if (this.replayed) return;
      const instant = instantOfFrame(pack, systems);
      if (instant.time < this.time) this.exits = {};
      this.noteExits(frame);
      this.playing = frame.playing;
      this.speed = frame.speed;
      this.store.push(instant);
      this.time = instant.time;
      this.pending = instant;
      this.grown = true;
      for (const system of systems)
        this.listener.messages(system, instant.systems[system.name].messages);
    }
    /** @param {Frame} frame */
    noteExits(frame) {
      for (const [name, state] of Object.entries(frame.state))
        if (outside(state.status)) this.exits[name] ??= state.exit_time ?? frame.time;
        else delete this.exits[name];
    }
    async askForReplay() {
      if (this.fetching || this.replayed) return;
      this.fetching = true;
      try {
        const pack = await fetchReplay();
        if (!this.frame?.ended) return;
        this.listener.ended(pack);
        this.replayed = true;
        this.playing = false;
      } catch (error) {
        notify(`The run has ended, but its replay could not be had: ${error.message}`, "error");
      } finally {
        this.fetching = Boolean(this.frame?.ended) && !this.replayed;
      }
    }
    leaveReplay() {
      this.fetching = false;
      if (!this.replayed) return;
      this.replayed = false;
      this.exits = {};
      this.interventions = [];
      this.store.clear();
      this.time = 0;
      this.listener.resumed();
    }
    /** @param {any} message */
    hear(message) {
      if (message.kind === "notice") notify(message.text, message.level, message.about);
      else if (message.kind === "scenario") keepScenario(message.text);
      else if (message.kind === "controls") this.listener.controls(message.values);
      else if (message.kind === "interventions") this.interventions = message.done;
    }
    // ---- in words
    /**
     * @param {System} system
     * @returns {State}
     */
    stateOf({ name }) {
      return this.frame?.state[name] ?? { status: "waiting" };
    }
    get pace() {
      if (!this.frame) return "";
      if (!this.connected) return "not connected";
      if (!this.playing) return "paused";
      const { speed, pace } = this.frame;
      const wished = speed === null ? "as fast as possible" : `×${number(speed)}`;
      return pace === null ? wished : `${wished}, ${number(pace)} reached`;
    }
  };

  // src/links.js
  var TRAVEL = 650;
  var REST = 400;
  var FLOW = 1800;
  var MANY = 160;
  var DENSE = 300;
  var along = ([a, c, b], t) => {
    const u = 1 - t;
    return {
      x: u * u * a.x + 2 * u * t * c.x + t * t * b.x,
      y: u * u * a.y + 2 * u * t * c.y + t * t * b.y
    };
  };
  var Links = class {
    /**
     * @param {CanvasRenderingContext2D} context
     * @param {Scene} scene
     */
    constructor(context, scene) {
      this.context = context;
      this.scene = scene;
      this.shown = true;
      this.pulses = [];
      this.lastPulse = /* @__PURE__ */ new Map();
      this.heads = /* @__PURE__ */ new Map();
      this.linked = /* @__PURE__ */ new Map();
      this.arrays = /* @__PURE__ */ new Map();
    }
    /** Another scene. */
    begin() {
      this.pulses = [];
      this.lastPulse.clear();
    }
    /**
     * Starts pulses for messages, not more than the eye can follow.
     * @param {System} system
     * @param {Numbers | undefined} counts links x [passed, lost]
     * @param {number} now
     */
    messages(system, counts, now) {
      if (!this.pulsing || !counts || document.hidden) return;
      const every = Math.max(1, Math.ceil(system.links.length / MANY));
      for (let link = 0; link < system.links.length; link += every) {
        if (!this.among(system, system.links[link])) continue;
        const [passed, lost] = [counts[2 * link], counts[2 * link + 1]];
        if (passed + lost > 0) this.pulse(system, link, lost > 0, now, REST);
      }
    }
    /**
     * A slow steady flow, where messages have no instants.
     * @param {System[]} systems
     * @param {number} now
     */
    flow(systems, now) {
      if (!this.pulsing) return;
      for (const system of systems)
        if (system.message_period === null && !system.triggered) this.flowIn(system, now);
    }
    /**
     * @param {System} system
     * @param {number} now
     */
    flowIn(system, now) {
      const every = Math.max(1, Math.ceil(system.links.length / MANY));
      const linked = this.linked.get(system.name);
      for (let link = 0; link < system.links.length; link += every) {
        if (linked && !(linked[link >> 1] > 0.5)) continue;
        if (!this.among(system, system.links[link])) continue;
        const key = `${system.name}/${link}`;
        if (!this.lastPulse.has(key)) this.lastPulse.set(key, now - link * 617 % FLOW);
        this.pulse(system, link, false, now, FLOW);
      }
    }
    /**
     * Whether both agents, from 1, are there.
     * @param {System} system
     * @param {[number, number]} pair
     */
    among(system, [a, b]) {
      const own = this.arrays.get(system.name);
      return isThere(own, a - 1) && isThere(own, b - 1);
    }
    get pulsing() {
      return this.shown && !reducedMotion();
    }
    /**
     * @param {System} system
     * @param {number} link
     * @param {boolean} lost
     * @param {number} now ms
     * @param {number} rest ms since the one before
     */
    pulse(system, link, lost, now, rest) {
      const key = `${system.name}/${link}`;
      if (now - (this.lastPulse.get(key) ?? -Infinity) < rest) return;
      this.lastPulse.set(key, now);
      const [hearer, sender] = system.links[link];
      this.pulses.push({ system, from: sender - 1, to: hearer - 1, lost, born: now });
    }
    /**
     * Curve between two agents on the screen: its two ends and the point that bends it.
     * @param {System} system
     * @param {number} a
     * @param {number} b
     */
    curve(system, a, b) {
      if (system.edges.length > DENSE) return this.straight(system, a, b);
      const { camera, layout } = this.scene;
      const [p, q] = [layout.headOf(system, a), layout.headOf(system, b)];
      const length = Math.hypot(...p.map((v, k) => v - q[k]));
      const middle = p.map((v, k) => (v + q[k]) / 2);
      middle[2] += Math.max(0.25, 0.22 * length);
      const ends = [p, middle, q].map((point) => camera.project(point));
      return ends.includes(null) ? null : ends;
    }
    /**
     * @param {System} system
     * @param {number} a
     * @param {number} b
     */
    straight(system, a, b) {
      const [from, to] = [this.headAt(system, a), this.headAt(system, b)];
      return from && to && [from, { x: (from.x + to.x) / 2, y: (from.y + to.y) / 2 }, to];
    }
    /**
     * Where the links of an agent begin on the screen; once a picture for each.
     * @param {System} system
     * @param {number} agent
     */
    headAt(system, agent) {
      const key = `${system.name}/${agent}`;
      const { camera, layout } = this.scene;
      if (!this.heads.has(key)) this.heads.set(key, camera.project(layout.headOf(system, agent)));
      return this.heads.get(key);
    }
    /**
     * @param {System[]} systems
     * @param {Instant} instant
     * @param {number} now
     */
    draw(systems, instant, now) {
      if (!this.shown) return void (this.pulses = []);
      this.heads.clear();
      for (const system of systems) {
        const linked = instant.systems[system.name].linked;
        this.linked.set(system.name, linked);
        this.arrays.set(system.name, instant.systems[system.name]);
        this.edges(system, (edge) => !linked || linked[edge] > 0.5);
      }
      this.pulses = this.pulses.filter(({ born, lost }) => now - born < (lost ? 1.5 : 1) * TRAVEL);
      for (const pulse of this.pulses) this.drawPulse(pulse, (now - pulse.born) / TRAVEL);
    }
    /**
     * @param {System} system
     * @param {(edge: number) => boolean} there
     */
    edges(system, there) {
      const { context } = this;
      const dense = system.edges.length > 60;
      context.lineWidth = dense ? 0.8 : 1.4;
      context.strokeStyle = colour("link");
      context.globalAlpha = dense ? Math.max(0.15, 30 / system.edges.length) : 0.75;
      context.setLineDash(system.edges_are === "messages" ? [] : [4, 4]);
      context.beginPath();
      for (const [edge, [a, b]] of system.edges.entries()) {
        if (!there(edge) || !this.among(system, [a, b])) continue;
        const curve = this.curve(system, a - 1, b - 1);
        if (!curve) continue;
        const [from, bend, to] = curve;
        context.moveTo(from.x, from.y);
        context.quadraticCurveTo(bend.x, bend.y, to.x, to.y);
      }
      context.stroke();
      context.setLineDash([]);
      context.globalAlpha = 1;
    }
    /**
     * @param {Pulse} pulse
     * @param {number} age in times that a message is seen
     */
    drawPulse({ system, from, to, lost }, age) {
      const { context } = this;
      const curve = this.curve(system, from, to);
      if (!curve) return;
      const { x, y } = along(curve, lost ? Math.min(age, 0.5) : age);
      context.fillStyle = context.strokeStyle = colour(lost ? "bad" : "pulse");
      if (lost && age > 0.5) return this.cross(x, y, Math.max(0, 1.5 - age));
      context.beginPath();
      context.arc(x, y, 3, 0, 2 * Math.PI);
      context.fill();
    }
    /**
     * A message that is lost.
     * @param {number} x
     * @param {number} y
     * @param {number} alpha
     */
    cross(x, y, alpha) {
      const { context } = this;
      context.globalAlpha = alpha;
      context.lineWidth = 2;
      context.beginPath();
      context.moveTo(x - 4, y - 4);
      context.lineTo(x + 4, y + 4);
      context.moveTo(x + 4, y - 4);
      context.lineTo(x - 4, y + 4);
      context.stroke();
      context.globalAlpha = 1;
    }
  };

  // src/overlay.js
  var labelOrder = (n) => {
    const zeros = (k) => k === 0 ? 32 : Math.log2(k & -k);
    return [...Array(n).keys()].sort((a, b) => zeros(b) - zeros(a) || a - b);
  };
  var colourOf = ({ bad, limit, chosen, title }) => bad ? "bad" : limit ? "limit" : chosen ? "accent" : title ? "muted" : "text";
  var Overlay = class {
    /**
     * @param {HTMLCanvasElement} canvas
     * @param {Scene} scene
     */
    constructor(canvas, scene) {
      this.canvas = canvas;
      this.scene = scene;
      this.context = /** @type {CanvasRenderingContext2D} */
      canvas.getContext("2d");
      this.links = new Links(this.context, scene);
      this.labelled = true;
      this.systems = [];
      this.runs = [];
      this.orders = /* @__PURE__ */ new Map();
      this.taken = [];
      this.marks = [];
      this.highlighted = null;
    }
    /** @param {Meta} meta */
    setMeta({ systems, runs = [] }) {
      this.systems = systems;
      this.runs = runs;
      this.orders = new Map(systems.map((system) => [system.name, labelOrder(system.agents)]));
      this.links.begin();
    }
    /** Whether pictures must go on although nothing new came. */
    get moving() {
      return this.links.pulses.length > 0;
    }
    // ---- drawing
    /**
     * @param {Instant} instant
     * @param {number} now
     */
    draw(instant, now) {
      const { canvas, context } = this;
      const ratio = Math.min(devicePixelRatio, 2);
      const [w, h] = [canvas.clientWidth, canvas.clientHeight];
      if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
        canvas.width = Math.round(w * ratio);
        canvas.height = Math.round(h * ratio);
      }
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, w, h);
      this.taken = [];
      this.marks = [];
      const solid = this.systems.filter(isSolid);
      this.links.draw(solid, instant, now);
      if (this.runs.length && solid.length === this.systems.length)
        for (const text2 of headingTexts(solid, this.runs, this.scene.layout)) this.text(text2);
      for (const system of solid)
        if (system.drawn_as === "bars") this.barTexts(system);
        else if (this.labelled) this.labels(system, instant);
      this.distances();
    }
    /** Metres along the lane, at the ground's stronger lines. */
    distances() {
      const { context } = this;
      const { camera, ground, layout } = this.scene;
      if (!layout.box) return;
      const { low, high } = layout.box;
      const y = low[1] - (layout.lane === null ? 1.5 : 0.75);
      context.font = "11px system-ui, sans-serif";
      context.textAlign = "center";
      context.textBaseline = "top";
      context.fillStyle = colour("muted");
      const step = ground.major > 10 ? ground.major : 5;
      const wide = this.canvas.clientWidth;
      for (let x = Math.floor((low[0] - 2 * step) / step) * step; x <= high[0] + 2 * step; x += step) {
        const p = camera.project([x, y, layout.floor]);
        const box = p && { x: p.x - 26, y: p.y, w: 52, h: 18 };
        if (!box || box.x < 0 || box.x + box.w > wide || !this.free(box)) continue;
        this.taken.push(box);
        this.haloed(`${number(x, 6)} m`, p.x, p.y + 4);
      }
    }
    // ---- labels
    /** @param {Box} box */
    free(box) {
      return !this.taken.some(
        (t) => box.x < t.x + t.w && t.x < box.x + box.w && box.y < t.y + t.h && t.y < box.y + box.h
      );
    }
    /**
     * @param {System} system
     * @param {Instant} instant
     */
    labels(system, instant) {
      const shares = instant.systems[system.name].share;
      const share = (agent) => shares ? shares[agent] : NaN;
      const first = (agent) => this.isHighlighted(system, agent) || share(agent) > 1;
      const order = this.orders.get(system.name) ?? [];
      const away = (agent) => !isThere(instant.systems[system.name], agent);
      const urgent = order.filter(first);
      for (const agent of [...urgent, ...order.filter((each) => !first(each))])
        if (!away(agent)) this.label(system, agent, share(agent));
    }
    /**
     * @param {System} system
     * @param {number} agent
     */
    isHighlighted(system, agent) {
      const which = this.highlighted;
      return which?.system === system.name && which?.agent === agent;
    }
    /**
     * @param {System} system
     * @param {number} agent
     * @param {number} share
     */
    label(system, agent, share) {
      const [x, y, z] = this.scene.layout.agentAt(system, agent);
      const p = this.scene.camera.project([x, y, z + system.height]);
      if (!p) return;
      this.marks.push({ x: p.x, y: p.y, system: system.name, agent });
      const name = String(agent + 1);
      const out = share > 1;
      const digits = out && share < 1.1 ? 1 : 0;
      const used2 = out ? "outside" : "";
      const percent = Number.isFinite(share) ? `${(100 * share).toFixed(digits)} %` : used2;
      for (const text2 of percent ? [percent, ""] : [""]) {
        const box = this.pillBox(p, name, out ? `⚠ ${text2}` : text2);
        if (!this.free(box) && !this.isHighlighted(system, agent)) continue;
        this.taken.push(box);
        return this.pill(box, { name, system, agent, out });
      }
    }
    /**
     * @param {{x: number, y: number}} p
     * @param {string} name
     * @param {string} text
     */
    pillBox(p, name, text2) {
      const context = this.context;
      context.font = "600 13px system-ui, sans-serif";
      const wide = context.measureText(name).width;
      context.font = "12px system-ui, sans-serif";
      const more = text2 ? context.measureText(text2).width + 7 : 0;
      const w = wide + more + 14;
      return { x: p.x - w / 2, y: p.y - 22, w, h: 20, wide, text: text2 };
    }
    /**
     * @param {Pill} box
     * @param {{name: string, system: System, agent: number, out: boolean}} about
     */
    pill(box, { name, system, agent, out }) {
      const context = this.context;
      const chosen = this.isHighlighted(system, agent);
      context.beginPath();
      context.roundRect(box.x, box.y, box.w, box.h, 5);
      context.fillStyle = out ? colour("bad-fill") : colour("pill");
      context.fill();
      context.lineWidth = chosen ? 2 : 1;
      context.strokeStyle = colour(chosen ? "accent" : "pill-edge");
      context.stroke();
      context.textBaseline = "middle";
      context.textAlign = "left";
      context.fillStyle = out ? "#fff" : colour("text");
      context.font = "600 13px system-ui, sans-serif";
      context.fillText(name, box.x + 7, box.y + 10.5);
      context.font = "12px system-ui, sans-serif";
      if (!out) context.fillStyle = colour("muted");
      context.fillText(box.text, box.x + 14 + box.wide, box.y + 10.5);
      if (system.agents <= 14 && !out) this.swatch(box, agent);
    }
    /**
     * The look of the agent's line in the plots, under its label.
     * @param {Box} box
     * @param {number} agent
     */
    swatch(box, agent) {
      const context = this.context;
      const look = line(agent);
      context.strokeStyle = look.colour;
      context.lineWidth = 2.5;
      context.setLineDash(look.dash);
      context.beginPath();
      context.moveTo(box.x + 5, box.y + box.h);
      context.lineTo(box.x + box.w - 5, box.y + box.h);
      context.stroke();
      context.setLineDash([]);
    }
    /** @param {System} system */
    barTexts(system) {
      const bars2 = this.scene.layout.barsOf(system);
      for (const text2 of [bars2.title(), ...bars2.gaugeTexts()]) this.text(text2);
      const owners = system.action.owner;
      const digits = decimals(bars2.reference);
      owners.forEach((owner, k) => {
        const p = this.scene.camera.project(bars2.top(k));
        if (p) this.marks.push({ x: p.x, y: p.y, system: system.name, agent: owner - 1 });
        if (!this.labelled) return;
        const chosen = this.isHighlighted(system, owner - 1);
        const axis = system.action.axis[k] || "";
        this.text({ point: bars2.foot(k), text: `${owner}${axis}`, shift: 11, bold: true, chosen });
        this.text({
          point: bars2.top(k),
          text: fixed(bars2.values[k] ?? null, digits),
          shift: -9,
          chosen
        });
      });
    }
    /**
     * A text at a point of the scene, where there is room.
     * @param {Text} about
     */
    text({ point, text: text2, shift = 0, align = "center", ...kind }) {
      const p = this.scene.camera.project(point);
      if (!p) return;
      const context = this.context;
      context.font = `${kind.bold || kind.title ? "600 " : ""}12px system-ui, sans-serif`;
      const w = context.measureText(text2).width;
      const left = align === "center" ? p.x - w / 2 : p.x + 4;
      const box = { x: left - 2, y: p.y + shift - 7, w: w + 4, h: 14 };
      if (!this.free(box) && !kind.chosen) return;
      this.taken.push(box);
      context.textAlign = "left";
      context.textBaseline = "middle";
      context.fillStyle = colour(colourOf(kind));
      this.haloed(text2, left, p.y + shift);
    }
    /**
     * Text that can be read on anything.
     * @param {string} text
     * @param {number} x
     * @param {number} y
     */
    haloed(text2, x, y) {
      const context = this.context;
      context.lineWidth = 3;
      context.lineJoin = "round";
      context.strokeStyle = colour("halo");
      context.strokeText(text2, x, y);
      context.fillText(text2, x, y);
    }
    /**
     * The agent whose label or head is near a point of the pane.
     * @param {number} x
     * @param {number} y
     */
    agentNear(x, y) {
      let best = null;
      let nearest = 26;
      for (const mark of this.marks) {
        const away = Math.hypot(mark.x - x, mark.y - y + 4);
        if (away < nearest) [best, nearest] = [{ system: mark.system, agent: mark.agent }, away];
      }
      return best;
    }
  };

  // src/pace.js
  var PICTURE = 0.016;
  var SLOW = 0.05;
  var COARSE = 0.6;
  var Pace = class {
    /** @param {Scene} scene */
    constructor(scene) {
      this.scene = scene;
      this.usual = PICTURE;
    }
    /**
     * @param {number} passed s since the picture before
     * @param {boolean} playing
     */
    watch(passed, playing) {
      if (!playing) {
        this.usual = PICTURE;
        return this.scene.setQuality(1);
      }
      this.usual += 0.1 * (passed - this.usual);
      if (this.usual > SLOW) this.scene.setQuality(COARSE);
    }
  };

  // src/replay.js
  var mixQuaternion = (a, b, f, out, k) => {
    let dot = 0;
    for (let c = k; c < k + 4; c++) dot += a[c] * b[c];
    const sign2 = dot < 0 ? -1 : 1;
    let norm = 0;
    for (let c = k; c < k + 4; c++) {
      out[c] = (1 - f) * a[c] + f * sign2 * b[c];
      norm += out[c] * out[c];
    }
    norm = Math.sqrt(norm) || 1;
    for (let c = k; c < k + 4; c++) out[c] /= norm;
  };
  var Replay = class {
    /** @param {Pack} pack */
    constructor(pack) {
      this.meta = pack.meta;
      this.arrays = pack.arrays;
      this.time = Array.from(pack.arrays.time.data);
      const base = pack.arrays.pose_base?.data || new Float64Array(0);
      this.before = Float64Array.from(base);
      this.after = Float64Array.from(base);
      this.mixed = Float64Array.from(base);
    }
    get end() {
      return this.time[this.time.length - 1];
    }
    /**
     * @param {number} t
     * @returns {At}
     */
    at(t) {
      const time = this.time;
      const last = time.length - 1;
      if (!(t > time[0])) return { i: 0, f: 0 };
      if (t >= time[last]) return { i: last, f: 0 };
      let [low, high] = [0, last];
      while (high - low > 1) {
        const middle = low + high >> 1;
        if (time[middle] <= t) low = middle;
        else high = middle;
      }
      return { i: low, f: (t - time[low]) / (time[low + 1] - time[low]) };
    }
    /**
     * @param {number} i
     * @param {Float64Array} out
     */
    fillPoses(i, out) {
      const columns = this.arrays.pose_columns?.data || [];
      const values = this.arrays.pose_values?.data;
      const T = this.time.length;
      for (let v = 0; v < columns.length; v++) out[columns[v]] = values[v * T + i];
      return out;
    }
    /** @param {At} at */
    poses({ i, f }) {
      const a = this.fillPoses(i, this.before);
      if (f === 0) return a;
      const b = this.fillPoses(i + 1, this.after);
      const out = this.mixed;
      for (let k = 0; k < out.length; k += 8) {
        for (let c = k; c < k + 3; c++) out[c] = a[c] + (b[c] - a[c]) * f;
        mixQuaternion(a, b, f, out, k + 3);
        const whole = a[k + 7] === 0 || b[k + 7] === 0;
        out[k + 7] = whole ? a[k + 7] : a[k + 7] + (b[k + 7] - a[k + 7]) * f;
      }
      return out;
    }
    /**
     * Values of one array, of any width, at an instant.
     * @param {string} name
     * @param {At} at
     */
    row(name, { i, f }) {
      const array = this.arrays[name];
      if (!array) return void 0;
      const width = array.data.length / this.time.length;
      const row = array.data.subarray(i * width, (i + 1) * width);
      if (f === 0) return row;
      const next = array.data.subarray((i + 1) * width, (i + 2) * width);
      return row.map((value, k) => value + (next[k] - value) * f);
    }
    /**
     * @param {number} t
     * @returns {Instant}
     */
    instant(t) {
      const at = this.at(t);
      const time = Math.min(Math.max(t, this.time[0]), this.end);
      const instant = { time, poses: this.poses(at), systems: {} };
      for (const system of this.meta.systems) {
        const own = instant.systems[system.name] = {};
        for (const part of partsOf(system)) own[part] = this.row(`${system.name}/${part}`, at);
      }
      return instant;
    }
    /**
     * (links x 2) messages passed and lost in (from, to], or undefined.
     * @param {string} name of the system
     * @param {number} from
     * @param {number} to
     */
    messagesBetween(name, from, to) {
      const array = this.arrays[`${name}/messages`];
      if (!array || !(to > from)) return void 0;
      const width = array.data.length / this.time.length;
      const sum = new Float32Array(width);
      for (let i = this.at(from).i + 1; i <= this.at(to).i; i++)
        for (let k = 0; k < width; k++) sum[k] += array.data[i * width + k];
      return sum;
    }
    /**
     * Column k of an array, over all samples.
     * @param {string} name
     * @param {number} k
     */
    column(name, k) {
      const array = this.arrays[name];
      if (!array) return this.time.map(() => null);
      const width = array.data.length / this.time.length;
      return this.time.map((_2, i) => orNull(array.data[i * width + k]));
    }
    /** @param {string} name */
    greatest(name) {
      const data = this.arrays[name]?.data || [];
      let most = 0;
      for (const value of data) if (Math.abs(value) > most) most = Math.abs(value);
      return most;
    }
  };

  // src/playback.js
  var Playback = class {
    /**
     * @param {Pack} pack
     * @param {object} options
     * @param {string} [options.pace] what is said beside the clock
     * @param {number} [options.speed]
     * @param {(system: System, counts: Numbers | undefined) => void} options.messages called with
     *     what passed while time went on
     */
    constructor(pack, { messages, pace = "", speed = 1 }) {
      this.store = this.replay = new Replay(pack);
      const { outcome = {}, interventions = [] } = this.replay.meta;
      this.outcome = outcome;
      this.interventions = interventions;
      this.exits = {};
      for (const [name, { exit_time: time }] of Object.entries(outcome))
        if (typeof time === "number") this.exits[name] = time;
      this.messages = messages;
      this.pace = pace;
      this.speed = speed;
      this.seekable = true;
      this.playing = false;
      this.grown = false;
      this.start = this.replay.time[0];
      this.end = this.replay.end;
      this.time = this.start;
      this.pending = null;
    }
    get meta() {
      return this.replay.meta;
    }
    take() {
      const instant = this.pending;
      this.pending = null;
      return instant;
    }
    playPause() {
      if (!this.playing && this.time >= this.end) this.seek(this.start);
      this.playing = !this.playing;
    }
    /**
     * @param {number} direction
     * @param {boolean} second
     */
    step(direction, second) {
      this.playing = false;
      if (second) return this.seek(this.time + direction);
      const { time } = this.replay;
      const { i, f } = this.replay.at(this.time);
      const to = direction > 0 ? i + 1 : f > 0 ? i : i - 1;
      this.seek(time[Math.min(Math.max(to, 0), time.length - 1)], direction > 0);
    }
    restart() {
      this.seek(this.start);
    }
    /** @param {number | null} speed */
    setSpeed(speed) {
      this.speed = speed;
    }
    /**
     * Shows a time; messages since the time before pass if it is a step on.
     * @param {number} time
     */
    seek(time, withMessages = false) {
      const before = this.time;
      this.time = Math.min(Math.max(time, this.start), this.end);
      this.pending = this.replay.instant(this.time);
      if (!withMessages) return;
      for (const system of this.meta.systems)
        this.messages(system, this.replay.messagesBetween(system.name, before, this.time));
    }
    /** @param {number} seconds that have passed */
    advance(seconds) {
      if (!this.playing) return;
      this.seek(this.time + seconds * (this.speed ?? 1), true);
      if (this.time >= this.end) this.playing = false;
    }
    /**
     * Of the whole run, also while an earlier time is shown.
     * @param {System} system
     * @returns {State}
     */
    stateOf({ name }) {
      return this.outcome[name] ?? { status: "" };
    }
  };

  // node_modules/uplot/dist/uPlot.esm.js
  var FEAT_TIME = true;
  var pre = "u-";
  var UPLOT = "uplot";
  var ORI_HZ = pre + "hz";
  var ORI_VT = pre + "vt";
  var TITLE = pre + "title";
  var WRAP = pre + "wrap";
  var UNDER = pre + "under";
  var OVER = pre + "over";
  var AXIS = pre + "axis";
  var OFF = pre + "off";
  var SELECT = pre + "select";
  var CURSOR_X = pre + "cursor-x";
  var CURSOR_Y = pre + "cursor-y";
  var CURSOR_PT = pre + "cursor-pt";
  var LEGEND = pre + "legend";
  var LEGEND_LIVE = pre + "live";
  var LEGEND_INLINE = pre + "inline";
  var LEGEND_SERIES = pre + "series";
  var LEGEND_MARKER = pre + "marker";
  var LEGEND_LABEL = pre + "label";
  var LEGEND_VALUE = pre + "value";
  var WIDTH = "width";
  var HEIGHT = "height";
  var TOP = "top";
  var BOTTOM = "bottom";
  var LEFT = "left";
  var RIGHT = "right";
  var hexBlack = "#000";
  var transparent = hexBlack + "0";
  var mousemove = "mousemove";
  var mousedown = "mousedown";
  var mouseup = "mouseup";
  var mouseenter = "mouseenter";
  var mouseleave = "mouseleave";
  var dblclick = "dblclick";
  var resize = "resize";
  var scroll = "scroll";
  var change = "change";
  var dppxchange = "dppxchange";
  var LEGEND_DISP = "--";
  var domEnv = typeof window != "undefined";
  var doc = domEnv ? document : null;
  var win = domEnv ? window : null;
  var nav = domEnv ? navigator : null;
  var pxRatio;
  var query;
  function setPxRatio() {
    let _pxRatio = devicePixelRatio;
    if (pxRatio != _pxRatio) {
      pxRatio = _pxRatio;
      query && off(change, query, setPxRatio);
      query = matchMedia(`(min-resolution: ${pxRatio - 1e-3}dppx) and (max-resolution: ${pxRatio + 1e-3}dppx)`);
      on(change, query, setPxRatio);
      win.dispatchEvent(new CustomEvent(dppxchange));
    }
  }
  function addClass(el, c) {
    if (c != null) {
      let cl = el.classList;
      !cl.contains(c) && cl.add(c);
    }
  }
  function remClass(el, c) {
    let cl = el.classList;
    cl.contains(c) && cl.remove(c);
  }
  function setStylePx(el, name, value) {
    el.style[name] = value + "px";
  }
  function placeTag(tag, cls, targ, refEl) {
    let el = doc.createElement(tag);
    if (cls != null)
      addClass(el, cls);
    if (targ != null)
      targ.insertBefore(el, refEl);
    return el;
  }
  function placeDiv(cls, targ) {
    return placeTag("div", cls, targ);
  }
  var xformCache = /* @__PURE__ */ new WeakMap();
  function elTrans(el, xPos, yPos, xMax, yMax) {
    let xform = "translate(" + xPos + "px," + yPos + "px)";
    let xformOld = xformCache.get(el);
    if (xform != xformOld) {
      el.style.transform = xform;
      xformCache.set(el, xform);
      if (xPos < 0 || yPos < 0 || xPos > xMax || yPos > yMax)
        addClass(el, OFF);
      else
        remClass(el, OFF);
    }
  }
  var colorCache = /* @__PURE__ */ new WeakMap();
  function elColor(el, background, borderColor) {
    let newColor = background + borderColor;
    let oldColor = colorCache.get(el);
    if (newColor != oldColor) {
      colorCache.set(el, newColor);
      el.style.background = background;
      el.style.borderColor = borderColor;
    }
  }
  var sizeCache = /* @__PURE__ */ new WeakMap();
  function elSize(el, newWid, newHgt, centered) {
    let newSize = newWid + "" + newHgt;
    let oldSize = sizeCache.get(el);
    if (newSize != oldSize) {
      sizeCache.set(el, newSize);
      el.style.height = newHgt + "px";
      el.style.width = newWid + "px";
      el.style.marginLeft = centered ? -newWid / 2 + "px" : 0;
      el.style.marginTop = centered ? -newHgt / 2 + "px" : 0;
    }
  }
  var evOpts = { passive: true };
  var evOpts2 = { ...evOpts, capture: true };
  function on(ev, el, cb, capt) {
    el.addEventListener(ev, cb, capt ? evOpts2 : evOpts);
  }
  function off(ev, el, cb, capt) {
    el.removeEventListener(ev, cb, evOpts);
  }
  domEnv && setPxRatio();
  function closestIdx(num, arr, lo, hi) {
    let mid;
    lo = lo || 0;
    hi = hi || arr.length - 1;
    let bitwise = hi <= 2147483647;
    while (hi - lo > 1) {
      mid = bitwise ? lo + hi >> 1 : floor((lo + hi) / 2);
      if (arr[mid] < num)
        lo = mid;
      else
        hi = mid;
    }
    if (num - arr[lo] <= arr[hi] - num)
      return lo;
    return hi;
  }
  function makeIndexOfs(predicate) {
    let indexOfs = (data, _i0, _i1) => {
      let i0 = -1;
      let i1 = -1;
      for (let i = _i0; i <= _i1; i++) {
        if (predicate(data[i])) {
          i0 = i;
          break;
        }
      }
      for (let i = _i1; i >= _i0; i--) {
        if (predicate(data[i])) {
          i1 = i;
          break;
        }
      }
      return [i0, i1];
    };
    return indexOfs;
  }
  var notNullish = (v) => v != null;
  var isPositive = (v) => v != null && v > 0;
  var nonNullIdxs = makeIndexOfs(notNullish);
  var positiveIdxs = makeIndexOfs(isPositive);
  function getMinMax(data, _i0, _i1, sorted = 0, log = false) {
    let getEdgeIdxs = log ? positiveIdxs : nonNullIdxs;
    let predicate = log ? isPositive : notNullish;
    [_i0, _i1] = getEdgeIdxs(data, _i0, _i1);
    let _min = data[_i0];
    let _max = data[_i0];
    if (_i0 > -1) {
      if (sorted == 1) {
        _min = data[_i0];
        _max = data[_i1];
      } else if (sorted == -1) {
        _min = data[_i1];
        _max = data[_i0];
      } else {
        for (let i = _i0; i <= _i1; i++) {
          let v = data[i];
          if (predicate(v)) {
            if (v < _min)
              _min = v;
            else if (v > _max)
              _max = v;
          }
        }
      }
    }
    return [_min ?? inf, _max ?? -inf];
  }
  function rangeLog(min2, max2, base, fullMags) {
    let minSign = sign(min2);
    let maxSign = sign(max2);
    if (min2 == max2) {
      if (minSign == -1) {
        min2 *= base;
        max2 /= base;
      } else {
        min2 /= base;
        max2 *= base;
      }
    }
    let logFn = base == 10 ? log10 : log2;
    let growMinAbs = minSign == 1 ? floor : ceil;
    let growMaxAbs = maxSign == 1 ? ceil : floor;
    let minExp = growMinAbs(logFn(abs(min2)));
    let maxExp = growMaxAbs(logFn(abs(max2)));
    let minIncr = pow(base, minExp);
    let maxIncr = pow(base, maxExp);
    if (base == 10) {
      if (minExp < 0)
        minIncr = roundDec(minIncr, -minExp);
      if (maxExp < 0)
        maxIncr = roundDec(maxIncr, -maxExp);
    }
    if (fullMags || base == 2) {
      min2 = minIncr * minSign;
      max2 = maxIncr * maxSign;
    } else {
      min2 = incrRoundDn(min2, minIncr);
      max2 = incrRoundUp(max2, maxIncr);
    }
    return [min2, max2];
  }
  function rangeAsinh(min2, max2, base, fullMags) {
    let minMax = rangeLog(min2, max2, base, fullMags);
    if (min2 == 0)
      minMax[0] = 0;
    if (max2 == 0)
      minMax[1] = 0;
    return minMax;
  }
  var rangePad = 0.1;
  var autoRangePart = {
    mode: 3,
    pad: rangePad
  };
  var _eqRangePart = {
    pad: 0,
    soft: null,
    mode: 0
  };
  var _eqRange = {
    min: _eqRangePart,
    max: _eqRangePart
  };
  function rangeNum(_min, _max, mult, extra) {
    if (isObj(mult))
      return _rangeNum(_min, _max, mult);
    _eqRangePart.pad = mult;
    _eqRangePart.soft = extra ? 0 : null;
    _eqRangePart.mode = extra ? 3 : 0;
    return _rangeNum(_min, _max, _eqRange);
  }
  function ifNull(lh, rh) {
    return lh == null ? rh : lh;
  }
  function hasData(data, idx0, idx1) {
    idx0 = ifNull(idx0, 0);
    idx1 = ifNull(idx1, data.length - 1);
    while (idx0 <= idx1) {
      if (data[idx0] != null)
        return true;
      idx0++;
    }
    return false;
  }
  function _rangeNum(_min, _max, cfg) {
    let cmin = cfg.min;
    let cmax = cfg.max;
    let padMin = ifNull(cmin.pad, 0);
    let padMax = ifNull(cmax.pad, 0);
    let hardMin = ifNull(cmin.hard, -inf);
    let hardMax = ifNull(cmax.hard, inf);
    let softMin = ifNull(cmin.soft, inf);
    let softMax = ifNull(cmax.soft, -inf);
    let softMinMode = ifNull(cmin.mode, 0);
    let softMaxMode = ifNull(cmax.mode, 0);
    let delta = _max - _min;
    let deltaMag = log10(delta);
    let scalarMax = max(abs(_min), abs(_max));
    let scalarMag = log10(scalarMax);
    let scalarMagDelta = abs(scalarMag - deltaMag);
    if (delta < 1e-24 || scalarMagDelta > 10) {
      delta = 0;
      if (_min == 0 || _max == 0) {
        delta = 1e-24;
        if (softMinMode == 2 && softMin != inf)
          padMin = 0;
        if (softMaxMode == 2 && softMax != -inf)
          padMax = 0;
      }
    }
    let nonZeroDelta = delta || scalarMax || 1e3;
    let mag = log10(nonZeroDelta);
    let base = pow(10, floor(mag));
    let _padMin = nonZeroDelta * (delta == 0 ? _min == 0 ? 0.1 : 1 : padMin);
    let _newMin = roundDec(incrRoundDn(_min - _padMin, base / 10), 24);
    let _softMin = _min >= softMin && (softMinMode == 1 || softMinMode == 3 && _newMin <= softMin || softMinMode == 2 && _newMin >= softMin) ? softMin : inf;
    let minLim = max(hardMin, _newMin < _softMin && _min >= _softMin ? _softMin : min(_softMin, _newMin));
    let _padMax = nonZeroDelta * (delta == 0 ? _max == 0 ? 0.1 : 1 : padMax);
    let _newMax = roundDec(incrRoundUp(_max + _padMax, base / 10), 24);
    let _softMax = _max <= softMax && (softMaxMode == 1 || softMaxMode == 3 && _newMax >= softMax || softMaxMode == 2 && _newMax <= softMax) ? softMax : -inf;
    let maxLim = min(hardMax, _newMax > _softMax && _max <= _softMax ? _softMax : max(_softMax, _newMax));
    if (minLim == maxLim && minLim == 0)
      maxLim = 100;
    return [minLim, maxLim];
  }
  var numFormatter = new Intl.NumberFormat(domEnv ? nav.language : "en-US");
  var fmtNum = (val) => numFormatter.format(val);
  var M = Math;
  var PI = M.PI;
  var abs = M.abs;
  var floor = M.floor;
  var round = M.round;
  var ceil = M.ceil;
  var min = M.min;
  var max = M.max;
  var pow = M.pow;
  var sign = M.sign;
  var log10 = M.log10;
  var log2 = M.log2;
  var sinh = (v, linthresh = 1) => M.sinh(v) * linthresh;
  var asinh = (v, linthresh = 1) => M.asinh(v / linthresh);
  var inf = Infinity;
  function numIntDigits(x) {
    return (log10((x ^ x >> 31) - (x >> 31)) | 0) + 1;
  }
  function clamp(num, _min, _max) {
    return min(max(num, _min), _max);
  }
  function isFn(v) {
    return typeof v == "function";
  }
  function fnOrSelf(v) {
    return isFn(v) ? v : () => v;
  }
  var noop = () => {
  };
  var retArg0 = (_0) => _0;
  var retArg1 = (_0, _1) => _1;
  var retNull = (_2) => null;
  var retTrue = (_2) => true;
  var retEq = (a, b) => a == b;
  var regex6 = /\.\d*?(?=9{6,}|0{6,})/gm;
  var fixFloat = (val) => {
    if (isInt(val) || fixedDec.has(val))
      return val;
    const str = `${val}`;
    const match = str.match(regex6);
    if (match == null)
      return val;
    let len = match[0].length - 1;
    if (str.indexOf("e-") != -1) {
      let [num, exp] = str.split("e");
      return +`${fixFloat(num)}e${exp}`;
    }
    return roundDec(val, len);
  };
  function incrRound(num, incr) {
    return fixFloat(roundDec(fixFloat(num / incr)) * incr);
  }
  function incrRoundUp(num, incr) {
    return fixFloat(ceil(fixFloat(num / incr)) * incr);
  }
  function incrRoundDn(num, incr) {
    return fixFloat(floor(fixFloat(num / incr)) * incr);
  }
  function roundDec(val, dec = 0) {
    if (isInt(val))
      return val;
    let p = 10 ** dec;
    let n = val * p * (1 + Number.EPSILON);
    return round(n) / p;
  }
  var fixedDec = /* @__PURE__ */ new Map();
  function guessDec(num) {
    return (("" + num).split(".")[1] || "").length;
  }
  function genIncrs(base, minExp, maxExp, mults) {
    let incrs = [];
    let multDec = mults.map(guessDec);
    for (let exp = minExp; exp < maxExp; exp++) {
      let expa = abs(exp);
      let mag = roundDec(pow(base, exp), expa);
      for (let i = 0; i < mults.length; i++) {
        let _incr = base == 10 ? +`${mults[i]}e${exp}` : mults[i] * mag;
        let dec = (exp >= 0 ? 0 : expa) + (exp >= multDec[i] ? 0 : multDec[i]);
        let incr = base == 10 ? _incr : roundDec(_incr, dec);
        incrs.push(incr);
        fixedDec.set(incr, dec);
      }
    }
    return incrs;
  }
  var EMPTY_OBJ = {};
  var EMPTY_ARR = [];
  var nullNullTuple = [null, null];
  var isArr = Array.isArray;
  var isInt = Number.isInteger;
  var isUndef = (v) => v === void 0;
  function isStr(v) {
    return typeof v == "string";
  }
  function isObj(v) {
    let is = false;
    if (v != null) {
      let c = v.constructor;
      is = c == null || c == Object;
    }
    return is;
  }
  function fastIsObj(v) {
    return v != null && typeof v == "object";
  }
  var TypedArray = Object.getPrototypeOf(Uint8Array);
  var __proto__ = "__proto__";
  function copy2(o, _isObj = isObj) {
    let out;
    if (isArr(o)) {
      let val = o.find((v) => v != null);
      if (isArr(val) || _isObj(val)) {
        out = Array(o.length);
        for (let i = 0; i < o.length; i++)
          out[i] = copy2(o[i], _isObj);
      } else
        out = o.slice();
    } else if (o instanceof TypedArray)
      out = o.slice();
    else if (_isObj(o)) {
      out = {};
      for (let k in o) {
        if (k != __proto__)
          out[k] = copy2(o[k], _isObj);
      }
    } else
      out = o;
    return out;
  }
  function assign(targ) {
    let args = arguments;
    for (let i = 1; i < args.length; i++) {
      let src = args[i];
      for (let key in src) {
        if (key != __proto__) {
          if (isObj(targ[key]))
            assign(targ[key], copy2(src[key]));
          else
            targ[key] = copy2(src[key]);
        }
      }
    }
    return targ;
  }
  var NULL_REMOVE = 0;
  var NULL_RETAIN = 1;
  var NULL_EXPAND = 2;
  function nullExpand(yVals, nullIdxs, alignedLen) {
    for (let i = 0, xi, lastNullIdx = -1; i < nullIdxs.length; i++) {
      let nullIdx = nullIdxs[i];
      if (nullIdx > lastNullIdx) {
        xi = nullIdx - 1;
        while (xi >= 0 && yVals[xi] == null)
          yVals[xi--] = null;
        xi = nullIdx + 1;
        while (xi < alignedLen && yVals[xi] == null)
          yVals[lastNullIdx = xi++] = null;
      }
    }
  }
  function join(tables, nullModes) {
    if (allHeadersSame(tables)) {
      let table = tables[0].slice();
      for (let i = 1; i < tables.length; i++)
        table.push(...tables[i].slice(1));
      if (!isAsc(table[0]))
        table = sortCols(table);
      return table;
    }
    let xVals = /* @__PURE__ */ new Set();
    for (let ti = 0; ti < tables.length; ti++) {
      let t = tables[ti];
      let xs = t[0];
      let len = xs.length;
      for (let i = 0; i < len; i++)
        xVals.add(xs[i]);
    }
    let data = [Array.from(xVals).sort((a, b) => a - b)];
    let alignedLen = data[0].length;
    let xIdxs = /* @__PURE__ */ new Map();
    for (let i = 0; i < alignedLen; i++)
      xIdxs.set(data[0][i], i);
    for (let ti = 0; ti < tables.length; ti++) {
      let t = tables[ti];
      let xs = t[0];
      for (let si = 1; si < t.length; si++) {
        let ys = t[si];
        let yVals = Array(alignedLen).fill(void 0);
        let nullMode = nullModes ? nullModes[ti][si] : NULL_RETAIN;
        let nullIdxs = [];
        for (let i = 0; i < ys.length; i++) {
          let yVal = ys[i];
          let alignedIdx = xIdxs.get(xs[i]);
          if (yVal === null) {
            if (nullMode != NULL_REMOVE) {
              yVals[alignedIdx] = yVal;
              if (nullMode == NULL_EXPAND)
                nullIdxs.push(alignedIdx);
            }
          } else
            yVals[alignedIdx] = yVal;
        }
        nullExpand(yVals, nullIdxs, alignedLen);
        data.push(yVals);
      }
    }
    return data;
  }
  var microTask = typeof queueMicrotask == "undefined" ? (fn) => Promise.resolve().then(fn) : queueMicrotask;
  function sortCols(table) {
    let head = table[0];
    let rlen = head.length;
    let idxs = Array(rlen);
    for (let i = 0; i < idxs.length; i++)
      idxs[i] = i;
    idxs.sort((i0, i1) => head[i0] - head[i1]);
    let table2 = [];
    for (let i = 0; i < table.length; i++) {
      let row = table[i];
      let row2 = Array(rlen);
      for (let j = 0; j < rlen; j++)
        row2[j] = row[idxs[j]];
      table2.push(row2);
    }
    return table2;
  }
  function allHeadersSame(tables) {
    let vals0 = tables[0][0];
    let len0 = vals0.length;
    for (let i = 1; i < tables.length; i++) {
      let vals1 = tables[i][0];
      if (vals1.length != len0)
        return false;
      if (vals1 != vals0) {
        for (let j = 0; j < len0; j++) {
          if (vals1[j] != vals0[j])
            return false;
        }
      }
    }
    return true;
  }
  function isAsc(vals, samples = 100) {
    const len = vals.length;
    if (len <= 1)
      return true;
    let firstIdx = 0;
    let lastIdx = len - 1;
    while (firstIdx <= lastIdx && vals[firstIdx] == null)
      firstIdx++;
    while (lastIdx >= firstIdx && vals[lastIdx] == null)
      lastIdx--;
    if (lastIdx <= firstIdx)
      return true;
    const stride = max(1, floor((lastIdx - firstIdx + 1) / samples));
    for (let prevVal = vals[firstIdx], i = firstIdx + stride; i <= lastIdx; i += stride) {
      const v = vals[i];
      if (v != null) {
        if (v <= prevVal)
          return false;
        prevVal = v;
      }
    }
    return true;
  }
  var months = [
    "January",
    "February",
    "March",
    "April",
    "May",
    "June",
    "July",
    "August",
    "September",
    "October",
    "November",
    "December"
  ];
  var days = [
    "Sunday",
    "Monday",
    "Tuesday",
    "Wednesday",
    "Thursday",
    "Friday",
    "Saturday"
  ];
  function slice3(str) {
    return str.slice(0, 3);
  }
  var days3 = days.map(slice3);
  var months3 = months.map(slice3);
  var engNames = {
    MMMM: months,
    MMM: months3,
    WWWW: days,
    WWW: days3
  };
  function zeroPad2(int) {
    return (int < 10 ? "0" : "") + int;
  }
  function zeroPad3(int) {
    return (int < 10 ? "00" : int < 100 ? "0" : "") + int;
  }
  var subs = {
    // 2019
    YYYY: (d) => d.getFullYear(),
    // 19
    YY: (d) => (d.getFullYear() + "").slice(2),
    // July
    MMMM: (d, names) => names.MMMM[d.getMonth()],
    // Jul
    MMM: (d, names) => names.MMM[d.getMonth()],
    // 07
    MM: (d) => zeroPad2(d.getMonth() + 1),
    // 7
    M: (d) => d.getMonth() + 1,
    // 09
    DD: (d) => zeroPad2(d.getDate()),
    // 9
    D: (d) => d.getDate(),
    // Monday
    WWWW: (d, names) => names.WWWW[d.getDay()],
    // Mon
    WWW: (d, names) => names.WWW[d.getDay()],
    // 03
    HH: (d) => zeroPad2(d.getHours()),
    // 3
    H: (d) => d.getHours(),
    // 9 (12hr, unpadded)
    h: (d) => {
      let h = d.getHours();
      return h == 0 ? 12 : h > 12 ? h - 12 : h;
    },
    // AM
    AA: (d) => d.getHours() >= 12 ? "PM" : "AM",
    // am
    aa: (d) => d.getHours() >= 12 ? "pm" : "am",
    // a
    a: (d) => d.getHours() >= 12 ? "p" : "a",
    // 09
    mm: (d) => zeroPad2(d.getMinutes()),
    // 9
    m: (d) => d.getMinutes(),
    // 09
    ss: (d) => zeroPad2(d.getSeconds()),
    // 9
    s: (d) => d.getSeconds(),
    // 374
    fff: (d) => zeroPad3(d.getMilliseconds())
  };
  function fmtDate(tpl, names) {
    names = names || engNames;
    let parts = [];
    let R = /\{([a-z]+)\}|[^{]+/gi, m;
    while (m = R.exec(tpl))
      parts.push(m[0][0] == "{" ? subs[m[1]] : m[0]);
    return (d) => {
      let out = "";
      for (let i = 0; i < parts.length; i++)
        out += typeof parts[i] == "string" ? parts[i] : parts[i](d, names);
      return out;
    };
  }
  var localTz = new Intl.DateTimeFormat().resolvedOptions().timeZone;
  function tzDate(date, tz) {
    let date2;
    if (tz == "UTC" || tz == "Etc/UTC")
      date2 = new Date(+date + date.getTimezoneOffset() * 6e4);
    else if (tz == localTz)
      date2 = date;
    else {
      date2 = new Date(date.toLocaleString("en-US", { timeZone: tz }));
      date2.setMilliseconds(date.getMilliseconds());
    }
    return date2;
  }
  var onlyWhole = (v) => v % 1 == 0;
  var allMults = [1, 2, 2.5, 5];
  var decIncrs = genIncrs(10, -32, 0, allMults);
  var oneIncrs = genIncrs(10, 0, 32, allMults);
  var wholeIncrs = oneIncrs.filter(onlyWhole);
  var numIncrs = decIncrs.concat(oneIncrs);
  var NL = "\n";
  var yyyy = "{YYYY}";
  var NLyyyy = NL + yyyy;
  var md = "{M}/{D}";
  var NLmd = NL + md;
  var NLmdyy = NLmd + "/{YY}";
  var aa = "{aa}";
  var hmm = "{h}:{mm}";
  var hmmaa = hmm + aa;
  var NLhmmaa = NL + hmmaa;
  var ss = ":{ss}";
  var _ = null;
  function genTimeStuffs(ms) {
    let s = ms * 1e3, m = s * 60, h = m * 60, d = h * 24, mo = d * 30, y = d * 365;
    let subSecIncrs = ms == 1 ? genIncrs(10, 0, 3, allMults).filter(onlyWhole) : genIncrs(10, -3, 0, allMults);
    let timeIncrs = subSecIncrs.concat([
      // minute divisors (# of secs)
      s,
      s * 5,
      s * 10,
      s * 15,
      s * 30,
      // hour divisors (# of mins)
      m,
      m * 5,
      m * 10,
      m * 15,
      m * 30,
      // day divisors (# of hrs)
      h,
      h * 2,
      h * 3,
      h * 4,
      h * 6,
      h * 8,
      h * 12,
      // month divisors TODO: need more?
      d,
      d * 2,
      d * 3,
      d * 4,
      d * 5,
      d * 6,
      d * 7,
      d * 8,
      d * 9,
      d * 10,
      d * 15,
      // year divisors (# months, approx)
      mo,
      mo * 2,
      mo * 3,
      mo * 4,
      mo * 6,
      // century divisors
      y,
      y * 2,
      y * 5,
      y * 10,
      y * 25,
      y * 50,
      y * 100
    ]);
    const _timeAxisStamps = [
      //   tick incr    default          year                    month   day                   hour    min       sec   mode
      [y, yyyy, _, _, _, _, _, _, 1],
      [d * 28, "{MMM}", NLyyyy, _, _, _, _, _, 1],
      [d, md, NLyyyy, _, _, _, _, _, 1],
      [h, "{h}" + aa, NLmdyy, _, NLmd, _, _, _, 1],
      [m, hmmaa, NLmdyy, _, NLmd, _, _, _, 1],
      [s, ss, NLmdyy + " " + hmmaa, _, NLmd + " " + hmmaa, _, NLhmmaa, _, 1],
      [ms, ss + ".{fff}", NLmdyy + " " + hmmaa, _, NLmd + " " + hmmaa, _, NLhmmaa, _, 1]
    ];
    function timeAxisSplits(tzDate2) {
      return (self, axisIdx, scaleMin, scaleMax, foundIncr, foundSpace) => {
        let splits = [];
        let isYr = foundIncr >= y;
        let isMo = foundIncr >= mo && foundIncr < y;
        let minDate = tzDate2(scaleMin);
        let minDateTs = roundDec(minDate * ms, 3);
        let minMin = mkDate(minDate.getFullYear(), isYr ? 0 : minDate.getMonth(), isMo || isYr ? 1 : minDate.getDate());
        let minMinTs = roundDec(minMin * ms, 3);
        if (isMo || isYr) {
          let moIncr = isMo ? foundIncr / mo : 0;
          let yrIncr = isYr ? foundIncr / y : 0;
          let split = minDateTs == minMinTs ? minDateTs : roundDec(mkDate(minMin.getFullYear() + yrIncr, minMin.getMonth() + moIncr, 1) * ms, 3);
          let splitDate = new Date(round(split / ms));
          let baseYear = splitDate.getFullYear();
          let baseMonth = splitDate.getMonth();
          for (let i = 0; split <= scaleMax; i++) {
            let next = mkDate(baseYear + yrIncr * i, baseMonth + moIncr * i, 1);
            let offs = next - tzDate2(roundDec(next * ms, 3));
            split = roundDec((+next + offs) * ms, 3);
            if (split <= scaleMax)
              splits.push(split);
          }
        } else {
          let incr0 = foundIncr >= d ? d : foundIncr;
          let tzOffset = floor(scaleMin) - floor(minDateTs);
          let split = minMinTs + tzOffset + incrRoundUp(minDateTs - minMinTs, incr0);
          splits.push(split);
          let date0 = tzDate2(split);
          let prevHour = date0.getHours() + date0.getMinutes() / m + date0.getSeconds() / h;
          let incrHours = foundIncr / h;
          let minSpace = self.axes[axisIdx]._space;
          let pctSpace = foundSpace / minSpace;
          while (1) {
            split = roundDec(split + foundIncr, ms == 1 ? 0 : 3);
            if (split > scaleMax)
              break;
            if (incrHours > 1) {
              let expectedHour = floor(roundDec(prevHour + incrHours, 6)) % 24;
              let splitDate = tzDate2(split);
              let actualHour = splitDate.getHours();
              let dstShift = actualHour - expectedHour;
              if (dstShift > 1)
                dstShift = -1;
              split -= dstShift * h;
              prevHour = (prevHour + incrHours) % 24;
              let prevSplit = splits[splits.length - 1];
              let pctIncr = roundDec((split - prevSplit) / foundIncr, 3);
              if (pctIncr * pctSpace >= 0.7)
                splits.push(split);
            } else
              splits.push(split);
          }
        }
        return splits;
      };
    }
    return [
      timeIncrs,
      _timeAxisStamps,
      timeAxisSplits
    ];
  }
  var [timeIncrsMs, _timeAxisStampsMs, timeAxisSplitsMs] = genTimeStuffs(1);
  var [timeIncrsS, _timeAxisStampsS, timeAxisSplitsS] = genTimeStuffs(1e-3);
  genIncrs(2, -53, 53, [1]);
  function timeAxisStamps(stampCfg, fmtDate2) {
    return stampCfg.map((s) => s.map(
      (v, i) => i == 0 || i == 8 || v == null ? v : fmtDate2(i == 1 || s[8] == 0 ? v : s[1] + v)
    ));
  }
  function timeAxisVals(tzDate2, stamps) {
    return (self, splits, axisIdx, foundSpace, foundIncr) => {
      let s = stamps.find((s2) => foundIncr >= s2[0]) || stamps[stamps.length - 1];
      let prevYear;
      let prevMnth;
      let prevDate;
      let prevHour;
      let prevMins;
      let prevSecs;
      return splits.map((split) => {
        let date = tzDate2(split);
        let newYear = date.getFullYear();
        let newMnth = date.getMonth();
        let newDate = date.getDate();
        let newHour = date.getHours();
        let newMins = date.getMinutes();
        let newSecs = date.getSeconds();
        let stamp = newYear != prevYear && s[2] || newMnth != prevMnth && s[3] || newDate != prevDate && s[4] || newHour != prevHour && s[5] || newMins != prevMins && s[6] || newSecs != prevSecs && s[7] || s[1];
        prevYear = newYear;
        prevMnth = newMnth;
        prevDate = newDate;
        prevHour = newHour;
        prevMins = newMins;
        prevSecs = newSecs;
        return stamp(date);
      });
    };
  }
  function timeAxisVal(tzDate2, dateTpl) {
    let stamp = fmtDate(dateTpl);
    return (self, splits, axisIdx, foundSpace, foundIncr) => splits.map((split) => stamp(tzDate2(split)));
  }
  function mkDate(y, m, d) {
    return new Date(y, m, d);
  }
  function timeSeriesStamp(stampCfg, fmtDate2) {
    return fmtDate2(stampCfg);
  }
  var _timeSeriesStamp = "{YYYY}-{MM}-{DD} {h}:{mm}{aa}";
  function timeSeriesVal(tzDate2, stamp) {
    return (self, val, seriesIdx, dataIdx) => dataIdx == null ? LEGEND_DISP : stamp(tzDate2(val));
  }
  function legendStroke(self, seriesIdx) {
    let s = self.series[seriesIdx];
    return s.width ? s.stroke(self, seriesIdx) : s.points.width ? s.points.stroke(self, seriesIdx) : null;
  }
  function legendFill(self, seriesIdx) {
    return self.series[seriesIdx].fill(self, seriesIdx);
  }
  var legendOpts = {
    show: true,
    live: true,
    isolate: false,
    mount: noop,
    markers: {
      show: true,
      width: 2,
      stroke: legendStroke,
      fill: legendFill,
      dash: "solid"
    },
    idx: null,
    idxs: null,
    values: []
  };
  function cursorPointShow(self, si) {
    let o = self.cursor.points;
    let pt = placeDiv();
    let size = o.size(self, si);
    setStylePx(pt, WIDTH, size);
    setStylePx(pt, HEIGHT, size);
    let mar = size / -2;
    setStylePx(pt, "marginLeft", mar);
    setStylePx(pt, "marginTop", mar);
    let width = o.width(self, si, size);
    width && setStylePx(pt, "borderWidth", width);
    return pt;
  }
  function cursorPointFill(self, si) {
    let sp = self.series[si].points;
    return sp._fill || sp._stroke;
  }
  function cursorPointStroke(self, si) {
    let sp = self.series[si].points;
    return sp._stroke || sp._fill;
  }
  function cursorPointSize(self, si) {
    let sp = self.series[si].points;
    return sp.size;
  }
  var moveTuple = [0, 0];
  function cursorMove(self, mouseLeft1, mouseTop1) {
    moveTuple[0] = mouseLeft1;
    moveTuple[1] = mouseTop1;
    return moveTuple;
  }
  function filtBtn0(self, targ, handle, onlyTarg = true) {
    return (e) => {
      e.button == 0 && (!onlyTarg || e.target == targ) && handle(e);
    };
  }
  function filtTarg(self, targ, handle, onlyTarg = true) {
    return (e) => {
      (!onlyTarg || e.target == targ) && handle(e);
    };
  }
  var cursorOpts = {
    show: true,
    x: true,
    y: true,
    lock: false,
    move: cursorMove,
    points: {
      one: false,
      show: cursorPointShow,
      size: cursorPointSize,
      width: 0,
      stroke: cursorPointStroke,
      fill: cursorPointFill
    },
    bind: {
      mousedown: filtBtn0,
      mouseup: filtBtn0,
      click: filtBtn0,
      // legend clicks, not .u-over clicks
      dblclick: filtBtn0,
      mousemove: filtTarg,
      mouseleave: filtTarg,
      mouseenter: filtTarg
    },
    drag: {
      setScale: true,
      x: true,
      y: false,
      dist: 0,
      uni: null,
      click: (self, e) => {
        e.stopPropagation();
        e.stopImmediatePropagation();
      },
      _x: false,
      _y: false
    },
    focus: {
      dist: (self, seriesIdx, dataIdx, valPos, curPos) => valPos - curPos,
      prox: -1,
      bias: 0
    },
    hover: {
      skip: [void 0],
      prox: null,
      bias: 0
    },
    left: -10,
    top: -10,
    idx: null,
    dataIdx: null,
    idxs: null,
    event: null
  };
  var axisLines = {
    show: true,
    stroke: "rgba(0,0,0,0.07)",
    width: 2
    //	dash: [],
  };
  var grid = assign({}, axisLines, {
    filter: retArg1
  });
  var ticks = assign({}, grid, {
    size: 10
  });
  var border = assign({}, axisLines, {
    show: false
  });
  var font = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, "Noto Sans", sans-serif, "Apple Color Emoji", "Segoe UI Emoji", "Segoe UI Symbol", "Noto Color Emoji"';
  var labelFont = "bold " + font;
  var lineGap = 1.5;
  var xAxisOpts = {
    show: true,
    scale: "x",
    stroke: hexBlack,
    space: 50,
    gap: 5,
    alignTo: 1,
    size: 50,
    labelGap: 0,
    labelSize: 30,
    labelFont,
    side: 2,
    //	class: "x-vals",
    //	incrs: timeIncrs,
    //	values: timeVals,
    //	filter: retArg1,
    grid,
    ticks,
    border,
    font,
    lineGap,
    rotate: 0
  };
  var numSeriesLabel = "Value";
  var timeSeriesLabel = "Time";
  var xSeriesOpts = {
    show: true,
    scale: "x",
    auto: false,
    sorted: 1,
    //	label: "Time",
    //	value: v => stamp(new Date(v * 1e3)),
    // internal caches
    min: inf,
    max: -inf,
    idxs: []
  };
  function numAxisVals(self, splits, axisIdx, foundSpace, foundIncr) {
    return splits.map((v) => v == null ? "" : fmtNum(v));
  }
  function numAxisSplits(self, axisIdx, scaleMin, scaleMax, foundIncr, foundSpace, forceMin) {
    let splits = [];
    let numDec = fixedDec.get(foundIncr) || 0;
    scaleMin = forceMin ? scaleMin : roundDec(incrRoundUp(scaleMin, foundIncr), numDec);
    for (let val = scaleMin; val <= scaleMax; val = roundDec(val + foundIncr, numDec))
      splits.push(Object.is(val, -0) ? 0 : val);
    return splits;
  }
  function logAxisSplits(self, axisIdx, scaleMin, scaleMax, foundIncr, foundSpace, forceMin) {
    const splits = [];
    const logBase = self.scales[self.axes[axisIdx].scale].log;
    const logFn = logBase == 10 ? log10 : log2;
    const exp = floor(logFn(scaleMin));
    foundIncr = pow(logBase, exp);
    if (logBase == 10)
      foundIncr = numIncrs[closestIdx(foundIncr, numIncrs)];
    let split = scaleMin;
    let nextMagIncr = foundIncr * logBase;
    if (logBase == 10)
      nextMagIncr = numIncrs[closestIdx(nextMagIncr, numIncrs)];
    do {
      splits.push(split);
      split = split + foundIncr;
      if (logBase == 10 && !fixedDec.has(split))
        split = roundDec(split, fixedDec.get(foundIncr));
      if (split >= nextMagIncr) {
        foundIncr = split;
        nextMagIncr = foundIncr * logBase;
        if (logBase == 10)
          nextMagIncr = numIncrs[closestIdx(nextMagIncr, numIncrs)];
      }
    } while (split <= scaleMax);
    return splits;
  }
  function asinhAxisSplits(self, axisIdx, scaleMin, scaleMax, foundIncr, foundSpace, forceMin) {
    let sc = self.scales[self.axes[axisIdx].scale];
    let linthresh = sc.asinh;
    let posSplits = scaleMax > linthresh ? logAxisSplits(self, axisIdx, max(linthresh, scaleMin), scaleMax, foundIncr) : [linthresh];
    let zero = scaleMax >= 0 && scaleMin <= 0 ? [0] : [];
    let negSplits = scaleMin < -linthresh ? logAxisSplits(self, axisIdx, max(linthresh, -scaleMax), -scaleMin, foundIncr) : [linthresh];
    return negSplits.reverse().map((v) => -v).concat(zero, posSplits);
  }
  var RE_ALL = /./;
  var RE_12357 = /[12357]/;
  var RE_125 = /[125]/;
  var RE_1 = /1/;
  var _filt = (splits, distr, re, keepMod) => splits.map((v, i) => distr == 4 && v == 0 || i % keepMod == 0 && re.test(v.toExponential()[v < 0 ? 1 : 0]) ? v : null);
  function log10AxisValsFilt(self, splits, axisIdx, foundSpace, foundIncr) {
    let axis = self.axes[axisIdx];
    let scaleKey = axis.scale;
    let sc = self.scales[scaleKey];
    let valToPos = self.valToPos;
    let minSpace = axis._space;
    let _10 = valToPos(10, scaleKey);
    let re = valToPos(9, scaleKey) - _10 >= minSpace ? RE_ALL : valToPos(7, scaleKey) - _10 >= minSpace ? RE_12357 : valToPos(5, scaleKey) - _10 >= minSpace ? RE_125 : RE_1;
    if (re == RE_1) {
      let magSpace = abs(valToPos(1, scaleKey) - _10);
      if (magSpace < minSpace)
        return _filt(splits.slice().reverse(), sc.distr, re, ceil(minSpace / magSpace)).reverse();
    }
    return _filt(splits, sc.distr, re, 1);
  }
  function log2AxisValsFilt(self, splits, axisIdx, foundSpace, foundIncr) {
    let axis = self.axes[axisIdx];
    let scaleKey = axis.scale;
    let minSpace = axis._space;
    let valToPos = self.valToPos;
    let magSpace = abs(valToPos(1, scaleKey) - valToPos(2, scaleKey));
    if (magSpace < minSpace)
      return _filt(splits.slice().reverse(), 3, RE_ALL, ceil(minSpace / magSpace)).reverse();
    return splits;
  }
  function numSeriesVal(self, val, seriesIdx, dataIdx) {
    return dataIdx == null ? LEGEND_DISP : val == null ? "" : fmtNum(val);
  }
  var yAxisOpts = {
    show: true,
    scale: "y",
    stroke: hexBlack,
    space: 30,
    gap: 5,
    alignTo: 1,
    size: 50,
    labelGap: 0,
    labelSize: 30,
    labelFont,
    side: 3,
    //	class: "y-vals",
    //	incrs: numIncrs,
    //	values: (vals, space) => vals,
    //	filter: retArg1,
    grid,
    ticks,
    border,
    font,
    lineGap,
    rotate: 0
  };
  function ptDia(width, mult) {
    let dia = 3 + (width || 1) * 2;
    return roundDec(dia * mult, 3);
  }
  function seriesPointsShow(self, si) {
    let { scale, idxs } = self.series[0];
    let xData = self._data[0];
    let p0 = self.valToPos(xData[idxs[0]], scale, true);
    let p1 = self.valToPos(xData[idxs[1]], scale, true);
    let dim = abs(p1 - p0);
    let s = self.series[si];
    let maxPts = dim / (s.points.space * pxRatio);
    return idxs[1] - idxs[0] <= maxPts;
  }
  var facet = {
    scale: null,
    auto: true,
    sorted: 0,
    // internal caches
    min: inf,
    max: -inf
  };
  var gaps = (self, seriesIdx, idx0, idx1, nullGaps) => nullGaps;
  var xySeriesOpts = {
    show: true,
    auto: true,
    sorted: 0,
    gaps,
    alpha: 1,
    facets: [
      assign({}, facet, { scale: "x" }),
      assign({}, facet, { scale: "y" })
    ]
  };
  var ySeriesOpts = {
    scale: "y",
    auto: true,
    sorted: 0,
    show: true,
    spanGaps: false,
    gaps,
    alpha: 1,
    points: {
      show: seriesPointsShow,
      filter: null
      //  paths:
      //	stroke: "#000",
      //	fill: "#fff",
      //	width: 1,
      //	size: 10,
    },
    //	label: "Value",
    //	value: v => v,
    values: null,
    // internal caches
    min: inf,
    max: -inf,
    idxs: [],
    path: null,
    clip: null
  };
  function clampScale(self, val, scaleMin, scaleMax, scaleKey) {
    return scaleMin / 10;
  }
  var xScaleOpts = {
    time: FEAT_TIME,
    auto: true,
    distr: 1,
    log: 10,
    asinh: 1,
    min: null,
    max: null,
    dir: 1,
    ori: 0
  };
  var yScaleOpts = assign({}, xScaleOpts, {
    time: false,
    ori: 1
  });
  var syncs = {};
  function _sync(key, opts) {
    let s = syncs[key];
    if (!s) {
      s = {
        key,
        plots: [],
        sub(plot) {
          s.plots.push(plot);
        },
        unsub(plot) {
          s.plots = s.plots.filter((c) => c != plot);
        },
        pub(type, self, x, y, w, h, i) {
          for (let j = 0; j < s.plots.length; j++)
            s.plots[j] != self && s.plots[j].pub(type, self, x, y, w, h, i);
        }
      };
      if (key != null)
        syncs[key] = s;
    }
    return s;
  }
  var BAND_CLIP_FILL = 1 << 0;
  var BAND_CLIP_STROKE = 1 << 1;
  function orient(u, seriesIdx, cb) {
    const mode2 = u.mode;
    const series = u.series[seriesIdx];
    const data = mode2 == 2 ? u._data[seriesIdx] : u._data;
    const scales = u.scales;
    const bbox = u.bbox;
    let dx = data[0], dy = mode2 == 2 ? data[1] : data[seriesIdx], sx = mode2 == 2 ? scales[series.facets[0].scale] : scales[u.series[0].scale], sy = mode2 == 2 ? scales[series.facets[1].scale] : scales[series.scale], l = bbox.left, t = bbox.top, w = bbox.width, h = bbox.height, H = u.valToPosH, V = u.valToPosV;
    return sx.ori == 0 ? cb(
      series,
      dx,
      dy,
      sx,
      sy,
      H,
      V,
      l,
      t,
      w,
      h,
      moveToH,
      lineToH,
      rectH,
      arcH,
      bezierCurveToH
    ) : cb(
      series,
      dx,
      dy,
      sx,
      sy,
      V,
      H,
      t,
      l,
      h,
      w,
      moveToV,
      lineToV,
      rectV,
      arcV,
      bezierCurveToV
    );
  }
  function bandFillClipDirs(self, seriesIdx) {
    let fillDir = 0;
    let clipDirs = 0;
    let bands = ifNull(self.bands, EMPTY_ARR);
    for (let i = 0; i < bands.length; i++) {
      let b = bands[i];
      if (b.series[0] == seriesIdx)
        fillDir = b.dir;
      else if (b.series[1] == seriesIdx) {
        if (b.dir == 1)
          clipDirs |= 1;
        else
          clipDirs |= 2;
      }
    }
    return [
      fillDir,
      clipDirs == 1 ? -1 : (
        // neg only
        clipDirs == 2 ? 1 : (
          // pos only
          clipDirs == 3 ? 2 : (
            // both
            0
          )
        )
      )
    ];
  }
  function seriesFillTo(self, seriesIdx, dataMin, dataMax, bandFillDir) {
    let mode2 = self.mode;
    let series = self.series[seriesIdx];
    let scaleKey = mode2 == 2 ? series.facets[1].scale : series.scale;
    let scale = self.scales[scaleKey];
    return bandFillDir == -1 ? scale.min : bandFillDir == 1 ? scale.max : scale.distr == 3 ? scale.dir == 1 ? scale.min : scale.max : 0;
  }
  function clipBandLine(self, seriesIdx, idx0, idx1, strokePath, clipDir) {
    return orient(self, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
      let pxRound = series.pxRound;
      const dir = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
      const lineTo = scaleX.ori == 0 ? lineToH : lineToV;
      let frIdx, toIdx;
      if (dir == 1) {
        frIdx = idx0;
        toIdx = idx1;
      } else {
        frIdx = idx1;
        toIdx = idx0;
      }
      let x0 = pxRound(valToPosX(dataX[frIdx], scaleX, xDim, xOff));
      let y0 = pxRound(valToPosY(dataY[frIdx], scaleY, yDim, yOff));
      let x1 = pxRound(valToPosX(dataX[toIdx], scaleX, xDim, xOff));
      let yLimit = pxRound(valToPosY(clipDir == 1 ? scaleY.max : scaleY.min, scaleY, yDim, yOff));
      let clip = new Path2D(strokePath);
      lineTo(clip, x1, yLimit);
      lineTo(clip, x0, yLimit);
      lineTo(clip, x0, y0);
      return clip;
    });
  }
  function clipGaps(gaps2, ori, plotLft, plotTop, plotWid, plotHgt) {
    let clip = null;
    if (gaps2.length > 0) {
      clip = new Path2D();
      const rect2 = ori == 0 ? rectH : rectV;
      let prevGapEnd = plotLft;
      for (let i = 0; i < gaps2.length; i++) {
        let g = gaps2[i];
        if (g[1] > g[0]) {
          let w2 = g[0] - prevGapEnd;
          w2 > 0 && rect2(clip, prevGapEnd, plotTop, w2, plotTop + plotHgt);
          prevGapEnd = g[1];
        }
      }
      let w = plotLft + plotWid - prevGapEnd;
      let maxStrokeWidth = 10;
      w > 0 && rect2(clip, prevGapEnd, plotTop - maxStrokeWidth / 2, w, plotTop + plotHgt + maxStrokeWidth);
    }
    return clip;
  }
  function addGap(gaps2, fromX, toX) {
    let prevGap = gaps2[gaps2.length - 1];
    if (prevGap && prevGap[0] == fromX)
      prevGap[1] = toX;
    else
      gaps2.push([fromX, toX]);
  }
  function findGaps(xs, ys, idx0, idx1, dir, pixelForX, align) {
    let gaps2 = [];
    let len = xs.length;
    for (let i = dir == 1 ? idx0 : idx1; i >= idx0 && i <= idx1; i += dir) {
      let yVal = ys[i];
      if (yVal === null) {
        let fr = i, to = i;
        if (dir == 1) {
          while (++i <= idx1 && ys[i] === null)
            to = i;
        } else {
          while (--i >= idx0 && ys[i] === null)
            to = i;
        }
        let frPx = pixelForX(xs[fr]);
        let toPx = to == fr ? frPx : pixelForX(xs[to]);
        let fri2 = fr - dir;
        let frPx2 = align <= 0 && fri2 >= 0 && fri2 < len ? pixelForX(xs[fri2]) : frPx;
        frPx = frPx2;
        let toi2 = to + dir;
        let toPx2 = align >= 0 && toi2 >= 0 && toi2 < len ? pixelForX(xs[toi2]) : toPx;
        toPx = toPx2;
        if (toPx >= frPx)
          gaps2.push([frPx, toPx]);
      }
    }
    return gaps2;
  }
  function pxRoundGen(pxAlign) {
    return pxAlign == 0 ? retArg0 : pxAlign == 1 ? round : (v) => incrRound(v, pxAlign);
  }
  function rect(ori) {
    let moveTo = ori == 0 ? moveToH : moveToV;
    let arcTo = ori == 0 ? (p, x1, y1, x2, y2, r) => {
      p.arcTo(x1, y1, x2, y2, r);
    } : (p, y1, x1, y2, x2, r) => {
      p.arcTo(x1, y1, x2, y2, r);
    };
    let rect2 = ori == 0 ? (p, x, y, w, h) => {
      p.rect(x, y, w, h);
    } : (p, y, x, h, w) => {
      p.rect(x, y, w, h);
    };
    return (p, x, y, w, h, endRad = 0, baseRad = 0) => {
      if (endRad == 0 && baseRad == 0)
        rect2(p, x, y, w, h);
      else {
        endRad = min(endRad, w / 2, h / 2);
        baseRad = min(baseRad, w / 2, h / 2);
        moveTo(p, x + endRad, y);
        arcTo(p, x + w, y, x + w, y + h, endRad);
        arcTo(p, x + w, y + h, x, y + h, baseRad);
        arcTo(p, x, y + h, x, y, baseRad);
        arcTo(p, x, y, x + w, y, endRad);
        p.closePath();
      }
    };
  }
  var moveToH = (p, x, y) => {
    p.moveTo(x, y);
  };
  var moveToV = (p, y, x) => {
    p.moveTo(x, y);
  };
  var lineToH = (p, x, y) => {
    p.lineTo(x, y);
  };
  var lineToV = (p, y, x) => {
    p.lineTo(x, y);
  };
  var rectH = rect(0);
  var rectV = rect(1);
  var arcH = (p, x, y, r, startAngle, endAngle) => {
    p.arc(x, y, r, startAngle, endAngle);
  };
  var arcV = (p, y, x, r, startAngle, endAngle) => {
    p.arc(x, y, r, startAngle, endAngle);
  };
  var bezierCurveToH = (p, bp1x, bp1y, bp2x, bp2y, p2x, p2y) => {
    p.bezierCurveTo(bp1x, bp1y, bp2x, bp2y, p2x, p2y);
  };
  var bezierCurveToV = (p, bp1y, bp1x, bp2y, bp2x, p2y, p2x) => {
    p.bezierCurveTo(bp1x, bp1y, bp2x, bp2y, p2x, p2y);
  };
  function points(opts) {
    return (u, seriesIdx, idx0, idx1, filtIdxs) => {
      return orient(u, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
        let { pxRound, points: points2 } = series;
        let moveTo, arc;
        if (scaleX.ori == 0) {
          moveTo = moveToH;
          arc = arcH;
        } else {
          moveTo = moveToV;
          arc = arcV;
        }
        const width = roundDec(points2.width * pxRatio, 3);
        let rad = (points2.size - points2.width) / 2 * pxRatio;
        let dia = roundDec(rad * 2, 3);
        let fill = new Path2D();
        let clip = new Path2D();
        let { left: lft, top, width: wid, height: hgt } = u.bbox;
        rectH(
          clip,
          lft - dia,
          top - dia,
          wid + dia * 2,
          hgt + dia * 2
        );
        const drawPoint = (pi) => {
          if (dataY[pi] != null) {
            let x = pxRound(valToPosX(dataX[pi], scaleX, xDim, xOff));
            let y = pxRound(valToPosY(dataY[pi], scaleY, yDim, yOff));
            moveTo(fill, x + rad, y);
            arc(fill, x, y, rad, 0, PI * 2);
          }
        };
        if (filtIdxs)
          filtIdxs.forEach(drawPoint);
        else {
          for (let pi = idx0; pi <= idx1; pi++)
            drawPoint(pi);
        }
        return {
          stroke: width > 0 ? fill : null,
          fill,
          clip,
          flags: BAND_CLIP_FILL | BAND_CLIP_STROKE
        };
      });
    };
  }
  function _drawAcc(lineTo) {
    return (stroke, accX, minY, maxY, inY, outY) => {
      if (minY != maxY) {
        if (inY != minY && outY != minY)
          lineTo(stroke, accX, minY);
        if (inY != maxY && outY != maxY)
          lineTo(stroke, accX, maxY);
        lineTo(stroke, accX, outY);
      }
    };
  }
  var drawAccH = _drawAcc(lineToH);
  var drawAccV = _drawAcc(lineToV);
  function linear(opts) {
    const alignGaps = ifNull(opts?.alignGaps, 0);
    return (u, seriesIdx, idx0, idx1) => {
      return orient(u, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
        [idx0, idx1] = nonNullIdxs(dataY, idx0, idx1);
        let pxRound = series.pxRound;
        let pixelForX = (val) => pxRound(valToPosX(val, scaleX, xDim, xOff));
        let pixelForY = (val) => pxRound(valToPosY(val, scaleY, yDim, yOff));
        let lineTo, drawAcc;
        if (scaleX.ori == 0) {
          lineTo = lineToH;
          drawAcc = drawAccH;
        } else {
          lineTo = lineToV;
          drawAcc = drawAccV;
        }
        const dir = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
        const _paths = { stroke: new Path2D(), fill: null, clip: null, band: null, gaps: null, flags: BAND_CLIP_FILL };
        const stroke = _paths.stroke;
        let hasGap = false;
        const decimate = idx1 - idx0 >= xDim * 4;
        if (decimate) {
          let xForPixel = (pos) => u.posToVal(pos, scaleX.key, true);
          let minY = null, maxY = null, inY, outY, drawnAtX;
          let accX = pixelForX(dataX[dir == 1 ? idx0 : idx1]);
          let idx0px = pixelForX(dataX[idx0]);
          let idx1px = pixelForX(dataX[idx1]);
          let nextAccXVal = xForPixel(dir == 1 ? idx0px + 1 : idx1px - 1);
          for (let i = dir == 1 ? idx0 : idx1; i >= idx0 && i <= idx1; i += dir) {
            let xVal = dataX[i];
            let reuseAccX = dir == 1 ? xVal < nextAccXVal : xVal > nextAccXVal;
            let x = reuseAccX ? accX : pixelForX(xVal);
            let yVal = dataY[i];
            if (x == accX) {
              if (yVal != null) {
                outY = yVal;
                if (minY == null) {
                  lineTo(stroke, x, pixelForY(outY));
                  inY = minY = maxY = outY;
                } else {
                  if (outY < minY)
                    minY = outY;
                  else if (outY > maxY)
                    maxY = outY;
                }
              } else {
                if (yVal === null)
                  hasGap = true;
              }
            } else {
              if (minY != null)
                drawAcc(stroke, accX, pixelForY(minY), pixelForY(maxY), pixelForY(inY), pixelForY(outY));
              if (yVal != null) {
                outY = yVal;
                lineTo(stroke, x, pixelForY(outY));
                minY = maxY = inY = outY;
              } else {
                minY = maxY = null;
                if (yVal === null)
                  hasGap = true;
              }
              accX = x;
              nextAccXVal = xForPixel(accX + dir);
            }
          }
          if (minY != null && minY != maxY && drawnAtX != accX)
            drawAcc(stroke, accX, pixelForY(minY), pixelForY(maxY), pixelForY(inY), pixelForY(outY));
        } else {
          for (let i = dir == 1 ? idx0 : idx1; i >= idx0 && i <= idx1; i += dir) {
            let yVal = dataY[i];
            if (yVal === null)
              hasGap = true;
            else if (yVal != null)
              lineTo(stroke, pixelForX(dataX[i]), pixelForY(yVal));
          }
        }
        let [bandFillDir, bandClipDir] = bandFillClipDirs(u, seriesIdx);
        if (series.fill != null || bandFillDir != 0) {
          let fill = _paths.fill = new Path2D(stroke);
          let fillToVal = series.fillTo(u, seriesIdx, series.min, series.max, bandFillDir);
          let fillToY = pixelForY(fillToVal);
          let frX = pixelForX(dataX[idx0]);
          let toX = pixelForX(dataX[idx1]);
          if (dir == -1)
            [toX, frX] = [frX, toX];
          lineTo(fill, toX, fillToY);
          lineTo(fill, frX, fillToY);
        }
        if (!series.spanGaps) {
          let gaps2 = [];
          hasGap && gaps2.push(...findGaps(dataX, dataY, idx0, idx1, dir, pixelForX, alignGaps));
          _paths.gaps = gaps2 = series.gaps(u, seriesIdx, idx0, idx1, gaps2);
          _paths.clip = clipGaps(gaps2, scaleX.ori, xOff, yOff, xDim, yDim);
        }
        if (bandClipDir != 0) {
          _paths.band = bandClipDir == 2 ? [
            clipBandLine(u, seriesIdx, idx0, idx1, stroke, -1),
            clipBandLine(u, seriesIdx, idx0, idx1, stroke, 1)
          ] : clipBandLine(u, seriesIdx, idx0, idx1, stroke, bandClipDir);
        }
        return _paths;
      });
    };
  }
  function stepped(opts) {
    const align = ifNull(opts.align, 1);
    const ascDesc = ifNull(opts.ascDesc, false);
    const alignGaps = ifNull(opts.alignGaps, 0);
    const extend = ifNull(opts.extend, false);
    return (u, seriesIdx, idx0, idx1) => {
      return orient(u, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
        [idx0, idx1] = nonNullIdxs(dataY, idx0, idx1);
        let pxRound = series.pxRound;
        let { left, width } = u.bbox;
        let pixelForX = (val) => pxRound(valToPosX(val, scaleX, xDim, xOff));
        let pixelForY = (val) => pxRound(valToPosY(val, scaleY, yDim, yOff));
        let lineTo = scaleX.ori == 0 ? lineToH : lineToV;
        const _paths = { stroke: new Path2D(), fill: null, clip: null, band: null, gaps: null, flags: BAND_CLIP_FILL };
        const stroke = _paths.stroke;
        const dir = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
        let prevYPos = pixelForY(dataY[dir == 1 ? idx0 : idx1]);
        let firstXPos = pixelForX(dataX[dir == 1 ? idx0 : idx1]);
        let prevXPos = firstXPos;
        let firstXPosExt = firstXPos;
        if (extend && align == -1) {
          firstXPosExt = left;
          lineTo(stroke, firstXPosExt, prevYPos);
        }
        lineTo(stroke, firstXPos, prevYPos);
        for (let i = dir == 1 ? idx0 : idx1; i >= idx0 && i <= idx1; i += dir) {
          let yVal1 = dataY[i];
          if (yVal1 == null)
            continue;
          let x1 = pixelForX(dataX[i]);
          let y1 = pixelForY(yVal1);
          if (align == 1)
            lineTo(stroke, x1, prevYPos);
          else
            lineTo(stroke, prevXPos, y1);
          lineTo(stroke, x1, y1);
          prevYPos = y1;
          prevXPos = x1;
        }
        let prevXPosExt = prevXPos;
        if (extend && align == 1) {
          prevXPosExt = left + width;
          lineTo(stroke, prevXPosExt, prevYPos);
        }
        let [bandFillDir, bandClipDir] = bandFillClipDirs(u, seriesIdx);
        if (series.fill != null || bandFillDir != 0) {
          let fill = _paths.fill = new Path2D(stroke);
          let fillTo = series.fillTo(u, seriesIdx, series.min, series.max, bandFillDir);
          let fillToY = pixelForY(fillTo);
          lineTo(fill, prevXPosExt, fillToY);
          lineTo(fill, firstXPosExt, fillToY);
        }
        if (!series.spanGaps) {
          let gaps2 = [];
          gaps2.push(...findGaps(dataX, dataY, idx0, idx1, dir, pixelForX, alignGaps));
          let halfStroke = series.width * pxRatio / 2;
          let startsOffset = ascDesc || align == 1 ? halfStroke : -halfStroke;
          let endsOffset = ascDesc || align == -1 ? -halfStroke : halfStroke;
          gaps2.forEach((g) => {
            g[0] += startsOffset;
            g[1] += endsOffset;
          });
          _paths.gaps = gaps2 = series.gaps(u, seriesIdx, idx0, idx1, gaps2);
          _paths.clip = clipGaps(gaps2, scaleX.ori, xOff, yOff, xDim, yDim);
        }
        if (bandClipDir != 0) {
          _paths.band = bandClipDir == 2 ? [
            clipBandLine(u, seriesIdx, idx0, idx1, stroke, -1),
            clipBandLine(u, seriesIdx, idx0, idx1, stroke, 1)
          ] : clipBandLine(u, seriesIdx, idx0, idx1, stroke, bandClipDir);
        }
        return _paths;
      });
    };
  }
  function findColWidth(dataX, dataY, valToPosX, scaleX, xDim, xOff, colWid = inf) {
    if (dataX.length > 1) {
      let prevIdx = null;
      for (let i = 0, minDelta = Infinity; i < dataX.length; i++) {
        if (dataY[i] !== void 0) {
          if (prevIdx != null) {
            let delta = abs(dataX[i] - dataX[prevIdx]);
            if (delta < minDelta) {
              minDelta = delta;
              colWid = abs(valToPosX(dataX[i], scaleX, xDim, xOff) - valToPosX(dataX[prevIdx], scaleX, xDim, xOff));
            }
          }
          prevIdx = i;
        }
      }
    }
    return colWid;
  }
  function bars(opts) {
    opts = opts || EMPTY_OBJ;
    const size = ifNull(opts.size, [0.6, inf, 1]);
    const align = opts.align || 0;
    const _extraGap = opts.gap || 0;
    let ro = opts.radius;
    ro = // [valueRadius, baselineRadius]
    ro == null ? [0, 0] : typeof ro == "number" ? [ro, 0] : ro;
    const radiusFn = fnOrSelf(ro);
    const gapFactor = 1 - size[0];
    const _maxWidth = ifNull(size[1], inf);
    const _minWidth = ifNull(size[2], 1);
    const disp = ifNull(opts.disp, EMPTY_OBJ);
    const _each = ifNull(opts.each, (_2) => {
    });
    const { fill: dispFills, stroke: dispStrokes } = disp;
    return (u, seriesIdx, idx0, idx1) => {
      return orient(u, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
        let pxRound = series.pxRound;
        let _align = align;
        let extraGap = _extraGap * pxRatio;
        let maxWidth = _maxWidth * pxRatio;
        let minWidth = _minWidth * pxRatio;
        let valRadius, baseRadius;
        if (scaleX.ori == 0)
          [valRadius, baseRadius] = radiusFn(u, seriesIdx);
        else
          [baseRadius, valRadius] = radiusFn(u, seriesIdx);
        const _dirX = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
        let rect2 = scaleX.ori == 0 ? rectH : rectV;
        let each = scaleX.ori == 0 ? _each : (u2, seriesIdx2, i, top, lft, hgt, wid) => {
          _each(u2, seriesIdx2, i, lft, top, wid, hgt);
        };
        let band = ifNull(u.bands, EMPTY_ARR).find((b) => b.series[0] == seriesIdx);
        let fillDir = band != null ? band.dir : 0;
        let fillTo = series.fillTo(u, seriesIdx, series.min, series.max, fillDir);
        let fillToY = pxRound(valToPosY(fillTo, scaleY, yDim, yOff));
        let xShift, barWid, fullGap, colWid = xDim;
        let strokeWidth = pxRound(series.width * pxRatio);
        let multiPath = false;
        let fillColors = null;
        let fillPaths = null;
        let strokeColors = null;
        let strokePaths = null;
        if (dispFills != null && (strokeWidth == 0 || dispStrokes != null)) {
          multiPath = true;
          fillColors = dispFills.values(u, seriesIdx, idx0, idx1);
          fillPaths = /* @__PURE__ */ new Map();
          new Set(fillColors).forEach((color) => {
            if (color != null)
              fillPaths.set(color, new Path2D());
          });
          if (strokeWidth > 0) {
            strokeColors = dispStrokes.values(u, seriesIdx, idx0, idx1);
            strokePaths = /* @__PURE__ */ new Map();
            new Set(strokeColors).forEach((color) => {
              if (color != null)
                strokePaths.set(color, new Path2D());
            });
          }
        }
        let { x0, size: size2 } = disp;
        if (x0 != null && size2 != null) {
          _align = 1;
          dataX = x0.values(u, seriesIdx, idx0, idx1);
          if (x0.unit == 2)
            dataX = dataX.map((pct) => u.posToVal(xOff + pct * xDim, scaleX.key, true));
          let sizes = size2.values(u, seriesIdx, idx0, idx1);
          if (size2.unit == 2)
            barWid = sizes[0] * xDim;
          else
            barWid = valToPosX(sizes[0], scaleX, xDim, xOff) - valToPosX(0, scaleX, xDim, xOff);
          colWid = findColWidth(dataX, dataY, valToPosX, scaleX, xDim, xOff, colWid);
          let gapWid = colWid - barWid;
          fullGap = gapWid + extraGap;
        } else {
          colWid = findColWidth(dataX, dataY, valToPosX, scaleX, xDim, xOff, colWid);
          let gapWid = colWid * gapFactor;
          fullGap = gapWid + extraGap;
          barWid = colWid - fullGap;
        }
        if (fullGap < 1)
          fullGap = 0;
        if (strokeWidth >= barWid / 2)
          strokeWidth = 0;
        if (fullGap < 5)
          pxRound = retArg0;
        let insetStroke = fullGap > 0;
        let rawBarWid = colWid - fullGap - (insetStroke ? strokeWidth : 0);
        barWid = pxRound(clamp(rawBarWid, minWidth, maxWidth));
        xShift = (_align == 0 ? barWid / 2 : _align == _dirX ? 0 : barWid) - _align * _dirX * ((_align == 0 ? extraGap / 2 : 0) + (insetStroke ? strokeWidth / 2 : 0));
        const _paths = { stroke: null, fill: null, clip: null, band: null, gaps: null, flags: 0 };
        const stroke = multiPath ? null : new Path2D();
        let dataY0 = null;
        if (band != null)
          dataY0 = u.data[band.series[1]];
        else {
          let { y0, y1 } = disp;
          if (y0 != null && y1 != null) {
            dataY = y1.values(u, seriesIdx, idx0, idx1);
            dataY0 = y0.values(u, seriesIdx, idx0, idx1);
          }
        }
        let radVal = valRadius * barWid;
        let radBase = baseRadius * barWid;
        for (let i = _dirX == 1 ? idx0 : idx1; i >= idx0 && i <= idx1; i += _dirX) {
          let yVal = dataY[i];
          if (yVal == null)
            continue;
          if (dataY0 != null) {
            let yVal0 = dataY0[i] ?? 0;
            if (yVal - yVal0 == 0)
              continue;
            fillToY = valToPosY(yVal0, scaleY, yDim, yOff);
          }
          let xVal = scaleX.distr != 2 || disp != null ? dataX[i] : i;
          let xPos = valToPosX(xVal, scaleX, xDim, xOff);
          let yPos = valToPosY(ifNull(yVal, fillTo), scaleY, yDim, yOff);
          let lft = pxRound(xPos - xShift);
          let btm = pxRound(max(yPos, fillToY));
          let top = pxRound(min(yPos, fillToY));
          let barHgt = btm - top;
          if (yVal != null) {
            let rv = yVal < 0 ? radBase : radVal;
            let rb = yVal < 0 ? radVal : radBase;
            if (multiPath) {
              if (strokeWidth > 0 && strokeColors[i] != null)
                rect2(strokePaths.get(strokeColors[i]), lft, top + floor(strokeWidth / 2), barWid, max(0, barHgt - strokeWidth), rv, rb);
              if (fillColors[i] != null)
                rect2(fillPaths.get(fillColors[i]), lft, top + floor(strokeWidth / 2), barWid, max(0, barHgt - strokeWidth), rv, rb);
            } else
              rect2(stroke, lft, top + floor(strokeWidth / 2), barWid, max(0, barHgt - strokeWidth), rv, rb);
            each(
              u,
              seriesIdx,
              i,
              lft - strokeWidth / 2,
              top,
              barWid + strokeWidth,
              barHgt
            );
          }
        }
        if (strokeWidth > 0)
          _paths.stroke = multiPath ? strokePaths : stroke;
        else if (!multiPath) {
          _paths._fill = series.width == 0 ? series._fill : series._stroke ?? series._fill;
          _paths.width = 0;
        }
        _paths.fill = multiPath ? fillPaths : stroke;
        return _paths;
      });
    };
  }
  function splineInterp(interp, opts) {
    const alignGaps = ifNull(opts?.alignGaps, 0);
    return (u, seriesIdx, idx0, idx1) => {
      return orient(u, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
        [idx0, idx1] = nonNullIdxs(dataY, idx0, idx1);
        let pxRound = series.pxRound;
        let pixelForX = (val) => pxRound(valToPosX(val, scaleX, xDim, xOff));
        let pixelForY = (val) => pxRound(valToPosY(val, scaleY, yDim, yOff));
        let moveTo, bezierCurveTo, lineTo;
        if (scaleX.ori == 0) {
          moveTo = moveToH;
          lineTo = lineToH;
          bezierCurveTo = bezierCurveToH;
        } else {
          moveTo = moveToV;
          lineTo = lineToV;
          bezierCurveTo = bezierCurveToV;
        }
        const dir = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
        let firstXPos = pixelForX(dataX[dir == 1 ? idx0 : idx1]);
        let prevXPos = firstXPos;
        let xCoords = [];
        let yCoords = [];
        for (let i = dir == 1 ? idx0 : idx1; i >= idx0 && i <= idx1; i += dir) {
          let yVal = dataY[i];
          if (yVal != null) {
            let xVal = dataX[i];
            let xPos = pixelForX(xVal);
            xCoords.push(prevXPos = xPos);
            yCoords.push(pixelForY(dataY[i]));
          }
        }
        const _paths = { stroke: interp(xCoords, yCoords, moveTo, lineTo, bezierCurveTo, pxRound), fill: null, clip: null, band: null, gaps: null, flags: BAND_CLIP_FILL };
        const stroke = _paths.stroke;
        let [bandFillDir, bandClipDir] = bandFillClipDirs(u, seriesIdx);
        if (series.fill != null || bandFillDir != 0) {
          let fill = _paths.fill = new Path2D(stroke);
          let fillTo = series.fillTo(u, seriesIdx, series.min, series.max, bandFillDir);
          let fillToY = pixelForY(fillTo);
          lineTo(fill, prevXPos, fillToY);
          lineTo(fill, firstXPos, fillToY);
        }
        if (!series.spanGaps) {
          let gaps2 = [];
          gaps2.push(...findGaps(dataX, dataY, idx0, idx1, dir, pixelForX, alignGaps));
          _paths.gaps = gaps2 = series.gaps(u, seriesIdx, idx0, idx1, gaps2);
          _paths.clip = clipGaps(gaps2, scaleX.ori, xOff, yOff, xDim, yDim);
        }
        if (bandClipDir != 0) {
          _paths.band = bandClipDir == 2 ? [
            clipBandLine(u, seriesIdx, idx0, idx1, stroke, -1),
            clipBandLine(u, seriesIdx, idx0, idx1, stroke, 1)
          ] : clipBandLine(u, seriesIdx, idx0, idx1, stroke, bandClipDir);
        }
        return _paths;
      });
    };
  }
  function monotoneCubic(opts) {
    return splineInterp(_monotoneCubic, opts);
  }
  function _monotoneCubic(xs, ys, moveTo, lineTo, bezierCurveTo, pxRound) {
    const n = xs.length;
    if (n < 2)
      return null;
    const path = new Path2D();
    moveTo(path, xs[0], ys[0]);
    if (n == 2)
      lineTo(path, xs[1], ys[1]);
    else {
      let ms = Array(n), ds = Array(n - 1), dys = Array(n - 1), dxs = Array(n - 1);
      for (let i = 0; i < n - 1; i++) {
        dys[i] = ys[i + 1] - ys[i];
        dxs[i] = xs[i + 1] - xs[i];
        ds[i] = dys[i] / dxs[i];
      }
      ms[0] = ds[0];
      for (let i = 1; i < n - 1; i++) {
        if (ds[i] === 0 || ds[i - 1] === 0 || ds[i - 1] > 0 !== ds[i] > 0)
          ms[i] = 0;
        else {
          ms[i] = 3 * (dxs[i - 1] + dxs[i]) / ((2 * dxs[i] + dxs[i - 1]) / ds[i - 1] + (dxs[i] + 2 * dxs[i - 1]) / ds[i]);
          if (!isFinite(ms[i]))
            ms[i] = 0;
        }
      }
      ms[n - 1] = ds[n - 2];
      for (let i = 0; i < n - 1; i++) {
        bezierCurveTo(
          path,
          xs[i] + dxs[i] / 3,
          ys[i] + ms[i] * dxs[i] / 3,
          xs[i + 1] - dxs[i] / 3,
          ys[i + 1] - ms[i + 1] * dxs[i] / 3,
          xs[i + 1],
          ys[i + 1]
        );
      }
    }
    return path;
  }
  var cursorPlots = /* @__PURE__ */ new Set();
  function invalidateRects() {
    for (let u of cursorPlots)
      u.syncRect(true);
  }
  if (domEnv) {
    on(resize, win, invalidateRects);
    on(scroll, win, invalidateRects, true);
    on(dppxchange, win, () => {
      uPlot.pxRatio = pxRatio;
    });
  }
  var linearPath = linear();
  var pointsPath = points();
  function setDefaults(d, xo, yo, initY) {
    let d2 = initY ? [d[0], d[1]].concat(d.slice(2)) : [d[0]].concat(d.slice(1));
    return d2.map((o, i) => setDefault(o, i, xo, yo));
  }
  function setDefaults2(d, xyo) {
    return d.map((o, i) => i == 0 ? {} : assign({}, xyo, o));
  }
  function setDefault(o, i, xo, yo) {
    return assign({}, i == 0 ? xo : yo, o);
  }
  function snapNumX(self, dataMin, dataMax) {
    return dataMin == null ? nullNullTuple : [dataMin, dataMax];
  }
  var snapTimeX = snapNumX;
  function snapNumY(self, dataMin, dataMax) {
    return dataMin == null ? nullNullTuple : rangeNum(dataMin, dataMax, rangePad, true);
  }
  function snapLogY(self, dataMin, dataMax, scale) {
    return dataMin == null ? nullNullTuple : rangeLog(dataMin, dataMax, self.scales[scale].log, false);
  }
  var snapLogX = snapLogY;
  function snapAsinhY(self, dataMin, dataMax, scale) {
    return dataMin == null ? nullNullTuple : rangeAsinh(dataMin, dataMax, self.scales[scale].log, false);
  }
  var snapAsinhX = snapAsinhY;
  function findIncr(minVal, maxVal, incrs, dim, minSpace) {
    let intDigits = max(numIntDigits(minVal), numIntDigits(maxVal));
    let delta = maxVal - minVal;
    let incrIdx = closestIdx(minSpace / dim * delta, incrs);
    do {
      let foundIncr = incrs[incrIdx];
      let foundSpace = dim * foundIncr / delta;
      if (foundSpace >= minSpace && intDigits + (foundIncr < 5 ? fixedDec.get(foundIncr) : 0) <= 17)
        return [foundIncr, foundSpace];
    } while (++incrIdx < incrs.length);
    return [0, 0];
  }
  function pxRatioFont(font2) {
    let fontSize, fontSizeCss;
    font2 = font2.replace(/(\d+)px/, (m, p1) => (fontSize = round((fontSizeCss = +p1) * pxRatio)) + "px");
    return [font2, fontSize, fontSizeCss];
  }
  function syncFontSize(axis) {
    if (axis.show) {
      [axis.font, axis.labelFont].forEach((f) => {
        let size = roundDec(f[2] * pxRatio, 1);
        f[0] = f[0].replace(/[0-9.]+px/, size + "px");
        f[1] = size;
      });
    }
  }
  function uPlot(opts, data, then) {
    const self = {
      mode: ifNull(opts.mode, 1)
    };
    const mode2 = self.mode;
    function getHPos(val, scale, dim, off2) {
      let pct = scale.valToPct(val);
      return off2 + dim * (scale.dir == -1 ? 1 - pct : pct);
    }
    function getVPos(val, scale, dim, off2) {
      let pct = scale.valToPct(val);
      return off2 + dim * (scale.dir == -1 ? pct : 1 - pct);
    }
    function getPos(val, scale, dim, off2) {
      return scale.ori == 0 ? getHPos(val, scale, dim, off2) : getVPos(val, scale, dim, off2);
    }
    self.valToPosH = getHPos;
    self.valToPosV = getVPos;
    let ready = false;
    self.status = 0;
    const root = self.root = placeDiv(UPLOT);
    if (opts.id != null)
      root.id = opts.id;
    addClass(root, opts.class);
    if (opts.title) {
      let title = placeDiv(TITLE, root);
      title.textContent = opts.title;
    }
    const can = placeTag("canvas");
    const ctx = self.ctx = can.getContext("2d");
    const wrap = placeDiv(WRAP, root);
    on("click", wrap, (e) => {
      if (e.target === over) {
        let didDrag = mouseLeft1 != mouseLeft0 || mouseTop1 != mouseTop0;
        didDrag && drag.click(self, e);
      }
    }, true);
    const under = self.under = placeDiv(UNDER, wrap);
    wrap.appendChild(can);
    const over = self.over = placeDiv(OVER, wrap);
    opts = copy2(opts);
    const pxAlign = +ifNull(opts.pxAlign, 1);
    const pxRound = pxRoundGen(pxAlign);
    (opts.plugins || []).forEach((p) => {
      if (p.opts)
        opts = p.opts(self, opts) || opts;
    });
    const ms = opts.ms || 1e-3;
    const series = self.series = mode2 == 1 ? setDefaults(opts.series || [], xSeriesOpts, ySeriesOpts, false) : setDefaults2(opts.series || [null], xySeriesOpts);
    const axes = self.axes = setDefaults(opts.axes || [], xAxisOpts, yAxisOpts, true);
    const scales = self.scales = {};
    const bands = self.bands = opts.bands || [];
    bands.forEach((b) => {
      b.fill = fnOrSelf(b.fill || null);
      b.dir = ifNull(b.dir, -1);
    });
    const xScaleKey = mode2 == 2 ? series[1].facets[0].scale : series[0].scale;
    const drawOrderMap = {
      axes: drawAxesGrid,
      series: drawSeries
    };
    const drawOrder = (opts.drawOrder || ["axes", "series"]).map((key2) => drawOrderMap[key2]);
    function initValToPct(sc) {
      const getVal = sc.distr == 3 ? (val) => log10(val > 0 ? val : sc.clamp(self, val, sc.min, sc.max, sc.key)) : sc.distr == 4 ? (val) => asinh(val, sc.asinh) : sc.distr == 100 ? (val) => sc.fwd(val) : (val) => val;
      return (val) => {
        let _val = getVal(val);
        let { _min, _max } = sc;
        let delta = _max - _min;
        return (_val - _min) / delta;
      };
    }
    function initScale(scaleKey) {
      let sc = scales[scaleKey];
      if (sc == null) {
        let scaleOpts = (opts.scales || EMPTY_OBJ)[scaleKey] || EMPTY_OBJ;
        if (scaleOpts.from != null) {
          initScale(scaleOpts.from);
          let sc2 = assign({}, scales[scaleOpts.from], scaleOpts, { key: scaleKey });
          sc2.valToPct = initValToPct(sc2);
          scales[scaleKey] = sc2;
        } else {
          sc = scales[scaleKey] = assign({}, scaleKey == xScaleKey ? xScaleOpts : yScaleOpts, scaleOpts);
          sc.key = scaleKey;
          let isTime = sc.time;
          let rn = sc.range;
          let rangeIsArr = isArr(rn);
          if (scaleKey != xScaleKey || mode2 == 2 && !isTime) {
            if (rangeIsArr && (rn[0] == null || rn[1] == null)) {
              rn = {
                min: rn[0] == null ? autoRangePart : {
                  mode: 1,
                  hard: rn[0],
                  soft: rn[0]
                },
                max: rn[1] == null ? autoRangePart : {
                  mode: 1,
                  hard: rn[1],
                  soft: rn[1]
                }
              };
              rangeIsArr = false;
            }
            if (!rangeIsArr && isObj(rn)) {
              let cfg = rn;
              rn = (self2, dataMin, dataMax) => dataMin == null ? nullNullTuple : rangeNum(dataMin, dataMax, cfg);
            }
          }
          sc.range = fnOrSelf(rn || (isTime ? snapTimeX : scaleKey == xScaleKey ? sc.distr == 3 ? snapLogX : sc.distr == 4 ? snapAsinhX : snapNumX : sc.distr == 3 ? snapLogY : sc.distr == 4 ? snapAsinhY : snapNumY));
          sc.auto = fnOrSelf(rangeIsArr ? false : sc.auto);
          sc.clamp = fnOrSelf(sc.clamp || clampScale);
          sc._min = sc._max = null;
          sc.valToPct = initValToPct(sc);
        }
      }
    }
    initScale("x");
    initScale("y");
    if (mode2 == 1) {
      series.forEach((s) => {
        initScale(s.scale);
      });
    }
    axes.forEach((a) => {
      initScale(a.scale);
    });
    for (let k in opts.scales)
      initScale(k);
    const scaleX = scales[xScaleKey];
    const xScaleDistr = scaleX.distr;
    let valToPosX, valToPosY;
    if (scaleX.ori == 0) {
      addClass(root, ORI_HZ);
      valToPosX = getHPos;
      valToPosY = getVPos;
    } else {
      addClass(root, ORI_VT);
      valToPosX = getVPos;
      valToPosY = getHPos;
    }
    const pendScales = {};
    for (let k in scales) {
      let sc = scales[k];
      if (sc.min != null || sc.max != null) {
        pendScales[k] = { min: sc.min, max: sc.max };
        sc.min = sc.max = null;
      }
    }
    const _tzDate = opts.tzDate || ((ts) => new Date(round(ts / ms)));
    const _fmtDate = opts.fmtDate || fmtDate;
    const _timeAxisSplits = ms == 1 ? timeAxisSplitsMs(_tzDate) : timeAxisSplitsS(_tzDate);
    const _timeAxisVals = timeAxisVals(_tzDate, timeAxisStamps(ms == 1 ? _timeAxisStampsMs : _timeAxisStampsS, _fmtDate));
    const _timeSeriesVal = timeSeriesVal(_tzDate, timeSeriesStamp(_timeSeriesStamp, _fmtDate));
    const activeIdxs = [];
    const legend = self.legend = assign({}, legendOpts, opts.legend);
    const cursor = self.cursor = assign({}, cursorOpts, { drag: { y: mode2 == 2 } }, opts.cursor);
    const showLegend = legend.show;
    const showCursor = cursor.show;
    const markers = legend.markers;
    {
      legend.idxs = activeIdxs;
      markers.width = fnOrSelf(markers.width);
      markers.dash = fnOrSelf(markers.dash);
      markers.stroke = fnOrSelf(markers.stroke);
      markers.fill = fnOrSelf(markers.fill);
    }
    let legendTable;
    let legendHead;
    let legendBody;
    let legendRows = [];
    let legendCells = [];
    let legendCols;
    let multiValLegend = false;
    let NULL_LEGEND_VALUES = {};
    if (legend.live) {
      const getMultiVals = series[1] ? series[1].values : null;
      multiValLegend = getMultiVals != null;
      legendCols = multiValLegend ? getMultiVals(self, 1, 0) : { _: 0 };
      for (let k in legendCols)
        NULL_LEGEND_VALUES[k] = LEGEND_DISP;
    }
    if (showLegend) {
      legendTable = placeTag("table", LEGEND, root);
      legendBody = placeTag("tbody", null, legendTable);
      legend.mount(self, legendTable);
      if (multiValLegend) {
        legendHead = placeTag("thead", null, legendTable, legendBody);
        let head = placeTag("tr", null, legendHead);
        placeTag("th", null, head);
        for (var key in legendCols)
          placeTag("th", LEGEND_LABEL, head).textContent = key;
      } else {
        addClass(legendTable, LEGEND_INLINE);
        legend.live && addClass(legendTable, LEGEND_LIVE);
      }
    }
    const son = { show: true };
    const soff = { show: false };
    function initLegendRow(s, i) {
      if (i == 0 && (multiValLegend || !legend.live || mode2 == 2))
        return nullNullTuple;
      let cells = [];
      let row = placeTag("tr", LEGEND_SERIES, legendBody, legendBody.childNodes[i]);
      addClass(row, s.class);
      if (!s.show)
        addClass(row, OFF);
      let label = placeTag("th", null, row);
      if (markers.show) {
        let indic = placeDiv(LEGEND_MARKER, label);
        if (i > 0) {
          let width = markers.width(self, i);
          if (width)
            indic.style.border = width + "px " + markers.dash(self, i) + " " + markers.stroke(self, i);
          indic.style.background = markers.fill(self, i);
        }
      }
      let text2 = placeDiv(LEGEND_LABEL, label);
      if (s.label instanceof HTMLElement)
        text2.appendChild(s.label);
      else
        text2.textContent = s.label;
      if (i > 0) {
        if (!markers.show)
          text2.style.color = s.width > 0 ? markers.stroke(self, i) : markers.fill(self, i);
        onMouse("click", label, (e) => {
          if (cursor._lock)
            return;
          setCursorEvent(e);
          let seriesIdx = series.indexOf(s);
          if ((e.ctrlKey || e.metaKey) != legend.isolate) {
            let isolate = series.some((s2, i2) => i2 > 0 && i2 != seriesIdx && s2.show);
            series.forEach((s2, i2) => {
              i2 > 0 && setSeries(i2, isolate ? i2 == seriesIdx ? son : soff : son, true, syncOpts.setSeries);
            });
          } else
            setSeries(seriesIdx, { show: !s.show }, true, syncOpts.setSeries);
        }, false);
        if (cursorFocus) {
          onMouse(mouseenter, label, (e) => {
            if (cursor._lock)
              return;
            setCursorEvent(e);
            setSeries(series.indexOf(s), FOCUS_TRUE, true, syncOpts.setSeries);
          }, false);
        }
      }
      for (var key2 in legendCols) {
        let v = placeTag("td", LEGEND_VALUE, row);
        v.textContent = "--";
        cells.push(v);
      }
      return [row, cells];
    }
    const mouseListeners = /* @__PURE__ */ new Map();
    function onMouse(ev, targ, fn, onlyTarg = true) {
      const targListeners = mouseListeners.get(targ) || {};
      const listener = cursor.bind[ev](self, targ, fn, onlyTarg);
      if (listener) {
        on(ev, targ, targListeners[ev] = listener);
        mouseListeners.set(targ, targListeners);
      }
    }
    function offMouse(ev, targ, fn) {
      const targListeners = mouseListeners.get(targ) || {};
      for (let k in targListeners) {
        if (ev == null || k == ev) {
          off(k, targ, targListeners[k]);
          delete targListeners[k];
        }
      }
      if (ev == null)
        mouseListeners.delete(targ);
    }
    let fullWidCss = 0;
    let fullHgtCss = 0;
    let plotWidCss = 0;
    let plotHgtCss = 0;
    let plotLftCss = 0;
    let plotTopCss = 0;
    let _plotLftCss = plotLftCss;
    let _plotTopCss = plotTopCss;
    let _plotWidCss = plotWidCss;
    let _plotHgtCss = plotHgtCss;
    let plotLft = 0;
    let plotTop = 0;
    let plotWid = 0;
    let plotHgt = 0;
    self.bbox = {};
    let shouldSetScales = false;
    let shouldSetSize = false;
    let shouldConvergeSize = false;
    let shouldSetCursor = false;
    let shouldSetSelect = false;
    let shouldSetLegend = false;
    function _setSize(width, height, force) {
      if (force || (width != self.width || height != self.height))
        calcSize(width, height);
      resetYSeries(false);
      shouldConvergeSize = true;
      shouldSetSize = true;
      commit();
    }
    function calcSize(width, height) {
      self.width = fullWidCss = plotWidCss = width;
      self.height = fullHgtCss = plotHgtCss = height;
      plotLftCss = plotTopCss = 0;
      calcPlotRect();
      calcAxesRects();
      let bb = self.bbox;
      plotLft = bb.left = incrRound(plotLftCss * pxRatio, 0.5);
      plotTop = bb.top = incrRound(plotTopCss * pxRatio, 0.5);
      plotWid = bb.width = incrRound(plotWidCss * pxRatio, 0.5);
      plotHgt = bb.height = incrRound(plotHgtCss * pxRatio, 0.5);
    }
    const CYCLE_LIMIT = 3;
    function convergeSize() {
      let converged = false;
      let cycleNum = 0;
      while (!converged) {
        cycleNum++;
        let axesConverged = axesCalc(cycleNum);
        let paddingConverged = paddingCalc(cycleNum);
        converged = cycleNum == CYCLE_LIMIT || axesConverged && paddingConverged;
        if (!converged) {
          calcSize(self.width, self.height);
          shouldSetSize = true;
        }
      }
    }
    function setSize({ width, height }) {
      _setSize(width, height);
    }
    self.setSize = setSize;
    function calcPlotRect() {
      let hasTopAxis = false;
      let hasBtmAxis = false;
      let hasRgtAxis = false;
      let hasLftAxis = false;
      axes.forEach((axis, i) => {
        if (axis.show && axis._show) {
          let { side, _size } = axis;
          let isVt = side % 2;
          let labelSize = axis.label != null ? axis.labelSize : 0;
          let fullSize = _size + labelSize;
          if (fullSize > 0) {
            if (isVt) {
              plotWidCss -= fullSize;
              if (side == 3) {
                plotLftCss += fullSize;
                hasLftAxis = true;
              } else
                hasRgtAxis = true;
            } else {
              plotHgtCss -= fullSize;
              if (side == 0) {
                plotTopCss += fullSize;
                hasTopAxis = true;
              } else
                hasBtmAxis = true;
            }
          }
        }
      });
      sidesWithAxes[0] = hasTopAxis;
      sidesWithAxes[1] = hasRgtAxis;
      sidesWithAxes[2] = hasBtmAxis;
      sidesWithAxes[3] = hasLftAxis;
      plotWidCss -= _padding[1] + _padding[3];
      plotLftCss += _padding[3];
      plotHgtCss -= _padding[2] + _padding[0];
      plotTopCss += _padding[0];
    }
    function calcAxesRects() {
      let off1 = plotLftCss + plotWidCss;
      let off2 = plotTopCss + plotHgtCss;
      let off3 = plotLftCss;
      let off0 = plotTopCss;
      function incrOffset(side, size) {
        switch (side) {
          case 1:
            off1 += size;
            return off1 - size;
          case 2:
            off2 += size;
            return off2 - size;
          case 3:
            off3 -= size;
            return off3 + size;
          case 0:
            off0 -= size;
            return off0 + size;
        }
      }
      axes.forEach((axis, i) => {
        if (axis.show && axis._show) {
          let side = axis.side;
          axis._pos = incrOffset(side, axis._size);
          if (axis.label != null)
            axis._lpos = incrOffset(side, axis.labelSize);
        }
      });
    }
    if (cursor.dataIdx == null) {
      let hov = cursor.hover;
      let skip = hov.skip = new Set(hov.skip ?? []);
      skip.add(void 0);
      let prox = hov.prox = fnOrSelf(hov.prox);
      let bias = hov.bias ??= 0;
      cursor.dataIdx = (self2, seriesIdx, cursorIdx, valAtPosX) => {
        if (seriesIdx == 0)
          return cursorIdx;
        let idx2 = cursorIdx;
        let _prox = prox(self2, seriesIdx, cursorIdx, valAtPosX) ?? inf;
        let withProx = _prox >= 0 && _prox < inf;
        let xDim = scaleX.ori == 0 ? plotWidCss : plotHgtCss;
        let cursorLft = cursor.left;
        let xValues = data[0];
        let yValues = data[seriesIdx];
        if (skip.has(yValues[cursorIdx])) {
          idx2 = null;
          let nonNullLft = null, nonNullRgt = null, j;
          if (bias == 0 || bias == -1) {
            j = cursorIdx;
            while (nonNullLft == null && j-- > 0) {
              if (!skip.has(yValues[j]))
                nonNullLft = j;
            }
          }
          if (bias == 0 || bias == 1) {
            j = cursorIdx;
            while (nonNullRgt == null && j++ < yValues.length) {
              if (!skip.has(yValues[j]))
                nonNullRgt = j;
            }
          }
          if (nonNullLft != null || nonNullRgt != null) {
            if (withProx) {
              let lftPos = nonNullLft == null ? -Infinity : valToPosX(xValues[nonNullLft], scaleX, xDim, 0);
              let rgtPos = nonNullRgt == null ? Infinity : valToPosX(xValues[nonNullRgt], scaleX, xDim, 0);
              let lftDelta = cursorLft - lftPos;
              let rgtDelta = rgtPos - cursorLft;
              if (lftDelta <= rgtDelta) {
                if (lftDelta <= _prox)
                  idx2 = nonNullLft;
              } else {
                if (rgtDelta <= _prox)
                  idx2 = nonNullRgt;
              }
            } else {
              idx2 = nonNullRgt == null ? nonNullLft : nonNullLft == null ? nonNullRgt : cursorIdx - nonNullLft <= nonNullRgt - cursorIdx ? nonNullLft : nonNullRgt;
            }
          }
        } else if (withProx) {
          let dist = abs(cursorLft - valToPosX(xValues[cursorIdx], scaleX, xDim, 0));
          if (dist > _prox)
            idx2 = null;
        }
        return idx2;
      };
    }
    const setCursorEvent = (e) => {
      cursor.event = e;
    };
    cursor.idxs = activeIdxs;
    cursor._lock = false;
    let points2 = cursor.points;
    points2.show = fnOrSelf(points2.show);
    points2.size = fnOrSelf(points2.size);
    points2.stroke = fnOrSelf(points2.stroke);
    points2.width = fnOrSelf(points2.width);
    points2.fill = fnOrSelf(points2.fill);
    const focus = self.focus = assign({}, opts.focus || { alpha: 0.3 }, cursor.focus);
    const cursorFocus = focus.prox >= 0;
    const cursorOnePt = cursorFocus && points2.one;
    let cursorPts = [];
    let cursorPtsLft = [];
    let cursorPtsTop = [];
    function initCursorPt(s, si) {
      let pt = points2.show(self, si);
      if (pt instanceof HTMLElement) {
        addClass(pt, CURSOR_PT);
        addClass(pt, s.class);
        elTrans(pt, -10, -10, plotWidCss, plotHgtCss);
        over.insertBefore(pt, cursorPts[si]);
        return pt;
      }
    }
    function initSeries(s, i) {
      if (mode2 == 1 || i > 0) {
        let isTime = mode2 == 1 && scales[s.scale].time;
        let sv = s.value;
        s.value = isTime ? isStr(sv) ? timeSeriesVal(_tzDate, timeSeriesStamp(sv, _fmtDate)) : sv || _timeSeriesVal : sv || numSeriesVal;
        s.label = s.label || (isTime ? timeSeriesLabel : numSeriesLabel);
      }
      if (cursorOnePt || i > 0) {
        s.width = s.width == null ? 1 : s.width;
        s.paths = s.paths || linearPath || retNull;
        s.fillTo = fnOrSelf(s.fillTo || seriesFillTo);
        s.pxAlign = +ifNull(s.pxAlign, pxAlign);
        s.pxRound = pxRoundGen(s.pxAlign);
        s.stroke = fnOrSelf(s.stroke || null);
        s.fill = fnOrSelf(s.fill || null);
        s._stroke = s._fill = s._paths = s._focus = null;
        let _ptDia = ptDia(max(1, s.width), 1);
        let points3 = s.points = assign({}, {
          size: _ptDia,
          width: max(1, _ptDia * 0.2),
          stroke: s.stroke,
          space: _ptDia * 2,
          paths: pointsPath,
          _stroke: null,
          _fill: null
        }, s.points);
        points3.show = fnOrSelf(points3.show);
        points3.filter = fnOrSelf(points3.filter);
        points3.fill = fnOrSelf(points3.fill);
        points3.stroke = fnOrSelf(points3.stroke);
        points3.paths = fnOrSelf(points3.paths);
        points3.pxAlign = s.pxAlign;
      }
      if (showLegend) {
        let rowCells = initLegendRow(s, i);
        legendRows.splice(i, 0, rowCells[0]);
        legendCells.splice(i, 0, rowCells[1]);
        legend.values.push(null);
      }
      if (showCursor) {
        activeIdxs.splice(i, 0, null);
        let pt = null;
        if (cursorOnePt) {
          if (i == 0)
            pt = initCursorPt(s, i);
        } else if (i > 0)
          pt = initCursorPt(s, i);
        cursorPts.splice(i, 0, pt);
        cursorPtsLft.splice(i, 0, 0);
        cursorPtsTop.splice(i, 0, 0);
      }
      fire("addSeries", i);
    }
    function addSeries(opts2, si) {
      si = si == null ? series.length : si;
      opts2 = mode2 == 1 ? setDefault(opts2, si, xSeriesOpts, ySeriesOpts) : setDefault(opts2, si, {}, xySeriesOpts);
      series.splice(si, 0, opts2);
      initSeries(series[si], si);
    }
    self.addSeries = addSeries;
    function delSeries(i) {
      series.splice(i, 1);
      if (showLegend) {
        legend.values.splice(i, 1);
        legendCells.splice(i, 1);
        let tr = legendRows.splice(i, 1)[0];
        offMouse(null, tr.firstChild);
        tr.remove();
      }
      if (showCursor) {
        activeIdxs.splice(i, 1);
        cursorPts.splice(i, 1)[0].remove();
        cursorPtsLft.splice(i, 1);
        cursorPtsTop.splice(i, 1);
      }
      fire("delSeries", i);
    }
    self.delSeries = delSeries;
    const sidesWithAxes = [false, false, false, false];
    function initAxis(axis, i) {
      axis._show = axis.show;
      if (axis.show) {
        let isVt = axis.side % 2;
        let sc = scales[axis.scale];
        if (sc == null) {
          axis.scale = isVt ? series[1].scale : xScaleKey;
          sc = scales[axis.scale];
        }
        let isTime = sc.time;
        axis.size = fnOrSelf(axis.size);
        axis.space = fnOrSelf(axis.space);
        axis.rotate = fnOrSelf(axis.rotate);
        if (isArr(axis.incrs)) {
          axis.incrs.forEach((incr) => {
            !fixedDec.has(incr) && fixedDec.set(incr, guessDec(incr));
          });
        }
        axis.incrs = fnOrSelf(axis.incrs || (sc.distr == 2 ? wholeIncrs : isTime ? ms == 1 ? timeIncrsMs : timeIncrsS : numIncrs));
        axis.splits = fnOrSelf(axis.splits || (isTime && sc.distr == 1 ? _timeAxisSplits : sc.distr == 3 ? logAxisSplits : sc.distr == 4 ? asinhAxisSplits : numAxisSplits));
        axis.stroke = fnOrSelf(axis.stroke);
        axis.grid.stroke = fnOrSelf(axis.grid.stroke);
        axis.ticks.stroke = fnOrSelf(axis.ticks.stroke);
        axis.border.stroke = fnOrSelf(axis.border.stroke);
        let av = axis.values;
        axis.values = // static array of tick values
        isArr(av) && !isArr(av[0]) ? fnOrSelf(av) : (
          // temporal
          isTime ? (
            // config array of fmtDate string tpls
            isArr(av) ? timeAxisVals(_tzDate, timeAxisStamps(av, _fmtDate)) : (
              // fmtDate string tpl
              isStr(av) ? timeAxisVal(_tzDate, av) : av || _timeAxisVals
            )
          ) : av || numAxisVals
        );
        axis.filter = fnOrSelf(axis.filter || (sc.distr >= 3 && sc.log == 10 ? log10AxisValsFilt : sc.distr == 3 && sc.log == 2 ? log2AxisValsFilt : retArg1));
        axis.font = pxRatioFont(axis.font);
        axis.labelFont = pxRatioFont(axis.labelFont);
        axis._size = axis.size(self, null, i, 0);
        axis._space = axis._rotate = axis._incrs = axis._found = // foundIncrSpace
        axis._splits = axis._values = null;
        if (axis._size > 0) {
          sidesWithAxes[i] = true;
          axis._el = placeDiv(AXIS, wrap);
        }
      }
    }
    function autoPadSide(self2, side, sidesWithAxes2, cycleNum) {
      let [hasTopAxis, hasRgtAxis, hasBtmAxis, hasLftAxis] = sidesWithAxes2;
      let ori = side % 2;
      let size = 0;
      if (ori == 0 && (hasLftAxis || hasRgtAxis))
        size = side == 0 && !hasTopAxis || side == 2 && !hasBtmAxis ? round(xAxisOpts.size / 3) : 0;
      if (ori == 1 && (hasTopAxis || hasBtmAxis))
        size = side == 1 && !hasRgtAxis || side == 3 && !hasLftAxis ? round(yAxisOpts.size / 2) : 0;
      return size;
    }
    const padding = self.padding = (opts.padding || [autoPadSide, autoPadSide, autoPadSide, autoPadSide]).map((p) => fnOrSelf(ifNull(p, autoPadSide)));
    const _padding = self._padding = padding.map((p, i) => p(self, i, sidesWithAxes, 0));
    let dataLen;
    let i0 = null;
    let i1 = null;
    const idxs = mode2 == 1 ? series[0].idxs : null;
    let data0 = null;
    let viaAutoScaleX = false;
    function setData(_data, _resetScales) {
      data = _data == null ? [] : _data;
      self.data = self._data = data;
      if (mode2 == 2) {
        dataLen = 0;
        for (let i = 1; i < series.length; i++)
          dataLen += data[i][0].length;
      } else {
        if (data.length == 0)
          self.data = self._data = data = [[]];
        data0 = data[0];
        dataLen = data0.length;
        let scaleData = data;
        if (xScaleDistr == 2) {
          scaleData = data.slice();
          let _data0 = scaleData[0] = Array(dataLen);
          for (let i = 0; i < dataLen; i++)
            _data0[i] = i;
        }
        self._data = data = scaleData;
      }
      resetYSeries(true);
      fire("setData");
      if (xScaleDistr == 2) {
        shouldConvergeSize = true;
      }
      if (_resetScales !== false) {
        let xsc = scaleX;
        if (xsc.auto(self, viaAutoScaleX))
          autoScaleX();
        else
          _setScale(xScaleKey, xsc.min, xsc.max);
        shouldSetCursor = shouldSetCursor || cursor.left >= 0;
        shouldSetLegend = true;
        commit();
      }
    }
    self.setData = setData;
    function autoScaleX() {
      viaAutoScaleX = true;
      let _min, _max;
      if (mode2 == 1) {
        if (dataLen > 0) {
          i0 = idxs[0] = 0;
          i1 = idxs[1] = dataLen - 1;
          _min = data[0][i0];
          _max = data[0][i1];
          if (xScaleDistr == 2) {
            _min = i0;
            _max = i1;
          } else if (_min == _max) {
            if (xScaleDistr == 3)
              [_min, _max] = rangeLog(_min, _min, scaleX.log, false);
            else if (xScaleDistr == 4)
              [_min, _max] = rangeAsinh(_min, _min, scaleX.log, false);
            else if (scaleX.time)
              _max = _min + round(86400 / ms);
            else
              [_min, _max] = rangeNum(_min, _max, rangePad, true);
          }
        } else {
          i0 = idxs[0] = _min = null;
          i1 = idxs[1] = _max = null;
        }
      }
      _setScale(xScaleKey, _min, _max);
    }
    let ctxStroke, ctxFill, ctxWidth, ctxDash, ctxJoin, ctxCap, ctxFont, ctxAlign, ctxBaseline;
    let ctxAlpha;
    function setCtxStyle(stroke, width, dash, cap, fill, join2) {
      stroke ??= transparent;
      dash ??= EMPTY_ARR;
      cap ??= "butt";
      fill ??= transparent;
      join2 ??= "round";
      if (stroke != ctxStroke)
        ctx.strokeStyle = ctxStroke = stroke;
      if (fill != ctxFill)
        ctx.fillStyle = ctxFill = fill;
      if (width != ctxWidth)
        ctx.lineWidth = ctxWidth = width;
      if (join2 != ctxJoin)
        ctx.lineJoin = ctxJoin = join2;
      if (cap != ctxCap)
        ctx.lineCap = ctxCap = cap;
      if (dash != ctxDash)
        ctx.setLineDash(ctxDash = dash);
    }
    function setFontStyle(font2, fill, align, baseline) {
      if (fill != ctxFill)
        ctx.fillStyle = ctxFill = fill;
      if (font2 != ctxFont)
        ctx.font = ctxFont = font2;
      if (align != ctxAlign)
        ctx.textAlign = ctxAlign = align;
      if (baseline != ctxBaseline)
        ctx.textBaseline = ctxBaseline = baseline;
    }
    function accScale(wsc, psc, facet2, data2, sorted = 0) {
      if (data2.length > 0 && wsc.auto(self, viaAutoScaleX) && (psc == null || psc.min == null)) {
        let _i0 = ifNull(i0, 0);
        let _i1 = ifNull(i1, data2.length - 1);
        let minMax = facet2.min == null ? getMinMax(data2, _i0, _i1, sorted, wsc.distr == 3) : [facet2.min, facet2.max];
        wsc.min = min(wsc.min, facet2.min = minMax[0]);
        wsc.max = max(wsc.max, facet2.max = minMax[1]);
      }
    }
    const AUTOSCALE = { min: null, max: null };
    function setScales() {
      for (let k in scales) {
        let sc = scales[k];
        if (pendScales[k] == null && // scales that have never been set (on init)
        (sc.min == null || // or auto scales when the x scale was explicitly set
        pendScales[xScaleKey] != null && sc.auto(self, viaAutoScaleX))) {
          pendScales[k] = AUTOSCALE;
        }
      }
      for (let k in scales) {
        let sc = scales[k];
        if (pendScales[k] == null && sc.from != null && pendScales[sc.from] != null)
          pendScales[k] = AUTOSCALE;
      }
      if (pendScales[xScaleKey] != null)
        resetYSeries(true);
      let wipScales = {};
      for (let k in pendScales) {
        let psc = pendScales[k];
        if (psc != null) {
          let wsc = wipScales[k] = copy2(scales[k], fastIsObj);
          if (psc.min != null)
            assign(wsc, psc);
          else if (k != xScaleKey || mode2 == 2) {
            if (dataLen == 0 && wsc.from == null) {
              let minMax = wsc.range(self, null, null, k);
              wsc.min = minMax[0];
              wsc.max = minMax[1];
            } else {
              wsc.min = inf;
              wsc.max = -inf;
            }
          }
        }
      }
      if (dataLen > 0) {
        series.forEach((s, i) => {
          if (mode2 == 1) {
            let k = s.scale;
            let psc = pendScales[k];
            if (psc == null)
              return;
            let wsc = wipScales[k];
            if (i == 0) {
              let minMax = wsc.range(self, wsc.min, wsc.max, k);
              wsc.min = minMax[0];
              wsc.max = minMax[1];
              i0 = closestIdx(wsc.min, data[0]);
              i1 = closestIdx(wsc.max, data[0]);
              if (i1 - i0 > 1) {
                if (data[0][i0] < wsc.min)
                  i0++;
                if (data[0][i1] > wsc.max)
                  i1--;
              }
              s.min = data0[i0];
              s.max = data0[i1];
            } else if (s.show && s.auto)
              accScale(wsc, psc, s, data[i], s.sorted);
            s.idxs[0] = i0;
            s.idxs[1] = i1;
          } else {
            if (i > 0) {
              if (s.show && s.auto) {
                let [xFacet, yFacet] = s.facets;
                let xScaleKey2 = xFacet.scale;
                let yScaleKey = yFacet.scale;
                let [xData, yData] = data[i];
                let wscx = wipScales[xScaleKey2];
                let wscy = wipScales[yScaleKey];
                wscx != null && accScale(wscx, pendScales[xScaleKey2], xFacet, xData, xFacet.sorted);
                wscy != null && accScale(wscy, pendScales[yScaleKey], yFacet, yData, yFacet.sorted);
                s.min = yFacet.min;
                s.max = yFacet.max;
              }
            }
          }
        });
        for (let k in wipScales) {
          let wsc = wipScales[k];
          let psc = pendScales[k];
          if (wsc.from == null && (psc == null || psc.min == null)) {
            let minMax = wsc.range(
              self,
              wsc.min == inf ? null : wsc.min,
              wsc.max == -inf ? null : wsc.max,
              k
            );
            wsc.min = minMax[0];
            wsc.max = minMax[1];
          }
        }
      }
      for (let k in wipScales) {
        let wsc = wipScales[k];
        if (wsc.from != null) {
          let base = wipScales[wsc.from];
          if (base.min == null)
            wsc.min = wsc.max = null;
          else {
            let minMax = wsc.range(self, base.min, base.max, k);
            wsc.min = minMax[0];
            wsc.max = minMax[1];
          }
        }
      }
      let changed = {};
      let anyChanged = false;
      for (let k in wipScales) {
        let wsc = wipScales[k];
        let sc = scales[k];
        if (sc.min != wsc.min || sc.max != wsc.max) {
          sc.min = wsc.min;
          sc.max = wsc.max;
          let distr = sc.distr;
          sc._min = distr == 3 ? log10(sc.min) : distr == 4 ? asinh(sc.min, sc.asinh) : distr == 100 ? sc.fwd(sc.min) : sc.min;
          sc._max = distr == 3 ? log10(sc.max) : distr == 4 ? asinh(sc.max, sc.asinh) : distr == 100 ? sc.fwd(sc.max) : sc.max;
          changed[k] = anyChanged = true;
        }
      }
      if (anyChanged) {
        series.forEach((s, i) => {
          if (mode2 == 2) {
            if (i > 0 && changed.y)
              s._paths = null;
          } else {
            if (changed[s.scale])
              s._paths = null;
          }
        });
        for (let k in changed) {
          shouldConvergeSize = true;
          fire("setScale", k);
        }
        if (showCursor && cursor.left >= 0)
          shouldSetCursor = shouldSetLegend = true;
      }
      for (let k in pendScales)
        pendScales[k] = null;
    }
    function getOuterIdxs(ydata) {
      let _i0 = clamp(i0 - 1, 0, dataLen - 1);
      let _i1 = clamp(i1 + 1, 0, dataLen - 1);
      while (ydata[_i0] == null && _i0 > 0)
        _i0--;
      while (ydata[_i1] == null && _i1 < dataLen - 1)
        _i1++;
      return [_i0, _i1];
    }
    function drawSeries() {
      if (dataLen > 0) {
        let shouldAlpha = series.some((s) => s._focus) && ctxAlpha != focus.alpha;
        if (shouldAlpha)
          ctx.globalAlpha = ctxAlpha = focus.alpha;
        series.forEach((s, i) => {
          if (i > 0 && s.show) {
            cacheStrokeFill(i, false);
            cacheStrokeFill(i, true);
            if (s._paths == null) {
              let _ctxAlpha = ctxAlpha;
              if (ctxAlpha != s.alpha)
                ctx.globalAlpha = ctxAlpha = s.alpha;
              let _idxs = mode2 == 2 ? [0, data[i][0].length - 1] : getOuterIdxs(data[i]);
              s._paths = s.paths(self, i, _idxs[0], _idxs[1]);
              if (ctxAlpha != _ctxAlpha)
                ctx.globalAlpha = ctxAlpha = _ctxAlpha;
            }
          }
        });
        series.forEach((s, i) => {
          if (i > 0 && s.show) {
            let _ctxAlpha = ctxAlpha;
            if (ctxAlpha != s.alpha)
              ctx.globalAlpha = ctxAlpha = s.alpha;
            s._paths != null && drawPath(i, false);
            {
              let _gaps = s._paths != null ? s._paths.gaps : null;
              let show = s.points.show(self, i, i0, i1, _gaps);
              let idxs2 = s.points.filter(self, i, show, _gaps);
              if (show || idxs2) {
                s.points._paths = s.points.paths(self, i, i0, i1, idxs2);
                drawPath(i, true);
              }
            }
            if (ctxAlpha != _ctxAlpha)
              ctx.globalAlpha = ctxAlpha = _ctxAlpha;
            fire("drawSeries", i);
          }
        });
        if (shouldAlpha)
          ctx.globalAlpha = ctxAlpha = 1;
      }
    }
    function cacheStrokeFill(si, _points) {
      let s = _points ? series[si].points : series[si];
      s._stroke = s.stroke(self, si);
      s._fill = s.fill(self, si);
    }
    function drawPath(si, _points) {
      let s = _points ? series[si].points : series[si];
      let {
        stroke,
        fill,
        clip: gapsClip,
        flags,
        _stroke: strokeStyle = s._stroke,
        _fill: fillStyle = s._fill,
        _width: width = s.width
      } = s._paths;
      width = roundDec(width * pxRatio, 3);
      let boundsClip = null;
      let offset = width % 2 / 2;
      if (_points && fillStyle == null)
        fillStyle = width > 0 ? "#fff" : strokeStyle;
      let _pxAlign = s.pxAlign == 1 && offset > 0;
      _pxAlign && ctx.translate(offset, offset);
      if (!_points) {
        let lft = plotLft - width / 2, top = plotTop - width / 2, wid = plotWid + width, hgt = plotHgt + width;
        boundsClip = new Path2D();
        boundsClip.rect(lft, top, wid, hgt);
      }
      if (_points)
        strokeFill(strokeStyle, width, s.dash, s.cap, fillStyle, stroke, fill, flags, gapsClip);
      else
        fillStroke(si, strokeStyle, width, s.dash, s.cap, fillStyle, stroke, fill, flags, boundsClip, gapsClip);
      _pxAlign && ctx.translate(-offset, -offset);
    }
    function fillStroke(si, strokeStyle, lineWidth, lineDash, lineCap, fillStyle, strokePath, fillPath, flags, boundsClip, gapsClip) {
      let didStrokeFill = false;
      flags != 0 && bands.forEach((b, bi) => {
        if (b.series[0] == si) {
          let lowerEdge = series[b.series[1]];
          let lowerData = data[b.series[1]];
          let bandClip = (lowerEdge._paths || EMPTY_OBJ).band;
          if (isArr(bandClip))
            bandClip = b.dir == 1 ? bandClip[0] : bandClip[1];
          let gapsClip2;
          let _fillStyle = null;
          if (lowerEdge.show && bandClip && hasData(lowerData, i0, i1)) {
            _fillStyle = b.fill(self, bi) || fillStyle;
            gapsClip2 = lowerEdge._paths.clip;
          } else
            bandClip = null;
          strokeFill(strokeStyle, lineWidth, lineDash, lineCap, _fillStyle, strokePath, fillPath, flags, boundsClip, gapsClip, gapsClip2, bandClip);
          didStrokeFill = true;
        }
      });
      if (!didStrokeFill)
        strokeFill(strokeStyle, lineWidth, lineDash, lineCap, fillStyle, strokePath, fillPath, flags, boundsClip, gapsClip);
    }
    const CLIP_FILL_STROKE = BAND_CLIP_FILL | BAND_CLIP_STROKE;
    function strokeFill(strokeStyle, lineWidth, lineDash, lineCap, fillStyle, strokePath, fillPath, flags, boundsClip, gapsClip, gapsClip2, bandClip) {
      setCtxStyle(strokeStyle, lineWidth, lineDash, lineCap, fillStyle);
      if (boundsClip || gapsClip || bandClip) {
        ctx.save();
        boundsClip && ctx.clip(boundsClip);
        gapsClip && ctx.clip(gapsClip);
      }
      if (bandClip) {
        if ((flags & CLIP_FILL_STROKE) == CLIP_FILL_STROKE) {
          ctx.clip(bandClip);
          gapsClip2 && ctx.clip(gapsClip2);
          doFill(fillStyle, fillPath);
          doStroke(strokeStyle, strokePath, lineWidth);
        } else if (flags & BAND_CLIP_STROKE) {
          doFill(fillStyle, fillPath);
          ctx.clip(bandClip);
          doStroke(strokeStyle, strokePath, lineWidth);
        } else if (flags & BAND_CLIP_FILL) {
          ctx.save();
          ctx.clip(bandClip);
          gapsClip2 && ctx.clip(gapsClip2);
          doFill(fillStyle, fillPath);
          ctx.restore();
          doStroke(strokeStyle, strokePath, lineWidth);
        }
      } else {
        doFill(fillStyle, fillPath);
        doStroke(strokeStyle, strokePath, lineWidth);
      }
      if (boundsClip || gapsClip || bandClip)
        ctx.restore();
    }
    function doStroke(strokeStyle, strokePath, lineWidth) {
      if (lineWidth > 0) {
        if (strokePath instanceof Map) {
          strokePath.forEach((strokePath2, strokeStyle2) => {
            ctx.strokeStyle = ctxStroke = strokeStyle2;
            ctx.stroke(strokePath2);
          });
        } else
          strokePath != null && strokeStyle && ctx.stroke(strokePath);
      }
    }
    function doFill(fillStyle, fillPath) {
      if (fillPath instanceof Map) {
        fillPath.forEach((fillPath2, fillStyle2) => {
          ctx.fillStyle = ctxFill = fillStyle2;
          ctx.fill(fillPath2);
        });
      } else
        fillPath != null && fillStyle && ctx.fill(fillPath);
    }
    function getIncrSpace(axisIdx, min2, max2, fullDim) {
      let axis = axes[axisIdx];
      let incrSpace;
      if (fullDim <= 0)
        incrSpace = [0, 0];
      else {
        let minSpace = axis._space = axis.space(self, axisIdx, min2, max2, fullDim);
        let incrs = axis._incrs = axis.incrs(self, axisIdx, min2, max2, fullDim, minSpace);
        incrSpace = findIncr(min2, max2, incrs, fullDim, minSpace);
      }
      return axis._found = incrSpace;
    }
    function drawOrthoLines(offs, filts, ori, side, pos0, len, width, stroke, dash, cap) {
      let offset = width % 2 / 2;
      pxAlign == 1 && ctx.translate(offset, offset);
      setCtxStyle(stroke, width, dash, cap, stroke);
      ctx.beginPath();
      let x0, y0, x1, y1, pos1 = pos0 + (side == 0 || side == 3 ? -len : len);
      if (ori == 0) {
        y0 = pos0;
        y1 = pos1;
      } else {
        x0 = pos0;
        x1 = pos1;
      }
      for (let i = 0; i < offs.length; i++) {
        if (filts[i] != null) {
          if (ori == 0)
            x0 = x1 = offs[i];
          else
            y0 = y1 = offs[i];
          ctx.moveTo(x0, y0);
          ctx.lineTo(x1, y1);
        }
      }
      ctx.stroke();
      pxAlign == 1 && ctx.translate(-offset, -offset);
    }
    function axesCalc(cycleNum) {
      let converged = true;
      axes.forEach((axis, i) => {
        if (!axis.show)
          return;
        let scale = scales[axis.scale];
        if (scale.min == null) {
          if (axis._show) {
            converged = false;
            axis._show = false;
            resetYSeries(false);
          }
          return;
        } else {
          if (!axis._show) {
            converged = false;
            axis._show = true;
            resetYSeries(false);
          }
        }
        let side = axis.side;
        let ori = side % 2;
        let { min: min2, max: max2 } = scale;
        let [_incr, _space] = getIncrSpace(i, min2, max2, ori == 0 ? plotWidCss : plotHgtCss);
        if (_space == 0)
          return;
        let forceMin = scale.distr == 2;
        let _splits = axis._splits = axis.splits(self, i, min2, max2, _incr, _space, forceMin);
        let splits = scale.distr == 2 ? _splits.map((i2) => data0[i2]) : _splits;
        let incr = scale.distr == 2 ? data0[_splits[1]] - data0[_splits[0]] : _incr;
        let values = axis._values = axis.values(self, axis.filter(self, splits, i, _space, incr), i, _space, incr);
        axis._rotate = side == 2 ? axis.rotate(self, values, i, _space) : 0;
        let oldSize = axis._size;
        axis._size = ceil(axis.size(self, values, i, cycleNum));
        if (oldSize != null && axis._size != oldSize)
          converged = false;
      });
      return converged;
    }
    function paddingCalc(cycleNum) {
      let converged = true;
      padding.forEach((p, i) => {
        let _p = p(self, i, sidesWithAxes, cycleNum);
        if (_p != _padding[i])
          converged = false;
        _padding[i] = _p;
      });
      return converged;
    }
    function drawAxesGrid() {
      for (let i = 0; i < axes.length; i++) {
        let axis = axes[i];
        if (!axis.show || !axis._show)
          continue;
        let side = axis.side;
        let ori = side % 2;
        let x, y;
        let fillStyle = axis.stroke(self, i);
        let shiftDir = side == 0 || side == 3 ? -1 : 1;
        let [_incr, _space] = axis._found;
        if (axis.label != null) {
          let shiftAmt2 = axis.labelGap * shiftDir;
          let baseLpos = round((axis._lpos + shiftAmt2) * pxRatio);
          setFontStyle(axis.labelFont[0], fillStyle, "center", side == 2 ? TOP : BOTTOM);
          ctx.save();
          if (ori == 1) {
            x = y = 0;
            ctx.translate(
              baseLpos,
              round(plotTop + plotHgt / 2)
            );
            ctx.rotate((side == 3 ? -PI : PI) / 2);
          } else {
            x = round(plotLft + plotWid / 2);
            y = baseLpos;
          }
          let _label = isFn(axis.label) ? axis.label(self, i, _incr, _space) : axis.label;
          ctx.fillText(_label, x, y);
          ctx.restore();
        }
        if (_space == 0)
          continue;
        let scale = scales[axis.scale];
        let plotDim = ori == 0 ? plotWid : plotHgt;
        let plotOff = ori == 0 ? plotLft : plotTop;
        let _splits = axis._splits;
        let splits = scale.distr == 2 ? _splits.map((i2) => data0[i2]) : _splits;
        let incr = scale.distr == 2 ? data0[_splits[1]] - data0[_splits[0]] : _incr;
        let ticks2 = axis.ticks;
        let border2 = axis.border;
        let _tickSize = ticks2.show ? ticks2.size : 0;
        let tickSize = round(_tickSize * pxRatio);
        let axisGap = round((axis.alignTo == 2 ? axis._size - _tickSize - axis.gap : axis.gap) * pxRatio);
        let angle = axis._rotate * -PI / 180;
        let basePos = pxRound(axis._pos * pxRatio);
        let shiftAmt = (tickSize + axisGap) * shiftDir;
        let finalPos = basePos + shiftAmt;
        y = ori == 0 ? finalPos : 0;
        x = ori == 1 ? finalPos : 0;
        let font2 = axis.font[0];
        let textAlign = axis.align == 1 ? LEFT : axis.align == 2 ? RIGHT : angle > 0 ? LEFT : angle < 0 ? RIGHT : ori == 0 ? "center" : side == 3 ? RIGHT : LEFT;
        let textBaseline = angle || ori == 1 ? "middle" : side == 2 ? TOP : BOTTOM;
        setFontStyle(font2, fillStyle, textAlign, textBaseline);
        let lineHeight = axis.font[1] * axis.lineGap;
        let canOffs = _splits.map((val) => pxRound(getPos(val, scale, plotDim, plotOff)));
        let _values = axis._values;
        for (let i2 = 0; i2 < _values.length; i2++) {
          let val = _values[i2];
          if (val != null) {
            if (ori == 0)
              x = canOffs[i2];
            else
              y = canOffs[i2];
            val = "" + val;
            let _parts = val.indexOf("\n") == -1 ? [val] : val.split(/\n/gm);
            for (let j = 0; j < _parts.length; j++) {
              let text2 = _parts[j];
              if (angle) {
                ctx.save();
                ctx.translate(x, y + j * lineHeight);
                ctx.rotate(angle);
                ctx.fillText(text2, 0, 0);
                ctx.restore();
              } else
                ctx.fillText(text2, x, y + j * lineHeight);
            }
          }
        }
        if (ticks2.show) {
          drawOrthoLines(
            canOffs,
            ticks2.filter(self, splits, i, _space, incr),
            ori,
            side,
            basePos,
            tickSize,
            roundDec(ticks2.width * pxRatio, 3),
            ticks2.stroke(self, i),
            ticks2.dash,
            ticks2.cap
          );
        }
        let grid2 = axis.grid;
        if (grid2.show) {
          drawOrthoLines(
            canOffs,
            grid2.filter(self, splits, i, _space, incr),
            ori,
            ori == 0 ? 2 : 1,
            ori == 0 ? plotTop : plotLft,
            ori == 0 ? plotHgt : plotWid,
            roundDec(grid2.width * pxRatio, 3),
            grid2.stroke(self, i),
            grid2.dash,
            grid2.cap
          );
        }
        if (border2.show) {
          drawOrthoLines(
            [basePos],
            [1],
            ori == 0 ? 1 : 0,
            ori == 0 ? 1 : 2,
            ori == 1 ? plotTop : plotLft,
            ori == 1 ? plotHgt : plotWid,
            roundDec(border2.width * pxRatio, 3),
            border2.stroke(self, i),
            border2.dash,
            border2.cap
          );
        }
      }
      fire("drawAxes");
    }
    function resetYSeries(minMax) {
      series.forEach((s, i) => {
        if (i > 0) {
          s._paths = null;
          if (minMax) {
            if (mode2 == 1) {
              s.min = null;
              s.max = null;
            } else {
              s.facets.forEach((f) => {
                f.min = null;
                f.max = null;
              });
            }
          }
        }
      });
    }
    let queuedCommit = false;
    let deferHooks = false;
    let hooksQueue = [];
    function flushHooks() {
      deferHooks = false;
      for (let i = 0; i < hooksQueue.length; i++)
        fire(...hooksQueue[i]);
      hooksQueue.length = 0;
    }
    function commit() {
      if (!queuedCommit) {
        microTask(_commit);
        queuedCommit = true;
      }
    }
    function batch(fn, _deferHooks = false) {
      queuedCommit = true;
      deferHooks = _deferHooks;
      fn(self);
      _commit();
      if (_deferHooks && hooksQueue.length > 0)
        queueMicrotask(flushHooks);
    }
    self.batch = batch;
    function _commit() {
      if (shouldSetScales) {
        setScales();
        shouldSetScales = false;
      }
      if (shouldConvergeSize) {
        convergeSize();
        shouldConvergeSize = false;
      }
      if (shouldSetSize) {
        setStylePx(under, LEFT, plotLftCss);
        setStylePx(under, TOP, plotTopCss);
        setStylePx(under, WIDTH, plotWidCss);
        setStylePx(under, HEIGHT, plotHgtCss);
        setStylePx(over, LEFT, plotLftCss);
        setStylePx(over, TOP, plotTopCss);
        setStylePx(over, WIDTH, plotWidCss);
        setStylePx(over, HEIGHT, plotHgtCss);
        setStylePx(wrap, WIDTH, fullWidCss);
        setStylePx(wrap, HEIGHT, fullHgtCss);
        can.width = round(fullWidCss * pxRatio);
        can.height = round(fullHgtCss * pxRatio);
        axes.forEach(({ _el, _show, _size, _pos, side }) => {
          if (_el != null) {
            if (_show) {
              let posOffset = side === 3 || side === 0 ? _size : 0;
              let isVt = side % 2 == 1;
              setStylePx(_el, isVt ? "left" : "top", _pos - posOffset);
              setStylePx(_el, isVt ? "width" : "height", _size);
              setStylePx(_el, isVt ? "top" : "left", isVt ? plotTopCss : plotLftCss);
              setStylePx(_el, isVt ? "height" : "width", isVt ? plotHgtCss : plotWidCss);
              remClass(_el, OFF);
            } else
              addClass(_el, OFF);
          }
        });
        ctxStroke = ctxFill = ctxWidth = ctxJoin = ctxCap = ctxFont = ctxAlign = ctxBaseline = ctxDash = null;
        ctxAlpha = 1;
        syncRect(true);
        if (plotLftCss != _plotLftCss || plotTopCss != _plotTopCss || plotWidCss != _plotWidCss || plotHgtCss != _plotHgtCss) {
          resetYSeries(false);
          let pctWid = plotWidCss / _plotWidCss;
          let pctHgt = plotHgtCss / _plotHgtCss;
          if (showCursor && !shouldSetCursor && cursor.left >= 0) {
            cursor.left *= pctWid;
            cursor.top *= pctHgt;
            vCursor && elTrans(vCursor, round(cursor.left), 0, plotWidCss, plotHgtCss);
            hCursor && elTrans(hCursor, 0, round(cursor.top), plotWidCss, plotHgtCss);
            for (let i = 0; i < cursorPts.length; i++) {
              let pt = cursorPts[i];
              if (pt != null) {
                cursorPtsLft[i] *= pctWid;
                cursorPtsTop[i] *= pctHgt;
                elTrans(pt, ceil(cursorPtsLft[i]), ceil(cursorPtsTop[i]), plotWidCss, plotHgtCss);
              }
            }
          }
          if (select.show && !shouldSetSelect && select.left >= 0 && select.width > 0) {
            select.left *= pctWid;
            select.width *= pctWid;
            select.top *= pctHgt;
            select.height *= pctHgt;
            for (let prop in _hideProps)
              setStylePx(selectDiv, prop, select[prop]);
          }
          _plotLftCss = plotLftCss;
          _plotTopCss = plotTopCss;
          _plotWidCss = plotWidCss;
          _plotHgtCss = plotHgtCss;
        }
        fire("setSize");
        shouldSetSize = false;
      }
      if (fullWidCss > 0 && fullHgtCss > 0) {
        ctx.clearRect(0, 0, can.width, can.height);
        fire("drawClear");
        drawOrder.forEach((fn) => fn());
        fire("draw");
      }
      if (select.show && shouldSetSelect) {
        setSelect(select);
        shouldSetSelect = false;
      }
      if (showCursor && shouldSetCursor) {
        updateCursor(null, true, false);
        shouldSetCursor = false;
      }
      if (legend.show && legend.live && shouldSetLegend) {
        setLegend();
        shouldSetLegend = false;
      }
      if (!ready) {
        ready = true;
        self.status = 1;
        fire("ready");
      }
      viaAutoScaleX = false;
      queuedCommit = false;
    }
    self.redraw = (rebuildPaths, recalcAxes) => {
      shouldConvergeSize = recalcAxes || false;
      if (rebuildPaths !== false)
        _setScale(xScaleKey, scaleX.min, scaleX.max);
      else
        commit();
    };
    function setScale(key2, opts2) {
      let sc = scales[key2];
      if (sc.from == null) {
        if (dataLen == 0) {
          let minMax = sc.range(self, opts2.min, opts2.max, key2);
          opts2.min = minMax[0];
          opts2.max = minMax[1];
        }
        if (opts2.min > opts2.max) {
          let _min = opts2.min;
          opts2.min = opts2.max;
          opts2.max = _min;
        }
        if (dataLen > 1 && opts2.min != null && opts2.max != null && opts2.max - opts2.min < 1e-16)
          return;
        if (key2 == xScaleKey) {
          if (sc.distr == 2 && dataLen > 0) {
            opts2.min = closestIdx(opts2.min, data[0]);
            opts2.max = closestIdx(opts2.max, data[0]);
            if (opts2.min == opts2.max)
              opts2.max++;
          }
        }
        pendScales[key2] = opts2;
        shouldSetScales = true;
        commit();
      }
    }
    self.setScale = setScale;
    let xCursor;
    let yCursor;
    let vCursor;
    let hCursor;
    let rawMouseLeft0;
    let rawMouseTop0;
    let mouseLeft0;
    let mouseTop0;
    let rawMouseLeft1;
    let rawMouseTop1;
    let mouseLeft1;
    let mouseTop1;
    let dragging = false;
    const drag = cursor.drag;
    let dragX = drag.x;
    let dragY = drag.y;
    if (showCursor) {
      if (cursor.x)
        xCursor = placeDiv(CURSOR_X, over);
      if (cursor.y)
        yCursor = placeDiv(CURSOR_Y, over);
      if (scaleX.ori == 0) {
        vCursor = xCursor;
        hCursor = yCursor;
      } else {
        vCursor = yCursor;
        hCursor = xCursor;
      }
      mouseLeft1 = cursor.left;
      mouseTop1 = cursor.top;
    }
    const select = self.select = assign({
      show: true,
      over: true,
      left: 0,
      width: 0,
      top: 0,
      height: 0
    }, opts.select);
    const selectDiv = select.show ? placeDiv(SELECT, select.over ? over : under) : null;
    function setSelect(opts2, _fire) {
      if (select.show) {
        for (let prop in opts2) {
          select[prop] = opts2[prop];
          if (prop in _hideProps)
            setStylePx(selectDiv, prop, opts2[prop]);
        }
        _fire !== false && fire("setSelect");
      }
    }
    self.setSelect = setSelect;
    function toggleDOM(i) {
      let s = series[i];
      if (s.show)
        showLegend && remClass(legendRows[i], OFF);
      else {
        showLegend && addClass(legendRows[i], OFF);
        if (showCursor) {
          let pt = cursorOnePt ? cursorPts[0] : cursorPts[i];
          pt != null && elTrans(pt, -10, -10, plotWidCss, plotHgtCss);
        }
      }
    }
    function _setScale(key2, min2, max2) {
      setScale(key2, { min: min2, max: max2 });
    }
    function setSeries(i, opts2, _fire, _pub) {
      if (opts2.focus != null)
        setFocus(i);
      if (opts2.show != null) {
        series.forEach((s, si) => {
          if (si > 0 && (i == si || i == null)) {
            s.show = opts2.show;
            toggleDOM(si);
            if (mode2 == 2) {
              _setScale(s.facets[0].scale, null, null);
              _setScale(s.facets[1].scale, null, null);
            } else
              _setScale(s.scale, null, null);
            commit();
          }
        });
      }
      _fire !== false && fire("setSeries", i, opts2);
      _pub && pubSync("setSeries", self, i, opts2);
    }
    self.setSeries = setSeries;
    function setBand(bi, opts2) {
      assign(bands[bi], opts2);
    }
    function addBand(opts2, bi) {
      opts2.fill = fnOrSelf(opts2.fill || null);
      opts2.dir = ifNull(opts2.dir, -1);
      bi = bi == null ? bands.length : bi;
      bands.splice(bi, 0, opts2);
    }
    function delBand(bi) {
      if (bi == null)
        bands.length = 0;
      else
        bands.splice(bi, 1);
    }
    self.addBand = addBand;
    self.setBand = setBand;
    self.delBand = delBand;
    function setAlpha(i, value) {
      series[i].alpha = value;
      if (showCursor && cursorPts[i] != null)
        cursorPts[i].style.opacity = value;
      if (showLegend && legendRows[i])
        legendRows[i].style.opacity = value;
    }
    let closestDist;
    let closestSeries;
    let focusedSeries;
    const FOCUS_TRUE = { focus: true };
    function setFocus(i) {
      if (i != focusedSeries) {
        let allFocused = i == null;
        let _setAlpha = focus.alpha != 1;
        series.forEach((s, i2) => {
          if (mode2 == 1 || i2 > 0) {
            let isFocused = allFocused || i2 == 0 || i2 == i;
            s._focus = allFocused ? null : isFocused;
            _setAlpha && setAlpha(i2, isFocused ? 1 : focus.alpha);
          }
        });
        focusedSeries = i;
        _setAlpha && commit();
      }
    }
    if (showLegend && cursorFocus) {
      onMouse(mouseleave, legendTable, (e) => {
        if (cursor._lock)
          return;
        setCursorEvent(e);
        if (focusedSeries != null)
          setSeries(null, FOCUS_TRUE, true, syncOpts.setSeries);
      });
    }
    function posToVal(pos, scale, can2) {
      let sc = scales[scale];
      if (can2)
        pos = pos / pxRatio - (sc.ori == 1 ? plotTopCss : plotLftCss);
      let dim = plotWidCss;
      if (sc.ori == 1) {
        dim = plotHgtCss;
        pos = dim - pos;
      }
      if (sc.dir == -1)
        pos = dim - pos;
      let _min = sc._min, _max = sc._max, pct = pos / dim;
      let sv = _min + (_max - _min) * pct;
      let distr = sc.distr;
      return distr == 3 ? pow(10, sv) : distr == 4 ? sinh(sv, sc.asinh) : distr == 100 ? sc.bwd(sv) : sv;
    }
    function closestIdxFromXpos(pos, can2) {
      let v = posToVal(pos, xScaleKey, can2);
      return closestIdx(v, data[0], i0, i1);
    }
    self.valToIdx = (val) => closestIdx(val, data[0]);
    self.posToIdx = closestIdxFromXpos;
    self.posToVal = posToVal;
    self.valToPos = (val, scale, can2) => scales[scale].ori == 0 ? getHPos(
      val,
      scales[scale],
      can2 ? plotWid : plotWidCss,
      can2 ? plotLft : 0
    ) : getVPos(
      val,
      scales[scale],
      can2 ? plotHgt : plotHgtCss,
      can2 ? plotTop : 0
    );
    self.setCursor = (opts2, _fire, _pub) => {
      mouseLeft1 = opts2.left;
      mouseTop1 = opts2.top;
      updateCursor(null, _fire, _pub);
    };
    function setSelH(off2, dim) {
      setStylePx(selectDiv, LEFT, select.left = off2);
      setStylePx(selectDiv, WIDTH, select.width = dim);
    }
    function setSelV(off2, dim) {
      setStylePx(selectDiv, TOP, select.top = off2);
      setStylePx(selectDiv, HEIGHT, select.height = dim);
    }
    let setSelX = scaleX.ori == 0 ? setSelH : setSelV;
    let setSelY = scaleX.ori == 1 ? setSelH : setSelV;
    function syncLegend() {
      if (showLegend && legend.live) {
        for (let i = mode2 == 2 ? 1 : 0; i < series.length; i++) {
          if (i == 0 && multiValLegend)
            continue;
          let vals = legend.values[i];
          let j = 0;
          for (let k in vals)
            legendCells[i][j++].firstChild.nodeValue = vals[k];
        }
      }
    }
    function setLegend(opts2, _fire) {
      if (opts2 != null) {
        if (opts2.idxs) {
          opts2.idxs.forEach((didx, sidx) => {
            activeIdxs[sidx] = didx;
          });
        } else if (!isUndef(opts2.idx))
          activeIdxs.fill(opts2.idx);
        legend.idx = activeIdxs[0];
      }
      if (showLegend && legend.live) {
        for (let sidx = 0; sidx < series.length; sidx++) {
          if (sidx > 0 || mode2 == 1 && !multiValLegend)
            setLegendValues(sidx, activeIdxs[sidx]);
        }
        syncLegend();
      }
      shouldSetLegend = false;
      _fire !== false && fire("setLegend");
    }
    self.setLegend = setLegend;
    function setLegendValues(sidx, idx) {
      let s = series[sidx];
      let src = sidx == 0 && xScaleDistr == 2 ? data0 : data[sidx];
      let val;
      if (multiValLegend)
        val = s.values(self, sidx, idx) ?? NULL_LEGEND_VALUES;
      else {
        val = s.value(self, idx == null ? null : src[idx], sidx, idx);
        val = val == null ? NULL_LEGEND_VALUES : { _: val };
      }
      legend.values[sidx] = val;
    }
    function updateCursor(src, _fire, _pub) {
      rawMouseLeft1 = mouseLeft1;
      rawMouseTop1 = mouseTop1;
      [mouseLeft1, mouseTop1] = cursor.move(self, mouseLeft1, mouseTop1);
      cursor.left = mouseLeft1;
      cursor.top = mouseTop1;
      if (showCursor) {
        vCursor && elTrans(vCursor, round(mouseLeft1), 0, plotWidCss, plotHgtCss);
        hCursor && elTrans(hCursor, 0, round(mouseTop1), plotWidCss, plotHgtCss);
      }
      let idx;
      let noDataInRange = i0 > i1;
      closestDist = inf;
      closestSeries = null;
      let xDim = scaleX.ori == 0 ? plotWidCss : plotHgtCss;
      let yDim = scaleX.ori == 1 ? plotWidCss : plotHgtCss;
      if (mouseLeft1 < 0 || dataLen == 0 || noDataInRange) {
        idx = cursor.idx = null;
        for (let i = 0; i < series.length; i++) {
          let pt = cursorPts[i];
          pt != null && elTrans(pt, -10, -10, plotWidCss, plotHgtCss);
        }
        if (cursorFocus)
          setSeries(null, FOCUS_TRUE, true, src == null && syncOpts.setSeries);
        if (legend.live) {
          activeIdxs.fill(idx);
          shouldSetLegend = true;
        }
      } else {
        let mouseXPos, valAtPosX, xPos;
        if (mode2 == 1) {
          mouseXPos = scaleX.ori == 0 ? mouseLeft1 : mouseTop1;
          valAtPosX = posToVal(mouseXPos, xScaleKey);
          idx = cursor.idx = closestIdx(valAtPosX, data[0], i0, i1);
          xPos = valToPosX(data[0][idx], scaleX, xDim, 0);
        }
        let _ptLft = -10;
        let _ptTop = -10;
        let _ptWid = 0;
        let _ptHgt = 0;
        let _centered = true;
        let _ptFill = "";
        let _ptStroke = "";
        for (let i = mode2 == 2 ? 1 : 0; i < series.length; i++) {
          let s = series[i];
          let idx1 = activeIdxs[i];
          let yVal1 = idx1 == null ? null : mode2 == 1 ? data[i][idx1] : data[i][1][idx1];
          let idx2 = cursor.dataIdx(self, i, idx, valAtPosX);
          let yVal2 = idx2 == null ? null : mode2 == 1 ? data[i][idx2] : data[i][1][idx2];
          shouldSetLegend = shouldSetLegend || yVal2 != yVal1 || idx2 != idx1;
          activeIdxs[i] = idx2;
          if (i > 0 && s.show) {
            let xPos2 = idx2 == null ? -10 : idx2 == idx ? xPos : valToPosX(mode2 == 1 ? data[0][idx2] : data[i][0][idx2], scaleX, xDim, 0);
            let yPos = yVal2 == null ? -10 : valToPosY(yVal2, mode2 == 1 ? scales[s.scale] : scales[s.facets[1].scale], yDim, 0);
            if (cursorFocus && yVal2 != null) {
              let mouseYPos = scaleX.ori == 1 ? mouseLeft1 : mouseTop1;
              let dist = abs(focus.dist(self, i, idx2, yPos, mouseYPos));
              if (dist < closestDist) {
                let bias = focus.bias;
                if (bias != 0) {
                  let mouseYVal = posToVal(mouseYPos, s.scale);
                  let seriesYValSign = yVal2 >= 0 ? 1 : -1;
                  let mouseYValSign = mouseYVal >= 0 ? 1 : -1;
                  if (mouseYValSign == seriesYValSign && (mouseYValSign == 1 ? bias == 1 ? yVal2 >= mouseYVal : yVal2 <= mouseYVal : (
                    // >= 0
                    bias == 1 ? yVal2 <= mouseYVal : yVal2 >= mouseYVal
                  ))) {
                    closestDist = dist;
                    closestSeries = i;
                  }
                } else {
                  closestDist = dist;
                  closestSeries = i;
                }
              }
            }
            if (shouldSetLegend || cursorOnePt) {
              let hPos, vPos;
              if (scaleX.ori == 0) {
                hPos = xPos2;
                vPos = yPos;
              } else {
                hPos = yPos;
                vPos = xPos2;
              }
              let ptWid, ptHgt, ptLft, ptTop, ptStroke, ptFill, centered = true, getBBox = points2.bbox;
              if (getBBox != null) {
                centered = false;
                let bbox = getBBox(self, i);
                ptLft = bbox.left;
                ptTop = bbox.top;
                ptWid = bbox.width;
                ptHgt = bbox.height;
              } else {
                ptLft = hPos;
                ptTop = vPos;
                ptWid = ptHgt = points2.size(self, i);
              }
              ptFill = points2.fill(self, i);
              ptStroke = points2.stroke(self, i);
              if (cursorOnePt) {
                if (i == closestSeries && closestDist <= focus.prox) {
                  _ptLft = ptLft;
                  _ptTop = ptTop;
                  _ptWid = ptWid;
                  _ptHgt = ptHgt;
                  _centered = centered;
                  _ptFill = ptFill;
                  _ptStroke = ptStroke;
                }
              } else {
                let pt = cursorPts[i];
                if (pt != null) {
                  cursorPtsLft[i] = ptLft;
                  cursorPtsTop[i] = ptTop;
                  elSize(pt, ptWid, ptHgt, centered);
                  elColor(pt, ptFill, ptStroke);
                  elTrans(pt, ceil(ptLft), ceil(ptTop), plotWidCss, plotHgtCss);
                }
              }
            }
          }
        }
        if (cursorOnePt) {
          let p = focus.prox;
          let focusChanged = focusedSeries == null ? closestDist <= p : closestDist > p || closestSeries != focusedSeries;
          if (shouldSetLegend || focusChanged) {
            let pt = cursorPts[0];
            if (pt != null) {
              cursorPtsLft[0] = _ptLft;
              cursorPtsTop[0] = _ptTop;
              elSize(pt, _ptWid, _ptHgt, _centered);
              elColor(pt, _ptFill, _ptStroke);
              elTrans(pt, ceil(_ptLft), ceil(_ptTop), plotWidCss, plotHgtCss);
            }
          }
        }
      }
      if (select.show && dragging) {
        if (src != null) {
          let [xKey, yKey] = syncOpts.scales;
          let [matchXKeys, matchYKeys] = syncOpts.match;
          let [xKeySrc, yKeySrc] = src.cursor.sync.scales;
          let sdrag = src.cursor.drag;
          dragX = sdrag._x;
          dragY = sdrag._y;
          if (dragX || dragY) {
            let { left, top, width, height } = src.select;
            let sori = src.scales[xKeySrc].ori;
            let sPosToVal = src.posToVal;
            let sOff, sDim, sc, a, b;
            let matchingX = xKey != null && matchXKeys(xKey, xKeySrc);
            let matchingY = yKey != null && matchYKeys(yKey, yKeySrc);
            if (matchingX && dragX) {
              if (sori == 0) {
                sOff = left;
                sDim = width;
              } else {
                sOff = top;
                sDim = height;
              }
              sc = scales[xKey];
              a = valToPosX(sPosToVal(sOff, xKeySrc), sc, xDim, 0);
              b = valToPosX(sPosToVal(sOff + sDim, xKeySrc), sc, xDim, 0);
              setSelX(min(a, b), abs(b - a));
            } else
              setSelX(0, xDim);
            if (matchingY && dragY) {
              if (sori == 1) {
                sOff = left;
                sDim = width;
              } else {
                sOff = top;
                sDim = height;
              }
              sc = scales[yKey];
              a = valToPosY(sPosToVal(sOff, yKeySrc), sc, yDim, 0);
              b = valToPosY(sPosToVal(sOff + sDim, yKeySrc), sc, yDim, 0);
              setSelY(min(a, b), abs(b - a));
            } else
              setSelY(0, yDim);
          } else
            hideSelect();
        } else {
          let rawDX = abs(rawMouseLeft1 - rawMouseLeft0);
          let rawDY = abs(rawMouseTop1 - rawMouseTop0);
          if (scaleX.ori == 1) {
            let _rawDX = rawDX;
            rawDX = rawDY;
            rawDY = _rawDX;
          }
          dragX = drag.x && rawDX >= drag.dist;
          dragY = drag.y && rawDY >= drag.dist;
          let uni = drag.uni;
          if (uni != null) {
            if (dragX && dragY) {
              dragX = rawDX >= uni;
              dragY = rawDY >= uni;
              if (!dragX && !dragY) {
                if (rawDY > rawDX)
                  dragY = true;
                else
                  dragX = true;
              }
            }
          } else if (drag.x && drag.y && (dragX || dragY))
            dragX = dragY = true;
          let p0, p1;
          if (dragX) {
            if (scaleX.ori == 0) {
              p0 = mouseLeft0;
              p1 = mouseLeft1;
            } else {
              p0 = mouseTop0;
              p1 = mouseTop1;
            }
            setSelX(min(p0, p1), abs(p1 - p0));
            if (!dragY)
              setSelY(0, yDim);
          }
          if (dragY) {
            if (scaleX.ori == 1) {
              p0 = mouseLeft0;
              p1 = mouseLeft1;
            } else {
              p0 = mouseTop0;
              p1 = mouseTop1;
            }
            setSelY(min(p0, p1), abs(p1 - p0));
            if (!dragX)
              setSelX(0, xDim);
          }
          if (!dragX && !dragY) {
            setSelX(0, 0);
            setSelY(0, 0);
          }
        }
      }
      drag._x = dragX;
      drag._y = dragY;
      if (src == null) {
        if (_pub) {
          if (syncKey != null) {
            let [xSyncKey, ySyncKey] = syncOpts.scales;
            syncOpts.values[0] = xSyncKey != null ? posToVal(scaleX.ori == 0 ? mouseLeft1 : mouseTop1, xSyncKey) : null;
            syncOpts.values[1] = ySyncKey != null ? posToVal(scaleX.ori == 1 ? mouseLeft1 : mouseTop1, ySyncKey) : null;
          }
          pubSync(mousemove, self, mouseLeft1, mouseTop1, plotWidCss, plotHgtCss, idx);
        }
        if (cursorFocus) {
          let shouldPub = _pub && syncOpts.setSeries;
          let p = focus.prox;
          if (focusedSeries == null) {
            if (closestDist <= p)
              setSeries(closestSeries, FOCUS_TRUE, true, shouldPub);
          } else {
            if (closestDist > p)
              setSeries(null, FOCUS_TRUE, true, shouldPub);
            else if (closestSeries != focusedSeries)
              setSeries(closestSeries, FOCUS_TRUE, true, shouldPub);
          }
        }
      }
      if (shouldSetLegend) {
        legend.idx = idx;
        setLegend();
      }
      _fire !== false && fire("setCursor");
    }
    let rect2 = null;
    Object.defineProperty(self, "rect", {
      get() {
        if (rect2 == null)
          syncRect(false);
        return rect2;
      }
    });
    function syncRect(defer = false) {
      if (defer)
        rect2 = null;
      else {
        rect2 = over.getBoundingClientRect();
        fire("syncRect", rect2);
      }
    }
    function mouseMove(e, src, _l, _t, _w, _h, _i) {
      if (cursor._lock)
        return;
      if (dragging && e != null && e.movementX == 0 && e.movementY == 0)
        return;
      cacheMouse(e, src, _l, _t, _w, _h, _i, false, e != null);
      if (e != null)
        updateCursor(null, true, true);
      else
        updateCursor(src, true, false);
    }
    function cacheMouse(e, src, _l, _t, _w, _h, _i, initial, snap) {
      if (rect2 == null)
        syncRect(false);
      setCursorEvent(e);
      if (e != null) {
        _l = e.clientX - rect2.left;
        _t = e.clientY - rect2.top;
      } else {
        if (_l < 0 || _t < 0) {
          mouseLeft1 = -10;
          mouseTop1 = -10;
          return;
        }
        let [xKey, yKey] = syncOpts.scales;
        let syncOptsSrc = src.cursor.sync;
        let [xValSrc, yValSrc] = syncOptsSrc.values;
        let [xKeySrc, yKeySrc] = syncOptsSrc.scales;
        let [matchXKeys, matchYKeys] = syncOpts.match;
        let rotSrc = src.axes[0].side % 2 == 1;
        let xDim = scaleX.ori == 0 ? plotWidCss : plotHgtCss, yDim = scaleX.ori == 1 ? plotWidCss : plotHgtCss, _xDim = rotSrc ? _h : _w, _yDim = rotSrc ? _w : _h, _xPos = rotSrc ? _t : _l, _yPos = rotSrc ? _l : _t;
        if (xKeySrc != null)
          _l = matchXKeys(xKey, xKeySrc) ? getPos(xValSrc, scales[xKey], xDim, 0) : -10;
        else
          _l = xDim * (_xPos / _xDim);
        if (yKeySrc != null)
          _t = matchYKeys(yKey, yKeySrc) ? getPos(yValSrc, scales[yKey], yDim, 0) : -10;
        else
          _t = yDim * (_yPos / _yDim);
        if (scaleX.ori == 1) {
          let __l = _l;
          _l = _t;
          _t = __l;
        }
      }
      if (snap && (src == null || src.cursor.event.type == mousemove)) {
        if (_l <= 1 || _l >= plotWidCss - 1)
          _l = incrRound(_l, plotWidCss);
        if (_t <= 1 || _t >= plotHgtCss - 1)
          _t = incrRound(_t, plotHgtCss);
      }
      if (initial) {
        rawMouseLeft0 = _l;
        rawMouseTop0 = _t;
        [mouseLeft0, mouseTop0] = cursor.move(self, _l, _t);
      } else {
        mouseLeft1 = _l;
        mouseTop1 = _t;
      }
    }
    const _hideProps = {
      width: 0,
      height: 0,
      left: 0,
      top: 0
    };
    function hideSelect() {
      setSelect(_hideProps, false);
    }
    let downSelectLeft;
    let downSelectTop;
    let downSelectWidth;
    let downSelectHeight;
    function mouseDown(e, src, _l, _t, _w, _h, _i) {
      dragging = true;
      dragX = dragY = drag._x = drag._y = false;
      cacheMouse(e, src, _l, _t, _w, _h, _i, true, false);
      if (e != null) {
        onMouse(mouseup, doc, mouseUp, false);
        pubSync(mousedown, self, mouseLeft0, mouseTop0, plotWidCss, plotHgtCss, null);
      }
      let { left, top, width, height } = select;
      downSelectLeft = left;
      downSelectTop = top;
      downSelectWidth = width;
      downSelectHeight = height;
    }
    function mouseUp(e, src, _l, _t, _w, _h, _i) {
      dragging = drag._x = drag._y = false;
      cacheMouse(e, src, _l, _t, _w, _h, _i, false, true);
      let { left, top, width, height } = select;
      let hasSelect = width > 0 || height > 0;
      let chgSelect = downSelectLeft != left || downSelectTop != top || downSelectWidth != width || downSelectHeight != height;
      hasSelect && chgSelect && setSelect(select);
      if (drag.setScale && hasSelect && chgSelect) {
        let xOff = left, xDim = width, yOff = top, yDim = height;
        if (scaleX.ori == 1) {
          xOff = top, xDim = height, yOff = left, yDim = width;
        }
        if (dragX) {
          _setScale(
            xScaleKey,
            posToVal(xOff, xScaleKey),
            posToVal(xOff + xDim, xScaleKey)
          );
        }
        if (dragY) {
          for (let k in scales) {
            let sc = scales[k];
            if (k != xScaleKey && sc.from == null && sc.min != inf) {
              _setScale(
                k,
                posToVal(yOff + yDim, k),
                posToVal(yOff, k)
              );
            }
          }
        }
        hideSelect();
      } else if (cursor.lock) {
        cursor._lock = !cursor._lock;
        updateCursor(src, true, e != null);
      }
      if (e != null) {
        offMouse(mouseup, doc);
        pubSync(mouseup, self, mouseLeft1, mouseTop1, plotWidCss, plotHgtCss, null);
      }
    }
    function mouseLeave(e, src, _l, _t, _w, _h, _i) {
      if (cursor._lock)
        return;
      setCursorEvent(e);
      let _dragging = dragging;
      if (dragging) {
        let snapH = true;
        let snapV = true;
        let snapProx = 10;
        let dragH, dragV;
        if (scaleX.ori == 0) {
          dragH = dragX;
          dragV = dragY;
        } else {
          dragH = dragY;
          dragV = dragX;
        }
        if (dragH && dragV) {
          snapH = mouseLeft1 <= snapProx || mouseLeft1 >= plotWidCss - snapProx;
          snapV = mouseTop1 <= snapProx || mouseTop1 >= plotHgtCss - snapProx;
        }
        if (dragH && snapH)
          mouseLeft1 = mouseLeft1 < mouseLeft0 ? 0 : plotWidCss;
        if (dragV && snapV)
          mouseTop1 = mouseTop1 < mouseTop0 ? 0 : plotHgtCss;
        updateCursor(null, true, true);
        dragging = false;
      }
      mouseLeft1 = -10;
      mouseTop1 = -10;
      activeIdxs.fill(null);
      updateCursor(null, true, true);
      if (_dragging)
        dragging = _dragging;
    }
    function dblClick(e, src, _l, _t, _w, _h, _i) {
      if (cursor._lock)
        return;
      setCursorEvent(e);
      autoScaleX();
      hideSelect();
      if (e != null)
        pubSync(dblclick, self, mouseLeft1, mouseTop1, plotWidCss, plotHgtCss, null);
    }
    function syncPxRatio() {
      axes.forEach(syncFontSize);
      _setSize(self.width, self.height, true);
    }
    on(dppxchange, win, syncPxRatio);
    const events = {};
    events.mousedown = mouseDown;
    events.mousemove = mouseMove;
    events.mouseup = mouseUp;
    events.dblclick = dblClick;
    events["setSeries"] = (e, src, idx, opts2) => {
      let seriesIdxMatcher2 = syncOpts.match[2];
      idx = seriesIdxMatcher2(self, src, idx);
      idx != -1 && setSeries(idx, opts2, true, false);
    };
    if (showCursor) {
      onMouse(mousedown, over, mouseDown);
      onMouse(mousemove, over, mouseMove);
      onMouse(mouseenter, over, (e) => {
        setCursorEvent(e);
        syncRect(false);
      });
      onMouse(mouseleave, over, mouseLeave);
      onMouse(dblclick, over, dblClick);
      cursorPlots.add(self);
      self.syncRect = syncRect;
    }
    const hooks = self.hooks = opts.hooks || {};
    function fire(evName, a1, a2) {
      if (deferHooks)
        hooksQueue.push([evName, a1, a2]);
      else {
        if (evName in hooks) {
          hooks[evName].forEach((fn) => {
            fn.call(null, self, a1, a2);
          });
        }
      }
    }
    (opts.plugins || []).forEach((p) => {
      for (let evName in p.hooks)
        hooks[evName] = (hooks[evName] || []).concat(p.hooks[evName]);
    });
    const seriesIdxMatcher = (self2, src, srcSeriesIdx) => srcSeriesIdx;
    const syncOpts = assign({
      key: null,
      setSeries: false,
      filters: {
        pub: retTrue,
        sub: retTrue
      },
      scales: [xScaleKey, series[1] ? series[1].scale : null],
      match: [retEq, retEq, seriesIdxMatcher],
      values: [null, null]
    }, cursor.sync);
    if (syncOpts.match.length == 2)
      syncOpts.match.push(seriesIdxMatcher);
    cursor.sync = syncOpts;
    const syncKey = syncOpts.key;
    const sync = _sync(syncKey);
    function pubSync(type, src, x, y, w, h, i) {
      if (syncOpts.filters.pub(type, src, x, y, w, h, i))
        sync.pub(type, src, x, y, w, h, i);
    }
    sync.sub(self);
    function pub(type, src, x, y, w, h, i) {
      if (syncOpts.filters.sub(type, src, x, y, w, h, i))
        events[type](null, src, x, y, w, h, i);
    }
    self.pub = pub;
    function destroy() {
      sync.unsub(self);
      cursorPlots.delete(self);
      mouseListeners.clear();
      off(dppxchange, win, syncPxRatio);
      root.remove();
      legendTable?.remove();
      fire("destroy");
    }
    self.destroy = destroy;
    function _init() {
      fire("init", opts, data);
      setData(data || opts.data, false);
      if (pendScales[xScaleKey])
        setScale(xScaleKey, pendScales[xScaleKey]);
      else
        autoScaleX();
      shouldSetSelect = select.show && (select.width > 0 || select.height > 0);
      shouldSetCursor = shouldSetLegend = true;
      _setSize(opts.width, opts.height);
    }
    series.forEach(initSeries);
    axes.forEach(initAxis);
    if (then) {
      if (then instanceof HTMLElement) {
        then.appendChild(root);
        _init();
      } else
        then(self, _init);
    } else
      _init();
    return self;
  }
  uPlot.assign = assign;
  uPlot.fmtNum = fmtNum;
  uPlot.rangeNum = rangeNum;
  uPlot.rangeLog = rangeLog;
  uPlot.rangeAsinh = rangeAsinh;
  uPlot.orient = orient;
  uPlot.pxRatio = pxRatio;
  {
    uPlot.join = join;
  }
  {
    uPlot.fmtDate = fmtDate;
    uPlot.tzDate = tzDate;
  }
  uPlot.sync = _sync;
  {
    uPlot.addGap = addGap;
    uPlot.clipGaps = clipGaps;
    let paths = uPlot.paths = {
      points
    };
    paths.linear = linear;
    paths.stepped = stepped;
    paths.bars = bars;
    paths.spline = monotoneCubic;
  }

  // src/chart.js
  var MOST_CHIPS = 14;
  var FONT = "12px system-ui, sans-serif";
  var LABEL = 13;
  var UNIT = 18;
  var optionsOf = (plot, width, height) => ({
    width,
    height,
    legend: { show: false },
    padding: [6, 16, 0, 0],
    scales: {
      x: { time: false, range: () => plot.plots.window },
      y: { distr: plot.look.log ? 3 : 1, range: (u, low, high) => valuesOf(plot, u, low, high) }
    },
    axes: axesOf(plot.spec.unit, plot.look.log),
    series: [{}, ...plot.spec.lines.map(({ label }, k) => seriesOf(plot, label, k))],
    focus: { alpha: 0.22 },
    cursor: {
      drag: { x: false, y: false },
      points: { show: plot.spec.total <= MOST_CHIPS, size: 6 },
      focus: { prox: 14 },
      sync: { key: "gne", setSeries: false, scales: ["x", null] }
    },
    hooks: {
      drawAxes: [(u) => drawMarks(u, plot)],
      draw: [() => plot.setTime(plot.plots.now)],
      // the axis is another one only by now
      setCursor: [(u) => plot.hover(u)],
      // uPlot's types do not know what it tells here
      setSeries: [(_2, k, how) => plot.focusedByMouse(
        k,
        /** @type {any} */
        how
      )]
    }
  });
  var axesOf = (unit, log) => {
    const axis = {
      stroke: colour("muted"),
      font: FONT,
      grid: { stroke: colour("plot-grid"), width: 1 },
      ticks: { stroke: colour("plot-grid"), width: 1, size: 4 }
    };
    return [
      {
        ...axis,
        size: 24,
        gap: 2,
        space: 60,
        values: (_2, ticks2) => ticks2.map((v) => `${number(v, 6)} s`)
      },
      {
        ...axis,
        size: unit ? 50 : 50 + UNIT,
        // so that time is at the same place in all plots
        gap: 3,
        space: 24,
        label: unit || void 0,
        labelSize: UNIT,
        labelGap: 0,
        labelFont: FONT,
        // of powers of ten those that uPlot leaves in
        ...!log && { values: (_2, ticks2) => ticks2.map((v) => number(v, 6)) }
      }
    ];
  };
  var seriesOf = (plot, label, k) => {
    const look = plot.lines.lookOf(k);
    return {
      label,
      stroke: look.colour,
      dash: look.dash.length ? look.dash : void 0,
      width: plot.spec.groups.length > MOST_CHIPS ? 1 : 1.75,
      points: { show: false },
      spanGaps: false
    };
  };
  var valuesOf = (plot, u, low, high) => {
    const { look } = plot;
    if (look.values) return look.values;
    if (!look.log) return rangeY(plot, u.height, low, high);
    if (low === null || high === null || !(low > 0)) return [1e-3, 1];
    return [low / 1.5, high * 1.5];
  };
  var rangeY = ({ spec, movingBounds }, height, low, high) => {
    const { bounds } = spec;
    const moving = movingBounds.flatMap(({ values }) => values.filter((each) => each !== null));
    for (const value of [...bounds.map((bound) => bound.value), ...moving]) {
      low = low === null ? value : Math.min(low, value);
      high = high === null ? value : Math.max(high, value);
    }
    if (low === null || high === null || !Number.isFinite(low + high)) return [0, 1];
    const size = high - low || Math.abs(high) || 1;
    const room = bounds.length || moving.length ? 18 / Math.max(height - 36, 40) : 0.08;
    return [low - 0.07 * size, high + room * size * 1.2];
  };
  var drawMarks = (u, plot) => {
    const { ctx: context, bbox } = u;
    context.save();
    context.beginPath();
    context.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    context.clip();
    drawInterventions(u, plot.plots.source.interventions);
    for (const system of plot.spec.systems) drawApproach(u, plot, system);
    if (plot.look.log) return context.restore();
    drawBounds(u, plot.spec);
    drawMovingBounds(u, plot.movingBounds);
    context.restore();
  };
  var drawInterventions = (u, interventions) => {
    const { ctx: context, bbox } = u;
    context.strokeStyle = colour("muted");
    context.lineWidth = 1;
    context.setLineDash([2, 4]);
    for (const { time } of interventions) {
      const x = u.valToPos(time, "x", true);
      context.beginPath();
      context.moveTo(x, bbox.top);
      context.lineTo(x, bbox.top + bbox.height);
      context.stroke();
    }
  };
  var drawApproach = (u, { spec, plots }, system) => {
    if (plots.hiddenRuns.has(system.run)) return;
    const { margin_time: time } = plots.source.stateOf(system);
    if (typeof time !== "number") return;
    const { ctx: context, bbox } = u;
    const ratio = uPlot.pxRatio;
    const x = u.valToPos(time, "x", true);
    context.fillStyle = colour("limit");
    context.beginPath();
    context.moveTo(x, bbox.top + 8 * ratio);
    context.lineTo(x - 5 * ratio, bbox.top);
    context.lineTo(x + 5 * ratio, bbox.top);
    context.fill();
    if (spec.name !== "constraint" || spec.systems.length > 1) return;
    context.font = `${12 * ratio}px system-ui, sans-serif`;
    context.textBaseline = "top";
    const leftward = x > bbox.left + 0.7 * bbox.width;
    context.textAlign = leftward ? "right" : "left";
    context.fillText("closest approach", x + (leftward ? -8 : 8) * ratio, bbox.top);
  };
  var asBounds = (context, ratio) => {
    context.strokeStyle = context.fillStyle = colour("limit");
    context.lineWidth = 1.5 * ratio;
    context.font = `${12 * ratio}px system-ui, sans-serif`;
    context.textBaseline = "bottom";
    context.textAlign = "right";
    context.setLineDash([6 * ratio, 4 * ratio]);
  };
  var drawBounds = (u, { bounds, unit }) => {
    const { ctx: context, bbox } = u;
    const ratio = uPlot.pxRatio;
    asBounds(context, ratio);
    let last = Infinity;
    for (const { value, note } of bounds) {
      const y = u.valToPos(value, "y", true);
      context.beginPath();
      context.moveTo(bbox.left, y);
      context.lineTo(bbox.left + bbox.width, y);
      context.stroke();
      if (last - y < LABEL * ratio) continue;
      last = y;
      const text2 = `bound ${withUnit(value, unit)}${note}`;
      context.fillText(text2, bbox.left + bbox.width - 4 * ratio, y - 2 * ratio);
    }
  };
  var drawMovingBounds = (u, bounds) => {
    const { ctx: context, bbox } = u;
    const ratio = uPlot.pxRatio;
    asBounds(context, ratio);
    const time = u.data[0];
    for (const { values, note } of bounds) {
      context.beginPath();
      let last = null;
      values.forEach((value, i) => {
        if (value === null) return;
        const [x2, y2] = [u.valToPos(time[i], "x", true), u.valToPos(value, "y", true)];
        if (values[i - 1] === null || !last) context.moveTo(x2, y2);
        else context.lineTo(x2, y2);
        last = [x2, y2];
      });
      context.stroke();
      if (!last) continue;
      const [x, y] = (
        /** @type {[number, number]} */
        last
      );
      const right = Math.min(x, bbox.left + bbox.width - 4 * ratio);
      context.fillText(`bound${note}`, right, y - 2 * ratio);
    }
  };

  // src/chips.js
  var Chips = class {
    /** @param {Plot} plot */
    constructor(plot) {
      const { spec } = plot;
      const shown2 = spec.groups.length;
      this.plot = plot;
      this.root = element("div", { class: "plot-chips" });
      this.several = spec.total > shown2 ? `${shown2} of ${spec.total} shown` : "";
      this.note = element("span", { class: "plot-note", text: this.several });
      this.values = shown2 > MOST_CHIPS ? [] : spec.groups.map((_2, group) => this.add(group));
      this.readout = element("span", { class: "readout" });
      this.root.append(...this.values.length ? [] : [this.readout], this.note);
    }
    /**
     * The chip of a group of lines; returns where their values are written.
     * @param {number} group
     */
    add(group) {
      const { plot } = this;
      const { spec, lines } = plot;
      const [k] = spec.groups[group];
      const value = element("span", { class: "chip-value", "aria-hidden": true });
      const what = `${spec.noun} ${spec.lines[k].label}`.trim();
      const chip = element(
        "button",
        {
          type: "button",
          class: "plot-chip",
          title: `${what}: click switches the line, a double click shows it alone`,
          "aria-label": `line of ${what}`,
          onmouseenter: () => plot.point(k),
          onmouseleave: () => plot.point(null),
          onclick: () => this.change(() => lines.toggle(group)),
          ondblclick: () => this.change(() => lines.showOnly(group))
        },
        swatchOf(lines.lookOf(k)),
        spec.total === 1 ? "" : spec.shorts[k],
        value
      );
      this.root.append(chip);
      return value;
    }
    /** @param {() => void} act */
    change(act) {
      act();
      this.plot.showLines();
    }
    /** Says which lines are on. */
    press() {
      const { hidden } = this.plot.lines;
      this.values.forEach(
        (value, group) => value.parentElement && press(value.parentElement, !hidden.has(group))
      );
    }
    /**
     * The chip of a line stands out.
     * @param {number | null} k
     */
    mark(k) {
      const chosen = k === null ? -1 : this.plot.lines.groupOf(k);
      this.values.forEach(
        (value, group) => value.parentElement?.classList.toggle("chosen", group === chosen)
      );
    }
    /**
     * Values at a sample.
     * @param {number} i
     * @param {string[]} notes what else is said of the plot
     */
    write(i, notes) {
      const { plot } = this;
      const { spec, lines, focused: k } = plot;
      this.note.textContent = [this.several, ...notes].filter(Boolean).join(" · ");
      this.values.forEach((place, group) => {
        const seen = spec.groups[group].filter((each) => lines.runOn(each));
        place.textContent = seen.map((each) => plot.valueText(each, i)).join(" / ");
      });
      if (this.values.length) return;
      this.readout.textContent = k === null ? "point at a line for its value" : `${lines.nameOf(k)}: ${plot.valueText(k, i)} ${spec.unit}`.trim();
    }
  };

  // src/lines.js
  var Lines = class {
    /**
     * @param {Plots} plots
     * @param {Spec} spec
     * @param {Set<number>} hidden groups of lines that are switched off
     */
    constructor(plots, spec, hidden) {
      this.plots = plots;
      this.spec = spec;
      this.hidden = hidden;
    }
    /**
     * Colour and dash of the k-th line.
     * @param {number} k
     */
    lookOf(k) {
      const { spec } = this;
      const { agent, column, system } = spec.lines[k];
      const look = spec.total === 1 ? { colour: colour("text"), dash: [] } : line(agent ?? column);
      return spec.systems.length > 1 ? { ...look, dash: dashOf(system.run) } : look;
    }
    /**
     * What the k-th line is.
     * @param {number} k
     */
    nameOf(k) {
      const { label, system } = this.spec.lines[k];
      const whose = this.spec.systems.length > 1 ? `, ${this.plots.headingOf(system.run)}` : "";
      return `${this.spec.noun} ${label}`.trim() + whose;
    }
    /**
     * The same in few characters.
     * @param {number} k
     */
    shortOf(k) {
      const { shorts, systems, lines, total } = this.spec;
      const short = total === 1 ? "" : shorts[k];
      return systems.length > 1 ? `${short} ${this.plots.headingOf(lines[k].system.run)}`.trim() : short;
    }
    /**
     * Which lines have their key in common with the k-th.
     * @param {number} k
     */
    groupOf(k) {
      return this.spec.groups.findIndex((group) => group.includes(k));
    }
    /**
     * Whether the k-th line is drawn.
     * @param {number} k
     */
    shows(k) {
      return !this.hidden.has(this.groupOf(k)) && this.runOn(k);
    }
    /**
     * Whether the run is on that the k-th line is of.
     * @param {number} k
     */
    runOn(k) {
      return !this.plots.hiddenRuns.has(this.spec.lines[k].system.run);
    }
    /** @param {number} group */
    toggle(group) {
      if (!this.hidden.delete(group)) this.hidden.add(group);
    }
    /** @param {number} group */
    showOnly(group) {
      this.hidden.clear();
      for (const each of this.spec.groups.keys()) if (each !== group) this.hidden.add(each);
    }
    /** The lines that are drawn. */
    get on() {
      return [...this.spec.lines.keys()].filter((k) => this.shows(k));
    }
  };

  // src/window.js
  var NARROWEST = 1e-4;
  var STEP = 0.7;
  var SLOP = 4;
  var scaled = ([from, to], around, factor) => [
    around - (around - from) * factor,
    around + (to - around) * factor
  ];
  var within = ([from, to], whole) => {
    const width = Math.max(to - from, NARROWEST * whole);
    if (!(width < 0.999 * whole)) return null;
    const begin = Math.min(Math.max(from, 0), whole - width);
    return [begin, begin + width];
  };
  var Hands = class {
    /**
     * @param {Plot} plot
     * @param {uPlot} u
     */
    constructor(plot, u) {
      this.plot = plot;
      this.u = u;
      this.mark = element("div", { class: "stretch", hidden: true });
      u.over.append(this.mark);
      this.down = /* @__PURE__ */ new Map();
      this.doing = null;
      this.begun = 0;
      u.root.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
      u.root.addEventListener("pointerdown", (event) => this.press(event));
      u.root.addEventListener("pointermove", (event) => this.drag(event));
      for (
        const name of
        /** @type {const} */
        ["pointerup", "pointercancel"]
      )
        u.root.addEventListener(name, (event) => this.release(event));
      u.root.addEventListener("dblclick", () => plot.plots.showAll());
    }
    /**
     * Which part of the plot a point is in, and where in it.
     * @param {MouseEvent} event
     */
    at({ clientX, clientY }) {
      const box = this.u.over.getBoundingClientRect();
      const [x, y] = [clientX - box.left, clientY - box.top];
      const part = x < 0 ? "values" : y > box.height ? "time" : "lines";
      return { part, x, y };
    }
    /** @param {WheelEvent} event */
    wheel(event) {
      const { part, x, y } = this.at(event);
      if (part === "lines" && !event.ctrlKey) return;
      event.preventDefault();
      const factor = event.deltaY > 0 ? 1 / STEP : STEP;
      if (part === "values") this.plot.zoomValues(factor, y);
      else this.plot.plots.zoom(factor, this.u.posToVal(x, "x"));
    }
    /** @param {PointerEvent} event */
    press(event) {
      if (event.button !== 0) return;
      const { part, x, y } = this.at(event);
      this.down.set(event.pointerId, { x, y });
      this.u.root.setPointerCapture(event.pointerId);
      if (this.down.size > 1) this.doing = "pinch";
      else if (part === "values" || part === "time") this.doing = part;
      else if (event.shiftKey || !this.plot.plots.source.seekable)
        this.doing = event.pointerType === "touch" ? "time" : "stretch";
      else this.doing = "seek";
      this.begun = x;
      if (this.doing === "seek" && event.pointerType !== "touch") this.seek(x);
    }
    /** @param {PointerEvent} event */
    drag(event) {
      const before = this.down.get(event.pointerId);
      if (!before) return;
      const { x, y } = this.at(event);
      const { plots } = this.plot;
      const moved = event.pointerType !== "touch" || Math.abs(x - this.begun) > SLOP;
      if (this.doing === "seek" && moved) this.seek(x);
      if (this.doing === "stretch") this.showMark(x);
      if (this.doing === "time") plots.pan(this.u.posToVal(before.x, "x") - this.u.posToVal(x, "x"));
      if (this.doing === "values") this.plot.panValues(before.y, y);
      if (this.doing === "pinch") this.pinch(event.pointerId, x);
      this.down.set(event.pointerId, { x, y });
    }
    /**
     * Two fingers stretch time between them.
     * @param {number} finger that moves
     * @param {number} x where it is now
     */
    pinch(finger, x) {
      const other = [...this.down].find(([id]) => id !== finger)?.[1].x;
      const before = this.down.get(finger)?.x;
      if (other === void 0 || before === void 0) return;
      const [wide, now] = [Math.abs(before - other), Math.abs(x - other)];
      if (wide > 10 && now > 10) this.plot.plots.zoom(wide / now, this.u.posToVal(other, "x"));
    }
    /** @param {PointerEvent} event */
    release(event) {
      const stands = this.down.get(event.pointerId);
      this.down.delete(event.pointerId);
      this.mark.hidden = true;
      if (this.doing === "seek" && stands && event.type === "pointerup") this.seek(stands.x);
      if (this.doing === "stretch" && stands && Math.abs(stands.x - this.begun) > SLOP) {
        const ends = [this.begun, stands.x].map((x) => this.u.posToVal(x, "x"));
        this.plot.plots.show([Math.min(...ends), Math.max(...ends)]);
      }
      if (!this.down.size) this.doing = null;
    }
    /** @param {number} x */
    seek(x) {
      this.plot.plots.callbacks.seek(this.u.posToVal(x, "x"));
    }
    /** @param {number} x */
    showMark(x) {
      this.mark.hidden = false;
      this.mark.style.left = `${Math.min(x, this.begun)}px`;
      this.mark.style.width = `${Math.abs(x - this.begun)}px`;
    }
  };

  // src/reading.js
  var FAR = 10;
  var Reading = class {
    /** @param {Plot} plot */
    constructor(plot) {
      this.plot = plot;
      this.spoken = element("span", { class: "unseen", role: "status" });
    }
    /**
     * Keys of a plot that has the focus read its values, and zoom.
     * @param {KeyboardEvent} event
     */
    key(event) {
      const u = this.plot.uplot;
      if (!u || event.ctrlKey || event.metaKey || event.altKey) return;
      const last = u.data[0].length - 1;
      const now = this.plot.hovered ?? u.valToIdx(this.plot.plots.now);
      const by = event.shiftKey ? FAR : 1;
      const actions = {
        ArrowLeft: () => this.at(Math.max(now - by, 0)),
        ArrowRight: () => this.at(Math.min(now + by, last)),
        Home: () => this.at(u.valToIdx(this.plot.plots.window[0])),
        End: () => this.at(u.valToIdx(this.plot.plots.window[1])),
        Escape: () => this.at(null),
        "+": () => this.plot.plots.zoom(STEP, u.data[0][now]),
        "=": () => this.plot.plots.zoom(STEP, u.data[0][now]),
        "-": () => this.plot.plots.zoom(1 / STEP, u.data[0][now]),
        0: () => this.plot.plots.showAll()
      };
      if (!actions[event.key]) return;
      event.preventDefault();
      event.stopPropagation();
      actions[event.key]();
    }
    /** @param {number | null} i of a sample */
    at(i) {
      const u = this.plot.uplot;
      if (!u) return;
      this.plot.hovered = i;
      const left = i === null ? -10 : u.valToPos(u.data[0][i], "x");
      u.setCursor({ left, top: i === null ? -10 : 1 }, false);
      this.plot.hovered = i;
      this.plot.writeValues();
      this.spoken.textContent = i === null ? "" : this.sentence(u, i);
    }
    /**
     * @param {uPlot} u
     * @param {number} i
     */
    sentence(u, i) {
      const { spec } = this.plot;
      const on2 = this.plot.lines.on.slice(0, MOST_CHIPS);
      const values = on2.map((k) => `${this.plot.lines.nameOf(k)} ${this.plot.valueText(k, i)}`);
      return `${fixed(u.data[0][i], 2)} s: ${values.join(", ")} ${spec.unit}`;
    }
  };

  // src/specs.js
  var MOST_LINES = 40;
  var shortOf = (labels) => {
    if (labels.length < 2) return labels;
    const [first] = labels;
    let n = 0;
    while (n < first.length && labels.every((each) => each[n] === first[n])) n++;
    const common = first.slice(0, n).lastIndexOf(" ") + 1;
    return labels.map(
      (each) => each.slice(common).replace(/\bagents? /g, "").replace(/ and /g, "–").replace(/ to /g, "→").replace(/_(\d)\b/g, (_2, digit) => "₀₁₂₃₄₅₆₇₈₉"[digit])
    );
  };
  var keyed = (labels) => labels.map((label, k) => {
    const before = labels.slice(0, k).filter((each) => each === label).length;
    return { label, key: before ? `${label} ${before + 1}` : label };
  });
  var actionsOf = (system) => {
    const { action, agent_name: noun } = system;
    return [...new Set(action.axis)].map((axis) => {
      const columns = [...action.owner.keys()].filter((k) => action.axis[k] === axis);
      return {
        systems: [system],
        whose: system.name,
        name: "action",
        axis,
        unit: action.unit,
        title: axis ? `${action.name}, ${axis}` : action.name,
        symbol: "",
        noun,
        lines: keyed(columns.map((column) => String(action.owner[column]))).map((named, k) => ({
          ...named,
          system,
          array: `${system.name}/action`,
          column: columns[k],
          agent: action.owner[columns[k]] - 1,
          moving: []
        })),
        bounds: []
      };
    });
  };
  var quantityOf = (system, quantity) => {
    const ofAgents = quantity.labels.length === system.agents && system.agents > 1;
    const moving = Object.values(quantity.moving_bounds).map(
      (each) => `${system.name}/quantity/${each}`
    );
    return {
      systems: [system],
      whose: system.name,
      name: quantity.name,
      axis: "",
      unit: quantity.unit,
      title: quantity.long_name,
      symbol: quantity.symbol,
      noun: ofAgents ? system.agent_name : "",
      lines: keyed(quantity.labels.map((label) => label || quantity.long_name)).map((named, column) => ({
        ...named,
        system,
        array: `${system.name}/quantity/${quantity.name}`,
        column,
        agent: ofAgents ? column : null,
        moving
      })),
      bounds: boundsOf(quantity)
    };
  };
  var boundsOf = ({ bound, lower_bound, labels }) => {
    const found = /* @__PURE__ */ new Map();
    const shorts = shortOf(labels);
    for (const values of [bound, lower_bound])
      (values ?? []).forEach((value, k) => {
        if (value === null || !Number.isFinite(value)) return;
        found.set(value, [...found.get(value) ?? [], shorts[k]]);
      });
    return [...found].map(([value, whose]) => ({ value, note: noteOf(whose, labels.length) })).sort((a, b) => a.value - b.value);
  };
  var movingBoundsOf = ({ lines, shorts }, store) => {
    const found = /* @__PURE__ */ new Map();
    lines.forEach(({ moving, column }, k) => {
      for (const array of moving) {
        const values = store.column(array, column);
        if (values.every((value) => value === null)) continue;
        const key = values.join();
        const known = found.get(key) ?? { values, whose: /* @__PURE__ */ new Set() };
        found.set(key, known);
        known.whose.add(shorts[k]);
      }
    });
    return [...found.values()].map(({ values, whose }) => ({
      values,
      note: noteOf([...whose], new Set(shorts).size)
    }));
  };
  var noteOf = (whose, of) => {
    const note = `: ${whose.join(", ")}`;
    return whose.length < of && note.length < 20 ? note : "";
  };
  var evenly = (n, most) => {
    if (n <= most) return [...Array(n).keys()];
    return [...Array(most).keys()].map((k) => Math.round(k * (n - 1) / (most - 1)));
  };
  var thinned = (whole, runs = 1) => {
    const keys = [...new Set(whole.lines.map(({ key }) => key))];
    const chosen = evenly(keys.length, Math.floor(MOST_LINES / runs)).map((k) => keys[k]);
    const shorts = shortOf(keys.map((key) => whole.lines.find((line2) => line2.key === key)?.label ?? ""));
    const lines = whole.lines.filter(({ key }) => chosen.includes(key));
    return {
      ...whole,
      total: keys.length,
      lines,
      shorts: lines.map(({ key }) => shorts[keys.indexOf(key)]),
      groups: chosen.map((key) => [...lines.keys()].filter((k) => lines[k].key === key))
    };
  };
  var wholesOf = (system) => [
    ...actionsOf(system),
    ...system.quantities.map((quantity) => quantityOf(system, quantity))
  ];

  // src/timeline.js
  var TimeLine = class {
    /** @param {HTMLElement} root */
    constructor(root) {
      this.root = root;
      this.x = NaN;
    }
    /**
     * @param {uPlot} u
     * @param {number} time
     */
    place(u, time) {
      const x = Math.round(u.valToPos(time, "x"));
      if (this.x === x) return;
      this.x = x;
      this.root.style.transform = `translateX(${x}px)`;
      const seen = x >= 0 && x <= u.over.clientWidth;
      this.root.style.visibility = seen ? "visible" : "hidden";
    }
  };
  var exitLine = (whose) => element(
    "div",
    { class: "exit-line", hidden: true },
    element("span", { text: `${whose} left the set`.trim() })
  );

  // src/plot.js
  var Plot = class {
    /**
     * @param {Plots} plots
     * @param {Spec} spec
     * @param {Look} look
     */
    constructor(plots, spec, look) {
      this.plots = plots;
      this.spec = spec;
      this.look = look;
      this.lines = new Lines(plots, spec, look.hidden);
      this.hovered = null;
      this.focused = null;
      this.uplot = null;
      this.movingBounds = [];
      this.mouseInside = false;
      this.chips = new Chips(this);
      this.reading = new Reading(this);
      const name = `${[spec.whose, spec.title].filter(Boolean).join(": ")} over time`;
      this.chart = element("div", {
        class: "chart",
        tabindex: 0,
        role: "group",
        "aria-label": `${name}; arrow keys read values`,
        onkeydown: (event) => this.reading.key(event),
        onblur: () => this.reading.at(null)
      });
      this.root = element("figure", { class: "plot", "aria-label": name });
      this.root.append(captionOf(this), this.chips.root, this.chart, this.reading.spoken);
      this.timeLine = new TimeLine(element("div", { class: "time-line" }));
      this.exitLines = spec.systems.map((system) => ({
        system,
        line: new TimeLine(exitLine(plots.headingOf(system.run)))
      }));
    }
    showLines() {
      const { lines, spec, uplot } = this;
      uplot?.batch(() => {
        for (const k of spec.lines.keys()) uplot.setSeries(k + 1, { show: lines.shows(k) });
      });
      this.chips.press();
      this.writeValues();
    }
    /**
     * One line is pointed at: it stands out, and so does its agent in the scene.
     * @param {number | null} k
     */
    point(k) {
      this.focus(k);
      this.tell(k);
    }
    /** @param {number | null} k */
    tell(k) {
      const { agent = null, system } = k === null ? {} : this.spec.lines[k];
      const which = agent === null || !system ? null : { system: system.name, agent };
      this.plots.callbacks.highlight(which, this);
    }
    /** @param {number | null} k */
    focus(k) {
      if (this.focused === k) return;
      this.focused = k;
      this.chips.mark(k);
      this.uplot?.setSeries(k === null ? (
        /** @type {any} */
        null
      ) : k + 1, { focus: true });
    }
    /** @param {Agent | null} which */
    highlight(which) {
      const k = this.spec.lines.findIndex(
        ({ system, agent }) => system.name === which?.system && agent === which.agent
      );
      this.focus(k < 0 ? null : k);
    }
    // ---- uPlot
    /**
     * @param {number} width
     * @param {number} height
     */
    setSize(width, height) {
      if (this.uplot) return this.uplot.setSize({ width, height });
      this.make(width, height);
    }
    /**
     * @param {number} width
     * @param {number} height
     */
    make(width, height) {
      this.uplot?.destroy();
      this.uplot = new uPlot(optionsOf(this, width, height), this.data(), this.chart);
      const { over } = this.uplot;
      const lines = [this.timeLine, ...this.exitLines.map((each) => each.line)];
      for (const each of lines) each.x = NaN;
      over.append(...lines.map(({ root }) => root));
      new Hands(this, this.uplot);
      over.addEventListener("mouseenter", () => this.mouseInside = true);
      over.addEventListener("mouseleave", () => {
        this.mouseInside = false;
        this.point(null);
      });
      this.plots.place(this);
    }
    /** @param {boolean} log */
    setLogarithmic(log) {
      Object.assign(this.look, { log, values: null });
      if (this.uplot) this.make(this.uplot.width, this.uplot.height);
    }
    /** Whether what is drawn is the values' negative: of what must stay below 0 the margin. */
    get turned() {
      return this.look.log && this.spec.name === "constraint";
    }
    /** The columns as they are. */
    columns() {
      const { store } = this.plots.source;
      return this.spec.lines.map(({ array, column }) => store.column(array, column));
    }
    /** @returns {uPlot.AlignedData} */
    data() {
      const { store } = this.plots.source;
      this.movingBounds = movingBoundsOf(this.spec, store);
      if (!this.look.log) return [store.time, ...this.columns()];
      const sign2 = this.turned ? -1 : 1;
      const drawn = this.columns().map(
        (column) => column.map((value) => value !== null && sign2 * value > 0 ? sign2 * value : null)
      );
      return [store.time, ...drawn];
    }
    /** @param {(position: number) => number} move of where an edge is, px, to where it was */
    moveValues(move) {
      const u = this.uplot;
      if (!u) return;
      const [top, bottom] = [0, u.over.clientHeight].map((edge) => u.posToVal(move(edge), "y"));
      this.look.values = [Math.min(top, bottom), Math.max(top, bottom)];
      u.setData(u.data, true);
    }
    /**
     * @param {number} factor
     * @param {number} around px
     */
    zoomValues(factor, around) {
      const [top, bottom] = scaled([0, this.uplot?.over.clientHeight ?? 1], around, factor);
      const high = this.uplot?.over.clientHeight ?? 1;
      this.moveValues((edge) => top + (bottom - top) * edge / high);
    }
    /**
     * @param {number} from px
     * @param {number} to
     */
    panValues(from, to) {
      this.moveValues((edge) => edge + from - to);
    }
    // ---- values
    /**
     * The mouse is somewhere over this plot, or over one beside it.
     * @param {uPlot} u
     */
    hover(u) {
      const { idx = null, left = -1 } = u.cursor;
      this.hovered = left >= 0 ? idx : null;
      this.writeValues();
    }
    /**
     * @param {number | null} k
     * @param {{focus?: boolean}} how
     */
    focusedByMouse(k, how) {
      if (how?.focus === void 0 || this.uplot?.cursor.left === void 0) return;
      if (!this.mouseInside) return;
      const focused = k === null || k === void 0 ? null : k - 1;
      if (focused === this.focused) return;
      this.focused = focused;
      this.chips.mark(focused);
      this.tell(focused);
    }
    refresh() {
      this.uplot?.setData(this.data(), true);
      this.writeValues();
    }
    /** @param {number} t */
    setTime(t) {
      if (!this.uplot) return;
      this.timeLine.place(this.uplot, t);
      for (const { system, line: own } of this.exitLines) {
        const exit = this.plots.source.exits[system.name];
        const { root } = own;
        root.hidden = !Number.isFinite(exit) || this.plots.hiddenRuns.has(system.run);
        if (root.hidden) continue;
        own.place(this.uplot, exit);
        const [from, to] = this.plots.window;
        root.classList.toggle("leftward", exit > from + 0.7 * (to - from));
      }
    }
    /**
     * @param {number} k
     * @param {number} i
     */
    valueText(k, i) {
      const { store } = this.plots.source;
      const value = this.uplot?.data[k + 1][i] ?? null;
      return fixed(value, decimals(store.greatest(this.spec.lines[k].array)));
    }
    /** Values at the mouse, or now. */
    writeValues() {
      const u = this.uplot;
      if (!u) return;
      const i = this.hovered ?? u.valToIdx(this.plots.now);
      const hover = this.hovered === null ? "" : `at ${fixed(u.data[0][i] ?? null, 2)} s`;
      const turned = this.turned ? "margin −g, log" : this.look.log ? "log" : "";
      this.chips.write(i, [turned, hover]);
    }
  };

  // src/compared.js
  var plottedOf = ({ systems, runs }) => {
    const all = systems.flatMap(wholesOf);
    if (!runs) return { specs: all.map((whole) => thinned(whole)), left: "" };
    const whose = (system) => runs[system.run].systems[system.name];
    const found = /* @__PURE__ */ new Map();
    for (const whole of all) {
      const key = [whose(whole.systems[0]), whole.name, whole.axis, whole.unit].join("\n");
      found.set(key, [...found.get(key) ?? [], whole]);
    }
    const joined2 = [...found.values()].map((wholes) => joinedOf(wholes, runs, whose(wholes[0].systems[0])));
    const common = joined2.flatMap(({ whole }) => whole ? [thinned(whole, runs.length)] : []);
    if (!common.length)
      return {
        specs: all.map((whole) => thinned(whole)),
        left: "These runs have no variable in common; each has plots of its own."
      };
    const left = joined2.flatMap((each) => each.left);
    return { specs: common, left: left.length ? `Of one run alone, and not plotted: ${left.join("; ")}.` : "" };
  };
  var joinedOf = (wholes, runs, whose) => {
    const lines = wholes.flatMap((whole) => whole.lines);
    const often = (line2) => lines.filter(({ key }) => key === line2.key).length > 1;
    const common = lines.filter(often);
    const left = wholes.flatMap((whole) => {
      const alone = whole.lines.filter((line2) => !often(line2));
      return alone.length ? [leftOf(whole, alone, runs)] : [];
    });
    if (!common.length) return { whole: null, left };
    const of = wholes.filter((whole) => whole.lines.some(often));
    return {
      whole: {
        ...of[0],
        systems: of.flatMap((whole) => whole.systems),
        whose,
        lines: common,
        bounds: boundsOf2(of, runs)
      },
      left
    };
  };
  var leftOf = ({ systems: [{ run }], title, noun, lines }, alone, runs) => {
    const labels = alone.map(({ label }) => label).join(", ");
    const whose = /^\d/.test(labels) ? `${noun} ${labels}` : labels;
    const part = alone.length < lines.length ? ` of ${whose}` : "";
    return `${title}${part} (${runs[run].heading})`;
  };
  var boundsOf2 = (wholes, runs) => {
    const found = /* @__PURE__ */ new Map();
    for (const { bounds, systems } of wholes)
      for (const { value, note } of bounds) {
        const known = found.get(value) ?? { note, whose: [] };
        known.whose.push(runs[systems[0].run].heading);
        found.set(value, known);
      }
    return [...found].map(([value, { note, whose }]) => ({
      value,
      note: whose.length < wholes.length ? `: ${whose.join("; ")}` : note
    })).sort((a, b) => a.value - b.value);
  };

  // src/plots.js
  var AROUND = 0.04;
  var PART = 0.35;
  var niceSpan = (t) => {
    const ten = 10 ** Math.floor(Math.log10(t));
    return ten * ([1, 1.5, 2, 3, 5, 7.5].find((step) => step * ten >= t) ?? 10);
  };
  var Plots = class {
    /**
     * @param {HTMLElement} column where they are put
     * @param {object} callbacks
     * @param {(time: number) => void} callbacks.seek
     * @param {(which: Agent | null, plot: Plot) => void} callbacks.highlight
     */
    constructor(column, callbacks) {
      this.column = column;
      this.callbacks = callbacks;
      this.plots = [];
      this.meta = null;
      this.source = /** @type {any} */
      null;
      this.now = 0;
      this.size = "";
      this.stretch = null;
      this.looks = /* @__PURE__ */ new Map();
      this.hiddenRuns = /* @__PURE__ */ new Set();
      this.runs = element("div", { id: "run-keys", role: "group", "aria-label": "runs" });
      this.left = element("p", { class: "muted small", id: "plots-left", hidden: true });
      this.shown = element("span", { class: "muted", role: "status" });
      this.all = this.tool("All", "All of the run (0)", () => this.showAll());
      this.tools = element(
        "div",
        { id: "plot-tools", role: "toolbar", "aria-label": "time that plots show" },
        this.tool("−", "More time (−)", () => this.zoom(1 / STEP)),
        this.tool("+", "Less time (+)", () => this.zoom(STEP)),
        this.all,
        this.shown
      );
      new ResizeObserver(() => this.resize()).observe(column);
    }
    /**
     * @param {string} text
     * @param {string} title
     * @param {() => void} onclick
     */
    tool(text2, title, onclick) {
      return element("button", { type: "button", class: "tool", text: text2, title, onclick });
    }
    /**
     * Plots for a scene.
     * @param {Scene} meta
     * @param {Source} source
     */
    setScene(meta, source) {
      if (meta !== this.meta) {
        this.looks.clear();
        this.stretch = null;
      }
      this.meta = meta;
      this.source = source;
      const { specs, left } = plottedOf(meta);
      this.left.textContent = left;
      this.left.hidden = !left;
      this.plots = specs.map((spec) => {
        const key = `${spec.lines[0].array} ${spec.axis}`;
        const look = this.looks.get(key) ?? { hidden: /* @__PURE__ */ new Set(), log: false, values: null };
        this.looks.set(key, look);
        return new Plot(this, spec, look);
      });
      const figures = this.plots.map((plot) => plot.root);
      this.column.replaceChildren(this.tools, this.runs, ...figures, this.left);
      this.size = "";
      this.resize();
      this.tellStretch();
    }
    // ---- the time that is shown
    /** @returns {Stretch} */
    get window() {
      return this.stretch ?? [0, this.span()];
    }
    /** @param {Stretch | null} stretch */
    show(stretch) {
      this.stretch = stretch && within(stretch, this.span());
      for (const { uplot } of this.plots) uplot?.setData(uplot.data, true);
      this.tellStretch();
    }
    showAll() {
      for (const { look } of this.plots) look.values = null;
      this.show(null);
    }
    /**
     * @param {number} factor
     * @param {number} around s
     */
    zoom(factor, around = this.now) {
      const [from, to] = this.window;
      const middle = around < from || around > to ? (from + to) / 2 : around;
      this.show(scaled([from, to], middle, factor));
    }
    /** @param {number} seconds */
    pan(seconds) {
      if (this.stretch) this.show([this.stretch[0] + seconds, this.stretch[1] + seconds]);
    }
    /**
     * A moment, with some time on both sides.
     * @param {number} time
     */
    showAround(time) {
      const far = AROUND * this.span();
      this.show([time - far, time + far]);
    }
    tellStretch() {
      const [from, to] = this.window;
      this.shown.textContent = this.stretch ? `${number(from, 4)} to ${number(to, 4)} s` : "";
    }
    /** @param {Source} source */
    setSource(source) {
      this.source = source;
      this.refresh();
    }
    restyle() {
      if (this.meta) this.setScene(this.meta, this.source);
    }
    /** Right end of the time axis: the run's, or live a round number beyond what is there. */
    span() {
      const { exits, seekable, store } = this.source;
      const last = store.time.at(-1) ?? 0;
      const duration = this.meta?.duration;
      const exit = Math.max(0, ...Object.values(exits));
      if (seekable) return Math.max(last, 1.06 * exit, 1e-6);
      const nice = niceSpan(Math.max(last, 2));
      return duration && last <= duration ? Math.min(nice, duration) : nice;
    }
    resize() {
      if (!this.meta || !this.column.clientWidth) return;
      const width = this.column.clientWidth - 24;
      const height = Math.floor(Math.min(Math.max(this.room(), 112), 300));
      const size = `${width} ${height}`;
      if (size === this.size) return;
      this.size = size;
      for (const plot of this.plots) plot.setSize(width, height);
      for (const plot of this.plots) plot.setTime(this.now);
    }
    /** Height of a chart in px, for as many as fit. */
    room() {
      const { column, plots, tools, runs, left } = this;
      if (getComputedStyle(column).overflowY === "visible") return PART * innerHeight;
      const extra = plots.reduce(
        (sum, { root, chart }) => sum + root.offsetHeight - chart.offsetHeight,
        tools.offsetHeight + runs.offsetHeight + left.offsetHeight
      );
      return (column.clientHeight - extra - 16) / Math.max(plots.length, 1);
    }
    /** @param {Plot} plot whose chart is new */
    place(plot) {
      plot.setTime(this.now);
      plot.showLines();
      plot.writeValues();
    }
    refresh() {
      for (const plot of this.plots) plot.refresh();
    }
    /** Other lines are switched on, or those of another run. */
    showLines() {
      for (const plot of this.plots) plot.showLines();
    }
    /**
     * The heading of a run, where there are several.
     * @param {number} run
     */
    headingOf(run) {
      return this.meta?.runs?.[run].heading ?? "";
    }
    /** @param {number} t */
    setTime(t) {
      this.now = t;
      for (const plot of this.plots) plot.setTime(t);
    }
    writeValues() {
      for (const plot of this.plots) plot.writeValues();
    }
    /**
     * @param {Agent | null} which
     * @param {Plot} [except]
     */
    highlight(which, except) {
      for (const plot of this.plots) if (plot !== except) plot.highlight(which);
    }
    describe() {
      return this.plots.map(({ spec, uplot, look, lines, movingBounds }) => ({
        system: spec.whose,
        name: spec.name,
        axis: spec.axis,
        title: spec.title,
        series: spec.lines.map(({ label }) => label),
        total: spec.total,
        bounds: spec.bounds.map(({ value }) => value),
        moving: movingBounds.length,
        width: uplot?.width ?? 0,
        samples: uplot?.data[0].length ?? 0,
        time: uplot && [uplot.scales.x.min, uplot.scales.x.max],
        values: uplot && [uplot.scales.y.min, uplot.scales.y.max],
        hidden: [...look.hidden],
        shown: [...spec.lines.keys()].map((k) => lines.shows(k)),
        colours: [...spec.lines.keys()].map((k) => lines.lookOf(k).colour),
        dashes: [...spec.lines.keys()].map((k) => lines.lookOf(k).dash),
        log: look.log
      }));
    }
  };

  // src/meshcat.js
  var { THREE, Viewer } = MeshCat;

  // src/bars.js
  var PITCH = 0.62;
  var WIDTH2 = 0.4;
  var FAINT = 0.35;
  var WIDER = 1.25;
  var GAUGE = 1.7;
  var TALL = 1.9;
  var BOX = new THREE.BoxGeometry(1, 1, 1).translate(0, 0, 0.5);
  var EDGES = new THREE.EdgesGeometry(BOX);
  var mesh = (color, opacity = 1) => new THREE.Mesh(
    BOX,
    new THREE.MeshPhongMaterial({
      color,
      transparent: opacity < 1,
      opacity,
      shininess: 12
    })
  );
  var setHeight = (object, height) => {
    object.scale.z = Math.abs(height) < 1e-4 ? 1e-4 : height;
  };
  var Bars = class {
    /**
     * @param {Three} parent
     * @param {System} system
     */
    constructor(parent, system) {
      this.system = system;
      this.group = new THREE.Group();
      parent.add(this.group);
      const m = system.action.owner.length;
      this.perRow = m <= 24 ? m : Math.ceil(Math.sqrt(4 * m));
      this.rows = Math.ceil(m / this.perRow);
      const bounded = this.boundedNumbers();
      this.width = PITCH * this.perRow + GAUGE * bounded.length;
      this.depth = PITCH * this.rows;
      this.bars = system.action.owner.map((_2, k) => this.addBar(k));
      this.gauges = bounded.map((quantity, k) => this.addGauge(quantity, k));
      this.origin = [0, 0, 0];
      this.scale = 1;
      this.reference = 1;
      this.values = [];
      this.addSlab();
      this.restyle();
    }
    boundedNumbers() {
      return this.system.quantities.filter(
        ({ bound, labels, moving_bounds: moving }) => labels.length === 1 && (typeof bound?.[0] === "number" || moving.bound !== void 0)
      );
    }
    /**
     * Where the k-th bar stands, from the middle of the group.
     * @param {number} k
     */
    spot(k) {
      const row = Math.floor(k / this.perRow);
      return [PITCH * (k % this.perRow + 0.5) - this.width / 2, PITCH * row];
    }
    /** @param {number} k */
    addBar(k) {
      const bar = mesh(8947848);
      const [x, y] = this.spot(k);
      bar.position.set(x, y, 0);
      bar.scale.set(WIDTH2, WIDTH2, 1);
      this.group.add(bar);
      return bar;
    }
    /**
     * @param {Quantity} quantity
     * @param {number} k
     */
    addGauge(quantity, k) {
      const x = PITCH * this.perRow + GAUGE * (k + 0.5) + 0.1 - this.width / 2;
      const place = (object, width, z = 0) => {
        object.position.set(x, 0, z);
        object.scale.set(width, width, 1);
        this.group.add(object);
        return object;
      };
      const bar = place(mesh(8947848), 0.7);
      const frame = place(new THREE.LineSegments(EDGES, new THREE.LineBasicMaterial()), 0.72);
      setHeight(frame, TALL);
      const plate = place(mesh(16777215, 0.55), 1.15, TALL);
      setHeight(plate, 0.03);
      const rim = place(new THREE.LineSegments(EDGES, new THREE.LineBasicMaterial()), 1.15, TALL);
      setHeight(rim, 0.03);
      const limit = quantity.bound?.[0] ?? NaN;
      return { quantity, limit, bar, frame, plate, rim, x, value: NaN, share: NaN };
    }
    addSlab() {
      this.slab = mesh(8947848, 0.5);
      this.slab.scale.set(this.width + 0.3, this.depth + 0.5, 0.03);
      this.slab.position.set(0, (this.depth - PITCH) / 2, -0.032);
      this.group.add(this.slab);
    }
    /**
     * Bars over those of another run are translucent and a little wider, so that no faces coincide.
     * @param {boolean} faint
     */
    fade(faint) {
      this.slab.visible = !faint;
      for (const bar of [...this.bars, ...this.gauges.map((gauge) => gauge.bar)]) {
        const width = (bar.userData.width ??= bar.scale.x) * (faint ? WIDER : 1);
        bar.scale.x = bar.scale.y = width;
        Object.assign(bar.material, {
          transparent: faint,
          opacity: faint ? FAINT : 1,
          depthWrite: !faint
        });
      }
    }
    restyle() {
      this.slab.material.color.set(colour("slab"));
      for (const { frame, plate, rim } of this.gauges) {
        frame.material.color.set(colour("muted"));
        plate.material.color.set(colour("limit"));
        rim.material.color.set(colour("limit"));
      }
    }
    remove() {
      this.group.parent?.remove(this.group);
    }
    /**
     * @param {Instant} instant
     * @param {Store} store
     * @param {Point} origin
     * @param {number} scale
     */
    update(instant, store, [x, y, z], scale) {
      const own = instant.systems[this.system.name];
      const { alike, faint, off: off2 } = this.system.shown;
      this.reference = Math.max(...alike.map((name) => store.greatest(`${name}/action`))) || 1;
      this.fade(faint);
      this.group.visible = !off2;
      this.origin = [x, y, z];
      this.scale = scale;
      this.group.position.set(x, y, z + 0.035);
      this.group.scale.setScalar(scale);
      this.values = own.action || [];
      this.bars.forEach((bar, k) => {
        const agent = this.system.action.owner[k] - 1;
        bar.material.color.setRGB(...ramp(own.share?.[agent] ?? NaN));
        setHeight(bar, this.heightOf(this.values[k]));
      });
      for (const gauge of this.gauges) this.updateGauge(gauge, own);
    }
    /**
     * @param {ReturnType<Bars["addGauge"]>} gauge
     * @param {Record<string, Numbers | undefined>} own arrays of the system
     */
    updateGauge(gauge, own) {
      const { bound } = gauge.quantity.moving_bounds;
      if (bound) gauge.limit = own[`quantity/${bound}`]?.[0] ?? NaN;
      gauge.value = own[`quantity/${gauge.quantity.name}`]?.[0] ?? NaN;
      gauge.share = gauge.value / gauge.limit;
      setHeight(gauge.bar, TALL * (Number.isFinite(gauge.share) ? gauge.share : 0));
      gauge.bar.material.color.setRGB(...ramp(gauge.share));
    }
    /** @param {number} value */
    heightOf(value) {
      return Number.isFinite(value) ? TALL * value / this.reference : 0;
    }
    /**
     * A point of the group, in MuJoCo's coordinates.
     * @returns {Point}
     * @param {number} x
     * @param {number} y
     * @param {number} z
     */
    point(x, y, z) {
      const [ox, oy, oz] = this.origin;
      return [ox + this.scale * x, oy + this.scale * y, oz + 0.035 + this.scale * z];
    }
    /** @param {number} k */
    top(k) {
      const [x, y] = this.spot(k);
      return this.point(x, y, Math.max(0, this.heightOf(this.values[k])));
    }
    /** @param {number} agent */
    topOfAgent(agent) {
      return this.top(this.system.action.owner.indexOf(agent + 1));
    }
    /** @param {number} k */
    foot(k) {
      const [x, y] = this.spot(k);
      return this.point(x, y - WIDTH2 / 2, 0);
    }
    corners() {
      const [w, d] = [this.width / 2 + 0.3, this.depth];
      return [
        [-w, -0.4, -0.35],
        [w, -0.4, -0.35],
        [-w, d, TALL + 0.5],
        [w, d, TALL + 0.5],
        [w, -0.4, TALL + 0.5]
      ].map(([x, y, z]) => this.point(x, y, z));
    }
    /**
     * What the bars are.
     * @returns {Text}
     */
    title() {
      const { name, action } = this.system;
      const [x, y] = this.spot(0);
      const unit = action.unit ? ` / ${action.unit}` : "";
      const point = this.point(x - WIDTH2 / 2, y, TALL);
      return {
        point,
        text: `${name}: ${action.name}${unit}`,
        shift: -34,
        align: "left",
        title: true
      };
    }
    /**
     * Value on top, what it is below, the limit beside its plate.
     * @returns {Text[]}
     */
    gaugeTexts() {
      return this.gauges.flatMap(({ quantity, limit, x, value, share }) => [
        {
          point: this.point(x, 0, Math.max(TALL * (share || 0), TALL) + 0.1),
          text: withUnit(value, quantity.unit),
          bold: true,
          bad: share > 1,
          shift: -14
        },
        {
          point: this.point(x + 0.6, 0, TALL),
          text: `limit ${withUnit(limit, quantity.unit)}`,
          limit: true,
          align: "left"
        },
        { point: this.point(x, -0.45, -0.05), text: quantity.long_name, shift: 12 }
      ]);
    }
  };

  // src/batches.js
  var FEW = 150;
  var HIDDEN = new THREE.Matrix4().makeScale(0, 0, 0);
  var checksum = (geometry) => {
    const values = geometry.attributes.position?.array || [];
    let sum = 0;
    for (let i = 0; i < values.length; i++) sum += values[i] * (i % 7 + 1);
    return `${values.length} ${geometry.index?.count ?? 0} ${sum}`;
  };
  var signature = ({ geometry, material: m }) => {
    const shape = geometry.parameters ? JSON.stringify(geometry.parameters) : checksum(geometry);
    return [
      geometry.type,
      shape,
      m.type,
      m.opacity,
      m.transparent,
      m.side,
      m.wireframe,
      m.shininess
    ].join("|");
  };
  var batchable = (mesh2) => mesh2.isMesh && !mesh2.isInstancedMesh && !Array.isArray(mesh2.material) && !mesh2.material.map && !mesh2.material.vertexColors;
  var coarser = (geometry, count) => {
    const p = geometry.parameters;
    const around = count > 100 ? 10 : 14;
    if (geometry.type === "SphereGeometry") return new THREE.SphereGeometry(p.radius, around, 7);
    if (geometry.type === "CylinderGeometry")
      return new THREE.CylinderGeometry(
        p.radiusTop,
        p.radiusBottom,
        p.height,
        around,
        1,
        p.openEnded
      );
    return geometry;
  };
  var Batches = class {
    /** @param {Three} scene */
    constructor(scene) {
      this.scene = scene;
      this.group = new THREE.Group();
      scene.updateMatrix();
      this.group.matrixAutoUpdate = false;
      this.group.matrix.copy(scene.matrix).invert();
      scene.add(this.group);
      this.all = [];
    }
    clear() {
      for (const { instanced, meshes } of this.all) {
        this.group.remove(instanced);
        instanced.dispose();
        for (const mesh2 of meshes) mesh2.layers.enable(0);
      }
      this.all = [];
    }
    /**
     * Batches the meshes below these objects, if they are many.
     * @param {Three[]} roots
     */
    build(roots) {
      this.clear();
      const groups = /* @__PURE__ */ new Map();
      let count = 0;
      for (const root of roots)
        root?.traverse((mesh2) => {
          if (!batchable(mesh2)) return;
          const key = signature(mesh2);
          if (!groups.has(key)) groups.set(key, []);
          groups.get(key).push(mesh2);
          count++;
        });
      if (count <= FEW) return;
      for (const meshes of groups.values()) if (meshes.length > 4) this.add(meshes);
    }
    /** @param {Three[]} meshes */
    add(meshes) {
      const material = meshes[0].material.clone();
      material.color.setRGB(1, 1, 1);
      const shape = coarser(meshes[0].geometry, meshes.length);
      const instanced = new THREE.InstancedMesh(shape, material, meshes.length);
      instanced.frustumCulled = false;
      this.group.add(instanced);
      for (const mesh2 of meshes) mesh2.layers.disableAll();
      this.all.push({ instanced, meshes });
    }
    update() {
      if (!this.all.length) return;
      this.scene.updateMatrixWorld();
      for (const { instanced, meshes } of this.all) {
        meshes.forEach((mesh2, k) => {
          instanced.setMatrixAt(k, this.visible(mesh2) ? mesh2.matrixWorld : HIDDEN);
          instanced.setColorAt(k, mesh2.material.color);
        });
        instanced.instanceMatrix.needsUpdate = true;
        instanced.instanceColor.needsUpdate = true;
      }
    }
    /** @param {Three} mesh */
    visible(mesh2) {
      for (let at = mesh2; at; at = at.parent) if (!at.visible) return false;
      return true;
    }
  };

  // src/viewer.js
  var OWN = ["Background", "Cameras", "Lights", "Grid", "Axes"];
  var DEGREE = Math.PI / 180;
  var toView = (point) => new THREE.Vector3(point[0], point[2], -point[1]);
  var folder = () => ({
    domElement: document.createElement("div"),
    __folders: {},
    addFolder: folder,
    removeFolder() {
    },
    add: () => ({
      min() {
        return this;
      },
      max() {
        return this;
      },
      step() {
        return this;
      },
      onChange() {
        return this;
      },
      updateDisplay() {
      }
    }),
    remove() {
    }
  });
  var viewerIn = (pane, changed) => {
    const viewer = new Viewer(pane, false);
    const set = viewer.set_object.bind(viewer);
    viewer.set_object = (path, object) => {
      set(path, object);
      changed();
    };
    const resize2 = viewer.set_3d_pane_size.bind(viewer);
    viewer.set_3d_pane_size = () => {
      const { clientWidth: w, clientHeight: h } = pane;
      if (w && h) resize2(w, h);
    };
    viewer.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    viewer.gui.domElement.style.display = "none";
    viewer.scene_tree.folder = folder();
    for (const name of ["Grid", "Axes", "Lights"]) viewer.set_property([name], "visible", false);
    viewer.hide_background();
    light2(viewer.scene);
    return viewer;
  };
  var light2 = (scene) => {
    const sky = new THREE.HemisphereLight(16777215, 8949920, 0.72);
    sky.position.set(0, 0, 1);
    const sun = new THREE.DirectionalLight(16777215, 0.5);
    sun.position.set(-3, -7, 9);
    scene.add(sky, sun, sun.target);
  };
  var nodeAt = (viewer, path) => {
    let node = viewer.scene_tree;
    for (const name of path.split("/").filter(Boolean)) node = node?.children[name];
    return node;
  };
  var drawnIn = (viewer) => Object.entries(viewer.scene_tree.children).filter(([name]) => !OWN.includes(name)).map(([name, node]) => [name, node.object]);
  var empty = (viewer) => {
    for (const [name, object] of drawnIn(viewer)) {
      object.traverse(dispose);
      viewer.delete_path([name]);
    }
  };
  var dispose = ({ geometry, material }) => {
    geometry?.dispose();
    for (const each of [material].flat()) {
      each?.map?.dispose();
      each?.dispose();
    }
  };
  var matrixIn = (viewer, object) => {
    const matrix = new THREE.Matrix4();
    for (let at = object; at && at !== viewer.scene; at = at.parent) {
      at.updateMatrix();
      matrix.premultiply(at.matrix);
    }
    return matrix;
  };

  // src/camera.js
  var Camera = class {
    /**
     * @param {Three} viewer meshcat's
     * @param {HTMLElement} pane
     * @param {Layout} layout
     */
    constructor(viewer, pane, layout) {
      this.viewer = viewer;
      this.pane = pane;
      this.layout = layout;
      this.lens = viewer.camera;
      Object.assign(this.lens, { fov: 38, near: 0.05, far: 4e3 });
      this.controls = viewer.controls;
      Object.assign(this.controls, {
        maxPolarAngle: 89 * DEGREE,
        minDistance: 0.8,
        maxDistance: 1500
      });
      this.controls.addEventListener("change", () => {
        if (!this.rendering) this.rememberZoom();
      });
      this.rendering = false;
      this.follow = { kind: "fleet" };
      this.following = true;
      this.zoom = 1;
      this.placed = false;
      this.followPoint = new THREE.Vector3();
    }
    followed() {
      const { kind, system, agent = 0 } = this.follow;
      if (kind === "agent") {
        const fleet = this.layout.fleets.find((each) => each.name === system);
        if (fleet) return toView(this.layout.agentAt(fleet, agent));
      }
      return this.layout.middle();
    }
    /**
     * Distance from the target at which all points are in view from a direction.
     * @param {Three} direction
     * @param {Three} target
     */
    fitDistance(direction, target) {
      const view = new THREE.Matrix4().lookAt(
        direction,
        new THREE.Vector3(),
        new THREE.Vector3(0, 1, 0)
      );
      const [right, up, back] = [0, 1, 2].map(
        (k) => new THREE.Vector3().setFromMatrixColumn(view, k)
      );
      const tangent = Math.tan(this.lens.fov / 2 * DEGREE);
      const wide = tangent * (this.pane.clientWidth / Math.max(this.pane.clientHeight, 1));
      let distance = 2.5;
      for (const point of this.layout.points()) {
        const p = point.sub(target);
        const nearer = p.dot(back);
        distance = Math.max(
          distance,
          Math.abs(p.dot(right)) / (0.88 * wide) + nearer,
          Math.abs(p.dot(up)) / (0.76 * tangent) + nearer
        );
      }
      return distance;
    }
    /** From the side, and for a long lane nearly along it, so that the near ones stay large. */
    defaultDirection() {
      const { box, bars: bars2, planar } = this.layout;
      const length = box ? box.high[0] - box.low[0] : 0;
      const long = Math.min(Math.max((length - 40) / 60, 0), 1);
      const azimuth = (box ? -84 + 75 * long : -84) * DEGREE;
      const rows = bars2.reduce((sum, each) => sum + each.rows, 0);
      const ofBars = rows > 1 ? 32 : 12;
      const ofFleet = planar ? 36 : 20 - 13 * long;
      const elevation = (box ? ofFleet : ofBars) * DEGREE;
      const flat = Math.cos(elevation);
      return toView([Math.cos(azimuth) * flat, Math.sin(azimuth) * flat, Math.sin(elevation)]);
    }
    fit() {
      if (!this.layout.known) return;
      const target = this.followed();
      const direction = this.defaultDirection();
      const near = this.follow.kind === "agent" ? 6 : this.fitDistance(direction, target);
      this.look(target, direction, near);
      this.zoom = 1;
      this.followPoint = target;
      this.placed = true;
    }
    /**
     * @param {Three} target
     * @param {Three} direction
     * @param {number} distance
     */
    look(target, direction, distance) {
      this.controls.target.copy(target);
      this.lens.position.copy(target).addScaledVector(direction, distance);
      this.lens.lookAt(target);
      this.viewer.set_dirty();
    }
    arm() {
      const arm = this.lens.position.clone().sub(this.controls.target);
      const distance = arm.length();
      return { direction: arm.divideScalar(distance || 1), distance };
    }
    rememberZoom() {
      if (!this.layout.known) return;
      const { direction, distance } = this.arm();
      this.zoom = distance / this.fitDistance(direction, this.controls.target);
    }
    /** Camera and target go with what is followed; for a fleet the distance keeps it in view. */
    move() {
      if (!this.placed) return this.fit();
      if (!this.following) return;
      const point = this.followed();
      const target = this.controls.target.clone().add(point).sub(this.followPoint);
      const { direction, distance } = this.arm();
      const fleet = this.follow.kind === "fleet";
      this.look(
        target,
        direction,
        fleet ? this.zoom * this.fitDistance(direction, target) : distance
      );
      this.followPoint = point;
    }
    /** @param {Follow} follow */
    setFollow(follow) {
      this.following = follow.kind !== "none";
      if (!this.following) return;
      this.follow = follow;
      this.fit();
    }
    /**
     * Turns about the target (degrees) and zooms (factor), for the keyboard.
     * @param {number} turn
     * @param {number} factor
     */
    nudge(turn, factor) {
      const { direction, distance } = this.arm();
      direction.applyAxisAngle(new THREE.Vector3(0, 1, 0), turn * DEGREE);
      this.look(this.controls.target.clone(), direction, distance * factor);
      this.rememberZoom();
    }
    render() {
      this.rendering = true;
      this.viewer.render();
      this.rendering = false;
    }
    /**
     * Where a point is in the pane, in CSS pixels; null behind the camera.
     * @param {ArrayLike<number>} point
     */
    project(point) {
      const p = toView(point).project(this.lens);
      if (p.z > 1 || p.z < -1) return null;
      return {
        x: (p.x + 1) / 2 * this.pane.clientWidth,
        y: (1 - p.y) / 2 * this.pane.clientHeight
      };
    }
  };

  // src/ghosts.js
  var EDGES2 = new THREE.EdgesGeometry(new THREE.BoxGeometry(1, 1, 1).translate(0, 0, 0.5));
  var SECOND = 1;
  var estimatesOf = ({ kept }, holder, estimate, m) => {
    if (!kept) return estimate.subarray(holder * m, (holder + 1) * m);
    const row = new Float64Array(m).fill(NaN);
    kept.by.forEach((agent, e) => {
      if (agent === holder + 1) row[kept.action[e]] = estimate[e];
    });
    return row;
  };
  var DIRECTIONS = { "": 0, x: 0, y: 1, z: 2 };
  var Ghosts = class {
    /** @param {Scene} scene */
    constructor(scene) {
      this.scene = scene;
      this.group = new THREE.Group();
      scene.viewer.scene.add(this.group);
      this.shown = null;
      this.copies = /* @__PURE__ */ new Map();
    }
    /** Makes the copies anew when they are next needed. */
    forget() {
      for (const mesh2 of [...this.group.children]) this.group.remove(mesh2);
      this.copies.clear();
    }
    /** @param {Agent | null} shown */
    show(shown2) {
      this.forget();
      this.shown = shown2;
      if (this.scene.instant) this.apply(this.scene.instant);
      this.scene.dirty();
    }
    /** @param {Instant} instant */
    apply(instant) {
      const { shown: shown2 } = this;
      const system = this.scene.meta?.systems.find((each) => each.name === shown2?.system);
      const { estimate, action } = (system && instant.systems[system.name]) ?? {};
      this.group.visible = Boolean(system && shown2 && estimate && action);
      if (!system || !shown2 || !estimate || !action) return;
      const row = estimatesOf(system, shown2.agent, estimate, action.length);
      if (system.drawn_as === "bars") this.outlines(system, shown2.agent, row);
      else this.shadows(system, shown2.agent, row, action);
    }
    /**
     * @param {System} system
     * @param {number} holder who has the estimates
     * @param {Numbers} row of estimates
     */
    outlines(system, holder, row) {
      const bars2 = this.scene.layout.barsOf(system);
      system.action.owner.forEach((owner, k) => {
        if (owner === holder + 1) return;
        const [outline] = this.copiesOf(k, () => [this.outline()]);
        const [x, y] = bars2.spot(k);
        outline.position.set(...bars2.point(x, y, 0));
        outline.visible = Number.isFinite(row[k]);
        const height = bars2.scale * bars2.heightOf(row[k]);
        outline.scale.set(0.5 * bars2.scale, 0.5 * bars2.scale, height || 1e-4);
      });
    }
    /**
     * What stands for an agent or a bar, made when it is first needed.
     * @param {number} k
     * @param {() => Three[]} make
     */
    copiesOf(k, make) {
      const copies = this.copies.get(k) ?? make();
      this.copies.set(k, copies);
      return copies;
    }
    outline() {
      const material = new THREE.LineBasicMaterial({ color: colour("ghost") });
      const lines = new THREE.LineSegments(EDGES2, material);
      this.group.add(lines);
      return lines;
    }
    /**
     * @param {System} system
     * @param {number} holder
     * @param {Numbers} row
     * @param {Numbers} action
     */
    shadows(system, holder, row, action) {
      for (let agent = 0; agent < system.agents; agent++) {
        if (agent === holder) continue;
        const ahead = this.ahead(system, agent, row, action);
        const sources = this.scene.tinted.get(system.name)?.[agent] ?? [];
        const copies = this.copiesOf(agent, () => sources.map((mesh2) => this.copy(mesh2)));
        copies.forEach((copy3, k) => {
          copy3.matrix.copy(matrixIn(this.scene.viewer, sources[k]));
          ahead.forEach((v, axis) => copy3.matrix.elements[12 + axis] += v);
          copy3.visible = Math.hypot(...ahead) > 0.01;
        });
      }
    }
    /**
     * @param {System} system
     * @param {number} agent
     * @param {Numbers} row
     * @param {Numbers} action
     */
    ahead(system, agent, row, action) {
      const ahead = [0, 0, 0];
      system.action.owner.forEach((owner, k) => {
        const wrong = (row[k] - action[k]) * SECOND;
        if (owner === agent + 1 && Number.isFinite(wrong))
          ahead[DIRECTIONS[system.action.axis[k]] ?? 0] += wrong;
      });
      return ahead;
    }
    /** @param {Three} mesh */
    copy(mesh2) {
      const material = new THREE.MeshPhongMaterial({
        color: colour("ghost"),
        transparent: true,
        opacity: 0.5,
        depthWrite: false
      });
      material.emissive.set(colour("ghost")).multiplyScalar(0.35);
      const copy3 = new THREE.Mesh(mesh2.geometry, material);
      copy3.matrixAutoUpdate = false;
      this.group.add(copy3);
      return copy3;
    }
  };

  // src/ground.js
  var VERTEX = `
  varying vec2 at;
  uniform float size;
  void main() {
    at = position.xy * size;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }`;
  var FRAGMENT = `
  varying vec2 at;
  uniform vec3 colour;
  uniform vec2 middle;
  uniform float minor, major, reach, lane, laneWidth, strength;
  float lines(float spacing) {
    vec2 width = fwidth(at / spacing);
    vec2 away = abs(fract(at / spacing - 0.5) - 0.5) / max(width, 1e-6);
    vec2 drawn = (1.0 - min(away, 1.0)) * clamp(0.5 / width - 0.5, 0.0, 1.0);
    return max(drawn.x, drawn.y);
  }
  void main() {
    float alpha = max(0.35 * lines(minor), 0.8 * lines(major));
    float inside = laneWidth > 0.0 ? 1.0 - step(laneWidth, abs(at.y - lane)) : 0.0;
    alpha = max(alpha, 0.16 * inside);
    float fade = 1.0 - smoothstep(0.25, 1.0, length(at - middle) / reach);
    gl_FragColor = vec4(colour, strength * alpha * fade);
  }`;
  var Ground = class {
    /** @param {Three} scene */
    constructor(scene) {
      const uniform = (value) => ({ value });
      this.uniforms = {
        size: uniform(1),
        colour: uniform(new THREE.Color()),
        middle: uniform(new THREE.Vector2()),
        minor: uniform(1),
        major: uniform(10),
        reach: uniform(30),
        lane: uniform(0),
        laneWidth: uniform(0),
        strength: uniform(0.6)
      };
      const material = new THREE.ShaderMaterial({
        uniforms: this.uniforms,
        vertexShader: VERTEX,
        fragmentShader: FRAGMENT,
        transparent: true,
        depthWrite: false,
        side: THREE.DoubleSide,
        extensions: { derivatives: true }
      });
      this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), material);
      this.mesh.renderOrder = -1;
      this.mesh.frustumCulled = false;
      scene.add(this.mesh);
      this.major = 10;
    }
    /**
     * Follows the point that the camera looks at, in whole squares, so that lines stand still.
     * @param {number[]} target
     * @param {number} distance
     * @param {number} floor
     * @param {number[] | null} lane its least and greatest y
     */
    place(target, distance, floor2, lane) {
      const u = this.uniforms;
      const minor = distance < 45 ? 1 : distance < 200 ? 5 : 25;
      this.major = 10 * minor;
      const { major } = this;
      const snap = (v) => Math.round(v / major) * major;
      const reach = Math.max(8, 4 * distance);
      const origin = [snap(target[0]), snap(target[1])];
      this.mesh.position.set(origin[0], origin[1], floor2 - 0.02);
      this.mesh.scale.setScalar(2 * reach + major);
      u.size.value = 2 * reach + major;
      [u.minor.value, u.major.value, u.reach.value] = [minor, major, reach];
      u.middle.value.set(target[0] - origin[0], target[1] - origin[1]);
      const [low, high] = lane ?? [0, 0];
      u.laneWidth.value = lane === null ? 0 : 0.75 + (high - low) / 2;
      u.lane.value = (low + high) / 2 - origin[1];
    }
  };

  // src/layout.js
  var Layout = class {
    constructor() {
      this.fleets = [];
      this.bars = [];
      this.plans = [];
      this.time = 0;
      this.floor = 0;
      this.known = false;
      this.spill = 0;
      this.spillTime = 0;
      this.box = null;
      this.poses = new Float64Array(0);
    }
    /**
     * Another scene.
     * @param {System[]} fleets
     * @param {Bars[]} bars
     * @param {Plan[]} plans
     */
    begin(fleets, bars2, plans) {
      this.fleets = fleets;
      this.bars = bars2;
      this.plans = plans;
      this.known = false;
      this.spill = 0;
      this.box = null;
    }
    /** @param {Instant} instant */
    update(instant) {
      this.poses = instant.poses ?? new Float64Array(0);
      this.known = true;
      this.time = instant.time;
      this.box = this.boxOf();
      if (this.box) this.noteSpill(this.box, instant.time);
    }
    /**
     * Where an agent of a fleet is.
     * @param {System} system
     * @param {number} agent
     */
    agentAt(system, agent) {
      const p = 8 * system.anchors[agent];
      return this.poses.slice(p, p + 3);
    }
    /**
     * Where links of an agent begin: above a robot, on top of a bar.
     * @param {System} system
     * @param {number} agent
     * @returns {Point}
     */
    headOf(system, agent) {
      if (system.drawn_as === "bars") return this.barsOf(system).topOfAgent(agent);
      const [x, y, z] = this.agentAt(system, agent);
      return [x, y, z + 0.8 * system.height];
    }
    /**
     * The bars of a system that is drawn as such.
     * @param {System} system
     */
    barsOf(system) {
      return (
        /** @type {Bars} */
        this.bars.find((bars2) => bars2.system === system)
      );
    }
    boxOf() {
      const low = [Infinity, Infinity];
      const high = [-Infinity, -Infinity];
      for (const system of this.fleets)
        for (const anchor of system.anchors)
          for (const axis of [0, 1]) {
            const v = this.poses[8 * anchor + axis];
            low[axis] = Math.min(low[axis], v);
            high[axis] = Math.max(high[axis], v);
          }
      return Number.isFinite(low[0]) ? { low, high } : null;
    }
    /**
     * What has swung out is forgotten slowly: the view must not breathe.
     * @param {{low: number[], high: number[]}} box
     * @param {number} time s
     */
    noteSpill({ low, high }, time) {
      if (time > this.spillTime) this.spill *= Math.exp((this.spillTime - time) / 3);
      this.spillTime = time;
      const { poses } = this;
      for (let p = 0; p < poses.length; p += 8)
        for (const axis of [0, 1]) {
          const out = Math.max(poses[p + axis] - high[axis], low[axis] - poses[p + axis]);
          if (poses[p + 7] !== 0 && out > this.spill) this.spill = out;
        }
    }
    /** The least and greatest y of robots in rows, one for each fleet, or null. */
    get lane() {
      if (!this.box) return null;
      for (const system of this.fleets) {
        const across = system.anchors.map((anchor) => this.poses[8 * anchor + 1]);
        if (Math.max(...across) - Math.min(...across) >= 0.3) return null;
      }
      return [this.box.low[1], this.box.high[1]];
    }
    get planar() {
      return this.lane === null ? 1 : 0;
    }
    /** The points that should be in view, as three.js sees them. */
    points() {
      const points2 = [];
      for (const system of this.fleets)
        for (let agent = 0; agent < system.agents; agent++) {
          const [x, y, z] = this.agentAt(system, agent);
          points2.push([x - 0.5, y, this.floor], [x + 0.5, y, z + system.height + 0.25]);
        }
      if (this.box) {
        const { low, high } = this.box;
        for (const x of [low[0] - this.spill, high[0] + this.spill])
          for (const y of [low[1] - this.spill * this.planar, high[1] + this.spill * this.planar])
            points2.push([x, y, this.floor]);
      }
      for (const plan of this.plans) points2.push(...plan.corners(this.time, this.floor));
      for (const bars2 of this.bars) points2.push(...bars2.corners());
      return points2.length ? points2.map(toView) : [new THREE.Vector3()];
    }
    /** The middle of the agents, without what swings about them, as three.js sees it. */
    middle() {
      const box = new THREE.Box3();
      for (const system of this.fleets)
        for (let agent = 0; agent < system.agents; agent++) {
          const [x, y, z] = this.agentAt(system, agent);
          box.expandByPoint(toView([x, y, this.floor]));
          box.expandByPoint(toView([x, y, z + system.height]));
        }
      for (const bars2 of this.bars)
        for (const corner of bars2.corners()) box.expandByPoint(toView(corner));
      return box.isEmpty() ? new THREE.Vector3() : box.getCenter(new THREE.Vector3());
    }
  };

  // src/plan.js
  var STRIP = new THREE.PlaneGeometry(1, 1);
  var AROUND2 = 48;
  var MARK = new THREE.RingGeometry(0.06, 0.1, AROUND2);
  var WIDTH3 = 0.05;
  var LEAD = 0.02;
  var RIM = 0.025;
  var STEP2 = 4e-3;
  var used = (value, high, low) => {
    const middle = typeof high === "number" && typeof low === "number" ? (high + low) / 2 : 0;
    const up = typeof high === "number" ? (value - middle) / (high - middle) : -Infinity;
    const down = typeof low === "number" ? (value - middle) / (low - middle) : -Infinity;
    return Math.max(up, down);
  };
  var Plan = class {
    /**
     * @param {Three} parent
     * @param {System} system
     * @param {Meta} plan
     */
    constructor(parent, system, plan) {
      this.system = system;
      this.plan = plan;
      this.group = new THREE.Group();
      parent.add(this.group);
      this.region = plan.region.length ? this.addRegion() : null;
      this.distances = system.quantities.flatMap((quantity) => this.addDistances(quantity));
      this.discs = plan.radius.map((radius) => radius === null ? null : this.addDisc(radius));
      this.leads = plan.radius.map(() => this.add(STRIP, 0.6));
      this.marks = plan.radius.map(() => this.add(MARK));
      this.restyle();
    }
    /**
     * @param {Three} geometry
     * @param {number} opacity
     */
    add(geometry, opacity = 1) {
      const material = new THREE.MeshBasicMaterial({
        transparent: true,
        opacity,
        depthWrite: false,
        side: THREE.DoubleSide
      });
      const mesh2 = new THREE.Mesh(geometry, material);
      this.group.add(mesh2);
      return mesh2;
    }
    addRegion() {
      const corners = this.plan.region.map(([x, y]) => new THREE.Vector2(x, y));
      const fill = this.add(new THREE.ShapeGeometry(new THREE.Shape(corners)), 0.1);
      const edge = new THREE.LineLoop(
        new THREE.BufferGeometry().setFromPoints(corners.map(({ x, y }) => new THREE.Vector3(x, y))),
        new THREE.LineBasicMaterial()
      );
      this.group.add(edge);
      return { fill, edge };
    }
    /**
     * A strip for each entry that has a greatest value.
     * @param {Quantity} quantity
     */
    addDistances(quantity) {
      return quantity.between.flatMap(
        (pair, entry) => pair && (typeof quantity.bound?.[entry] === "number" || quantity.moving_bounds.bound) ? [{ quantity, entry, pair, strip: this.add(STRIP, 0.9) }] : []
      );
    }
    /** @param {number} radius */
    addDisc(radius) {
      return this.add(new THREE.RingGeometry(Math.max(radius - RIM, 0), radius, AROUND2), 0.8);
    }
    restyle() {
      this.region?.fill.material.color.set(colour("limit"));
      this.region?.edge.material.color.set(colour("limit"));
      for (const disc of this.discs) disc?.material.color.set(colour("muted"));
      for (const mesh2 of [...this.leads, ...this.marks]) mesh2.material.color.set(colour("accent"));
    }
    remove() {
      this.group.parent?.remove(this.group);
    }
    /**
     * Where what positions are relative to is.
     * @param {number} time s
     */
    origin(time) {
      const { offset } = this.system.shown;
      return this.plan.velocity.map((v, axis) => v * time + offset[axis]);
    }
    /** Corners of the region, if it is of the size of a fleet, for the camera. */
    corners(time, floor2) {
      const [x, y] = this.origin(time);
      return this.plan.region.map(([a, b]) => (
        /** @type {Point} */
        [x + a, y + b, floor2]
      ));
    }
    /**
     * @param {Instant} instant
     * @param {Layout} layout
     */
    update(instant, layout) {
      const own = instant.systems[this.system.name];
      const [x, y] = this.origin(instant.time);
      const level = layout.floor + STEP2;
      this.group.visible = !this.system.shown.faint && !this.system.shown.off;
      if (this.region)
        for (const part of [this.region.fill, this.region.edge]) part.position.set(x, y, level);
      for (const distance of this.distances) this.placeDistance(distance, own, layout);
      for (let agent = 0; agent < this.system.agents; agent++) {
        const [px, py] = layout.agentAt(this.system, agent);
        for (const mesh2 of [this.discs[agent], this.leads[agent], this.marks[agent]])
          if (mesh2) mesh2.visible = isThere(own, agent);
        this.discs[agent]?.position.set(px, py, level + STEP2);
        this.placeOutput(agent, [px, py], own.action, instant.time, level);
      }
    }
    /**
     * @param {Plan["distances"][number]} distance
     * @param {Record<string, Numbers | undefined>} own arrays of the system
     * @param {Layout} layout
     */
    placeDistance({ quantity, entry, pair: [a, b], strip }, own, layout) {
      const value = own[`quantity/${quantity.name}`]?.[entry] ?? NaN;
      strip.visible = isThere(own, a - 1) && isThere(own, b - 1);
      const { bound, lower_bound: lower } = quantity.moving_bounds;
      const high = bound ? own[`quantity/${bound}`]?.[entry] : quantity.bound?.[entry];
      const low = lower ? own[`quantity/${lower}`]?.[entry] : quantity.lower_bound?.[entry];
      const share = used(value, high, low);
      strip.material.color.setRGB(...ramp(share));
      const ends = [a, b].map((agent) => layout.agentAt(this.system, agent - 1));
      this.stretch(strip, ends[0], ends[1], WIDTH3, layout.floor + 2 * STEP2);
    }
    /**
     * The mark at an agent's output, and the line that leads to it.
     * @param {number} agent
     * @param {number[]} from where it is
     * @param {Numbers | undefined} action
     * @param {number} time s
     * @param {number} level m
     */
    placeOutput(agent, from, action, time, level) {
      const { owner } = this.system.action;
      const to = this.origin(time);
      if (to.length < 2 || !action) return;
      const axes = owner.flatMap((each, k) => each === agent + 1 ? [k] : []);
      axes.forEach((k, axis) => to[axis] += action[k]);
      if (axes.length === 1) to[1] = from[1];
      this.marks[agent].position.set(to[0], to[1], level + 3 * STEP2);
      this.stretch(this.leads[agent], from, to, LEAD, level + 2 * STEP2);
    }
    /**
     * @param {Three} strip
     * @param {ArrayLike<number>} from
     * @param {ArrayLike<number>} to
     * @param {number} width
     * @param {number} level
     */
    stretch(strip, from, to, width, level) {
      const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
      strip.position.set((from[0] + to[0]) / 2, (from[1] + to[1]) / 2, level);
      strip.rotation.z = Math.atan2(dy, dx);
      strip.scale.set(Math.max(Math.hypot(dx, dy), 1e-6), width, 1);
    }
  };
  var plansOf = (parent, systems) => systems.flatMap((system) => system.plan ? [new Plan(parent, system, system.plan)] : []);

  // src/scene.js
  var FAINT2 = 0.3;
  var AGAIN2 = 500;
  var Scene = class {
    /** @param {HTMLElement} pane */
    constructor(pane) {
      this.viewer = viewerIn(pane, () => this.stale = true);
      this.layout = new Layout();
      this.camera = new Camera(this.viewer, pane, this.layout);
      this.ground = new Ground(this.viewer.scene);
      this.batches = new Batches(this.viewer.scene);
      this.ghosts = new Ghosts(this);
      this.bars = [];
      this.plans = [];
      this.objects = [];
      this.tinted = /* @__PURE__ */ new Map();
      this.statics = [];
      this.meta = null;
      this.instant = null;
      this.fleets = [];
      this.complete = false;
      this.floorKnown = false;
      this.quality = 1;
      this.stale = true;
      this.nextLook = 0;
      this.restyle();
      new ResizeObserver(() => this.resized()).observe(pane);
    }
    resized() {
      this.viewer.set_3d_pane_size();
      if (this.layout.known && this.meta) this.camera.move();
    }
    restyle() {
      this.ground.uniforms.colour.value.set(colour("grid"));
      this.ground.uniforms.strength.value = theme() === "dark" ? 0.75 : 0.85;
      for (const each of [...this.bars, ...this.plans]) each.restyle();
      this.dimStatics();
      this.ghosts.forget();
      this.dirty();
    }
    dirty() {
      this.viewer.set_dirty();
    }
    /**
     * One of meshcat's commands.
     * @param {Uint8Array} bytes
     */
    command(bytes) {
      this.viewer.handle_command_bytearray(bytes);
      this.stale = true;
    }
    /** Forgets a scene, as another one comes. */
    clear() {
      empty(this.viewer);
      for (const each of [...this.bars, ...this.plans]) each.remove();
      this.ghosts.show(null);
      this.batches.clear();
      this.bars = [];
      this.plans = [];
      this.meta = null;
      this.instant = null;
      this.stale = true;
    }
    /** @param {Meta} meta */
    setMeta(meta) {
      this.meta = meta;
      this.fleets = meta.systems.filter((system) => system.drawn_as === "fleet");
      for (const each of [...this.bars, ...this.plans]) each.remove();
      this.plans = plansOf(this.viewer.scene, this.fleets);
      this.bars = meta.systems.filter((system) => system.drawn_as === "bars").map((system) => new Bars(this.viewer.scene, system));
      this.instant = null;
      this.ghosts.show(null);
      this.layout.begin(this.fleets, this.bars, this.plans);
      this.camera.placed = false;
      this.floorKnown = false;
      this.stale = true;
    }
    /**
     * Finds the objects of the scene, again when some have come or are missing.
     * @param {Meta} meta
     */
    resolve(meta) {
      const now = Date.now();
      if (!this.stale && (this.complete || now < this.nextLook)) return;
      this.objects = meta.items.map((path) => nodeAt(this.viewer, path)?.object);
      this.tinted = new Map(this.fleets.map((system) => [system.name, this.tintedOf(system)]));
      this.statics = this.staticMeshes();
      this.dimStatics();
      this.complete = !this.objects.includes(void 0);
      this.nextLook = now + AGAIN2;
      this.stale = false;
      this.ghosts.forget();
      for (const system of this.fleets) this.fade(system);
      this.batches.build(this.objects);
    }
    /**
     * What never moves of a system goes where it is drawn; what lies over another run is translucent.
     * @param {System} system
     */
    fade({ items: [first, count], root, shown: shown2 }) {
      const still2 = nodeAt(this.viewer, root ?? "")?.children["<object>"]?.object;
      if (still2) {
        [still2.position.x, still2.position.y] = shown2.offset;
        still2.visible = !shown2.faint && !shown2.off;
      }
      for (const object of this.objects.slice(first, first + count))
        object?.traverse(({ material, userData }) => {
          if (!material?.color) return;
          const { opacity, transparent: transparent2, depthWrite } = userData.solid ??= { ...material };
          material.opacity = shown2.faint ? FAINT2 * opacity : opacity;
          material.transparent = shown2.faint || transparent2;
          material.depthWrite = !shown2.faint && depthWrite;
        });
    }
    staticMeshes() {
      const moving = new Set(this.objects);
      const found = [];
      const collect = (object) => {
        if (moving.has(object)) return;
        if (object.isMesh && object.material.color) found.push(object);
        object.children.forEach(collect);
      };
      for (const [, object] of drawnIn(this.viewer)) collect(object);
      return found;
    }
    /** A white floor would outshine a dark page and all that stands on it. */
    dimStatics() {
      const part = theme() === "dark" ? 0.3 : 1;
      for (const { material, userData } of this.statics) {
        userData.colour ??= material.color.clone();
        material.color.copy(userData.colour).multiplyScalar(part);
      }
    }
    /** @param {System} system */
    tintedOf(system) {
      return system.tints.map((paths) => {
        const meshes = [];
        for (const path of paths)
          nodeAt(this.viewer, path)?.object.traverse((object) => {
            if (object.material?.color) meshes.push(object);
          });
        return meshes;
      });
    }
    /**
     * Where an item is, in MuJoCo's coordinates; null if there is none at this path.
     * @param {string} path
     */
    position(path) {
      const node = nodeAt(this.viewer, path);
      return node ? matrixIn(this.viewer, node.object).elements.slice(12, 15) : null;
    }
    // ---- an instant
    /**
     * @param {Instant} instant
     * @param {Store} store
     */
    apply(instant, store) {
      if (!this.meta) return;
      this.resolve(this.meta);
      this.instant = instant;
      this.applyPoses(instant.poses);
      this.applyTints(instant);
      this.findFloor();
      this.layout.update(instant);
      for (const plan of this.plans) plan.update(instant, this.layout);
      this.placeBars(instant, store);
      this.batches.update();
      this.ghosts.apply(instant);
      this.camera.move();
      this.dirty();
    }
    /** @param {Numbers | undefined} poses */
    applyPoses(poses) {
      if (!poses) return;
      for (let k = 0; k < this.objects.length; k++) {
        const object = this.objects[k];
        if (!object) continue;
        const p = 8 * k;
        object.position.set(poses[p], poses[p + 1], poses[p + 2]);
        object.quaternion.set(poses[p + 4], poses[p + 5], poses[p + 6], poses[p + 3]);
        object.visible = poses[p + 7] !== 0;
        object.scale.set(1, 1, poses[p + 7] || 1);
      }
    }
    /** @param {Instant} instant */
    applyTints(instant) {
      for (const [name, agents] of this.tinted) {
        const shares = instant.systems[name].share;
        agents.forEach((meshes, agent) => {
          const [r, g, b] = ramp(shares ? shares[agent] : NaN);
          for (const mesh2 of meshes) mesh2.material.color.setRGB(r, g, b);
        });
      }
    }
    /** Found once: robots of a lane may float around z = 0. */
    findFloor() {
      if (this.floorKnown || !this.complete || this.objects.length === 0) return;
      this.viewer.scene.updateMatrixWorld(true);
      const box = new THREE.Box3();
      for (const system of this.fleets)
        for (const anchor of system.anchors) box.expandByObject(this.objects[anchor]);
      if (Number.isFinite(box.min.y)) this.layout.floor = Math.min(0, box.min.y);
      this.floorKnown = true;
    }
    /**
     * Bars stand behind the fleets.
     * @param {Instant} instant
     * @param {Store} store
     */
    placeBars(instant, store) {
      const { box, floor: floor2 } = this.layout;
      let behind = box ? box.high[1] + 2.4 : 0;
      for (const bars2 of this.bars) {
        const { over } = bars2.system.shown;
        const under = over && this.bars.find(({ system }) => system === over);
        if (under) {
          bars2.update(instant, store, under.origin, under.scale);
          continue;
        }
        const span = box ? box.high[0] - box.low[0] : 0;
        const scale = box ? Math.min(Math.max(0.6 * span / bars2.width, 0.8), 6) : 1;
        const x = box ? (box.low[0] + box.high[0]) / 2 : 0;
        bars2.update(instant, store, [x, behind, floor2], scale);
        behind += scale * (bars2.depth + 1);
      }
    }
    // ---- pictures
    /**
     * Fewer pixels while a slow machine plays (without a graphics card); all of them at rest.
     * @param {number} quality
     */
    setQuality(quality) {
      if (quality === this.quality) return;
      this.quality = quality;
      this.viewer.renderer.setPixelRatio(quality * Math.min(devicePixelRatio, 2));
      this.viewer.set_3d_pane_size();
    }
    render() {
      const { camera, layout } = this;
      const { x, y, z } = camera.controls.target;
      this.ground.place([x, -z, y], camera.arm().distance, layout.floor, layout.lane);
      camera.render();
    }
    /** Gives the graphics context up, of which a browser has some sixteen for all its pages. */
    rest() {
      this.viewer.renderer.forceContextLoss();
    }
    /** Gets it back; three.js then sends everything again. */
    wake() {
      this.viewer.renderer.forceContextRestore();
      this.dirty();
    }
    get needsRender() {
      return this.viewer.needs_render;
    }
  };

  // src/toolbar.js
  var nameOf = (system, agent) => `${system.agent_name} ${agent + 1}`;
  var optionsOf2 = (system) => [...Array(system.agents).keys()].map(
    (agent) => element("option", {
      value: JSON.stringify({ system: system.name, agent }),
      text: nameOf(system, agent)
    })
  );
  var Toolbar = class {
    /**
     * @param {Drawn} scene
     * @param {Overlay} overlay
     */
    constructor(scene, overlay) {
      this.scene = scene;
      this.overlay = overlay;
      this.systems = [];
      byId("ghost-agent").onchange = () => this.setGhosts(true);
      byId("follow").onchange = () => this.setFollow(byId("follow").value);
      byId("ramp").style.background = rampGradient();
    }
    /** @param {Scene} meta */
    setMeta({ systems }) {
      this.systems = systems;
      this.fillFollow();
      this.fillGhosts();
      this.describeLinks();
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
    describeLinks() {
      const linked = this.systems.filter((system) => system.edges.length > 0);
      byId("links").hidden = linked.length === 0;
      const words = new Set(linked.map((system) => system.edges_are));
      const parts = [];
      if (words.has("messages")) parts.push("lines: messages pass");
      if (words.has("measurements")) parts.push("dashed lines: measured directly");
      if (linked.some((system) => system.links.length && system.message_period !== null))
        parts.push("✕ lost");
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
        ...fleets.length > 1 ? fleets.map((fleet) => element("optgroup", { label: fleet.name }, ...optionsOf2(fleet))) : fleets.flatMap(optionsOf2),
        element("option", { value: "none", text: "nothing" })
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
        ...systems.map(
          (system) => element("optgroup", { label: system.name }, ...optionsOf2(system))
        )
      );
      this.setGhosts(false);
    }
    toggleGhosts() {
      this.setGhosts(this.scene.ghosts.shown === null);
    }
    /** @param {boolean} on */
    setGhosts(on2) {
      const { value } = byId("ghost-agent");
      const shown2 = on2 && value ? JSON.parse(value) : null;
      press(byId("ghosts"), shown2 !== null);
      byId("ghost-label").hidden = shown2 === null;
      byId("ghost-note").hidden = shown2 === null;
      if (shown2) byId("ghost-note").textContent = this.ghostNote(shown2);
      this.scene.ghosts.show(shown2);
    }
    /** @param {Agent} agent */
    ghostNote({ system: name, agent }) {
      const system = (
        /** @type {System} */
        this.systems.find((each) => each.name === name)
      );
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
  };

  // src/transport.js
  var SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
  var speedName = (speed) => speed === null ? "max" : `×${speed}`;
  var marksOf = (playback) => {
    const { exits, interventions, meta } = playback;
    const left = Object.entries(exits).map(([name, time]) => ({
      time,
      what: `${name} left the set`,
      bad: true
    }));
    const near = meta.systems.flatMap((system) => {
      const { margin, margin_time: time } = playback.stateOf(system);
      const what = `${system.name}: closest approach, margin ${number(margin)}`;
      return typeof time === "number" ? [{ time, what, near: true }] : [];
    });
    return [...interventions, ...near, ...left];
  };
  var Transport = class {
    speedKey = "";
    // of what the menu of speeds has
    /** @param {Page} page which is driven */
    constructor(page2) {
      this.play = byId("play");
      this.speed = byId("speed");
      this.slider = byId("time-slider");
      this.play.onclick = () => page2.playPause();
      byId("step").onclick = (event) => page2.step(1, event.shiftKey);
      byId("back").onclick = (event) => page2.step(-1, event.shiftKey);
      byId("restart").onclick = () => page2.restart();
      this.speed.onchange = () => page2.setSpeed(this.speed.value === "max" ? null : Number(this.speed.value));
      this.slider.oninput = () => page2.seek(Number(this.slider.value));
      this.lead = (time) => page2.lead(time);
    }
    /**
     * @param {Source} source what is shown
     * @param {{connected: boolean} | null} live the simulation, if there is one
     */
    show(source, live) {
      const { playing, seekable } = source;
      this.play.dataset.playing = String(playing);
      this.play.setAttribute("aria-label", playing ? "pause" : "play");
      this.play.title = playing ? "Pause (space)" : "Play (space)";
      const lost = live !== null && !live.connected;
      for (const button of [this.play, byId("step"), this.speed]) button.disabled = !seekable && lost;
      byId("back").disabled = !seekable;
      byId("step").title = seekable ? "A sample on (→; with shift 1 s)" : "A step on, then pause (→)";
      const restart = byId("restart");
      restart.disabled = lost;
      restart.title = live ? "Restart the simulation (R)" : "To the start (R)";
      restart.setAttribute("aria-label", live ? "restart the simulation" : "to the start");
      this.showSpeeds(source);
      this.showTime(source);
    }
    /** @param {Source} source */
    showSpeeds({ seekable, speed }) {
      const all = seekable ? [...SPEEDS] : [...SPEEDS, null];
      if (!all.includes(speed)) all.unshift(speed);
      const key = JSON.stringify([all, speed]);
      if (key === this.speedKey) return;
      this.speedKey = key;
      this.speed.replaceChildren(
        ...all.map(
          (each) => element("option", {
            value: each ?? "max",
            text: speedName(each),
            selected: each === speed
          })
        )
      );
    }
    /** @param {Source} source */
    showTime({ time, end, seekable }) {
      this.slider.disabled = !seekable;
      byId("time-track").title = seekable ? "" : "Time cannot be turned back while the simulation runs; it can when the run has ended.";
      if (Number(this.slider.max) !== end) this.slider.max = String(end);
      this.slider.value = String(time);
      this.slider.setAttribute("aria-valuetext", `${time.toFixed(2)} seconds of ${end}`);
      this.slider.style.setProperty("--done", `${end ? 100 * time / end : 0}%`);
    }
    /**
     * Marks along the slider, each of which leads there.
     * @param {Mark[]} marks
     * @param {number} end
     */
    mark(marks, end) {
      byId("time-marks").replaceChildren(
        ...marks.map(
          ({ time, what, bad, near }) => element("button", {
            type: "button",
            class: `mark ${bad ? "bad" : near ? "near" : ""}`,
            title: `${time.toFixed(2)} s: ${what}`,
            "aria-label": `${time.toFixed(2)} s: ${what}`,
            onclick: () => this.lead(time),
            style: `left: ${100 * time / (end || 1)}%`
          })
        )
      );
    }
  };

  // src/slider.js
  var PER_SECOND = 12;
  var ECHO = 400;
  var atMost = (perSecond, call) => {
    let waiting = null;
    let latest = NaN;
    return (value) => {
      latest = value;
      waiting ??= setTimeout(() => {
        waiting = null;
        call(latest);
      }, 1e3 / perSecond);
    };
  };
  var Slider = class {
    /**
     * @param {Control} control
     * @param {(value: number) => void} changed
     */
    constructor(control, changed) {
      this.control = control;
      this.changed = atMost(PER_SECOND, changed);
      this.value = control.value;
      this.touched = -Infinity;
      this.typing = false;
      this.range = this.makeRange();
      this.number = this.makeNumber();
      this.root = element(
        "div",
        { class: "control" },
        element("span", { class: "control-label", text: control.label }),
        this.range,
        this.number,
        element("span", { class: "unit", text: control.unit })
      );
      this.show();
    }
    makeRange() {
      const { key, label } = this.control;
      const attributes = { type: "range", min: 0, max: 1, step: 2e-3, title: key };
      const range = element("input", { ...attributes, "aria-label": label });
      range.oninput = () => {
        this.touched = performance.now();
        this.value = Number(this.valueAt(Number(range.value)).toPrecision(3));
        this.show();
        this.changed(this.value);
      };
      return range;
    }
    makeNumber() {
      const { label, min: min2, max: max2 } = this.control;
      const attributes = { type: "number", min: min2, max: max2, step: "any" };
      const number2 = element("input", { ...attributes, "aria-label": `${label}, as a number` });
      number2.oninput = () => this.typing = true;
      number2.onblur = () => {
        this.typing = false;
        this.show();
      };
      number2.onchange = () => {
        this.typing = false;
        const value = Number(number2.value);
        if (number2.value !== "" && Number.isFinite(value)) this.changed(this.value = value);
      };
      return number2;
    }
    get logarithmic() {
      return this.control.scale === "log" && this.control.min > 0;
    }
    /**
     * Where a value is along the slider, from 0 to 1.
     * @param {number} value
     */
    placeOf(value) {
      const { min: min2, max: max2 } = this.control;
      if (this.logarithmic) return Math.log(value / min2) / Math.log(max2 / min2);
      return (value - min2) / (max2 - min2);
    }
    /** @param {number} place */
    valueAt(place) {
      const { min: min2, max: max2 } = this.control;
      return this.logarithmic ? min2 * (max2 / min2) ** place : min2 + (max2 - min2) * place;
    }
    show() {
      const place = this.placeOf(this.value);
      this.range.value = String(place);
      this.range.setAttribute("aria-valuetext", withUnit(this.value, this.control.unit));
      this.range.style.setProperty("--done", `${100 * place}%`);
      if (!this.typing) this.number.value = String(Number(this.value.toPrecision(3)));
    }
    /**
     * The simulation's value, shown when no hand is on the slider.
     * @param {number} value
     */
    follow(value) {
      this.value = value;
      clearTimeout(this.told);
      const wait = this.touched + ECHO - performance.now();
      if (wait > 0) this.told = setTimeout(() => this.follow(value), wait);
      else this.show();
    }
  };

  // src/tuning.js
  var MOST_PUSHED = 8;
  var Tuning = class {
    /** @param {(message: object) => void} send to the simulation */
    constructor(send) {
      this.send = send;
      this.sliders = /* @__PURE__ */ new Map();
    }
    /** @param {Scene} meta */
    build({ systems, controls = [], pushes = [] }) {
      const [panel, body] = [byId("tuning"), byId("tuning-body")];
      this.sliders.clear();
      panel.hidden = controls.length + pushes.length === 0;
      panel.open = innerWidth > 1e3 && innerHeight > 600;
      const rows = systems.map((system) => {
        const own = (each) => each.system === system.name;
        return this.row(system, controls.filter(own), pushes.filter(own));
      });
      body.replaceChildren(...rows.filter((row) => row !== null));
    }
    /**
     * @param {System} system
     * @param {Control[]} controls
     * @param {Push[]} pushes
     */
    row(system, controls, pushes) {
      if (!controls.length && !pushes.length) return null;
      return element(
        "div",
        { class: "tuning-row", role: "group", "aria-label": system.name },
        element("h3", { text: system.name }),
        ...controls.map((control) => this.slider(control)),
        ...pushes.map((push) => this.pushes(push, system))
      );
    }
    /** @param {Control} control */
    slider(control) {
      const { key } = control;
      const slider = new Slider(control, (value) => this.send({ do: "set", key, value }));
      this.sliders.set(key, slider);
      return slider.root;
    }
    /**
     * @param {Push} push
     * @param {System} system
     */
    pushes(push, system) {
      const force = withUnit(push.force, push.unit);
      const title = `Push with ${force} for ${number(push.duration)} s`;
      return element(
        "div",
        { class: "pushes", role: "group", "aria-label": title },
        element("p", { class: "small", text: title }),
        system.agents <= MOST_PUSHED ? this.pushList(push, system) : this.pushChoice(push, system)
      );
    }
    /**
     * Buttons for each agent.
     * @param {Push} push
     * @param {System} system
     */
    pushList(push, { agents, agent_name: noun }) {
      const list = element("div", { class: "push-list" });
      for (let agent = 1; agent <= agents; agent++) {
        const buttons = this.arrows(push, () => agent, `${noun} ${agent}`);
        const name = element("b", { text: agent });
        list.append(element("span", { class: "push-one" }, name, ...buttons));
      }
      return list;
    }
    /**
     * Buttons for the agent that is chosen, when agents are many.
     * @param {Push} push
     * @param {System} system
     */
    pushChoice(push, { agents, agent_name: noun }) {
      const select = element("select", { "aria-label": `${noun} to push` });
      for (let agent = 1; agent <= agents; agent++)
        select.append(element("option", { value: agent, text: `${noun} ${agent}` }));
      const buttons = this.arrows(push, () => Number(select.value), `the chosen ${noun}`);
      return element("span", { class: "push-one" }, select, ...buttons);
    }
    /**
     * @param {Push} push
     * @param {() => number} agentOf from 1
     * @param {string} whom in words
     */
    arrows({ system, axes, force }, agentOf, whom) {
      const arrow = (axis, k, sign2 = 1) => {
        const what = `push ${whom} ${sign2 < 0 ? "against" : "along"} ${axis || "its axis"}`;
        return element("button", {
          type: "button",
          class: "push",
          text: (axis === "y" ? "↓↑" : "←→")[sign2 < 0 ? 0 : 1],
          title: what,
          "aria-label": what,
          onclick: () => this.send({ do: "push", system, agent: agentOf(), axis: k, force: sign2 * force })
        });
      };
      return axes.flatMap((axis, k) => [-1, 1].map((sign2) => arrow(axis, k, sign2)));
    }
    /**
     * The simulation's values.
     * @param {Record<string, number>} values
     */
    follow(values) {
      for (const [key, value] of Object.entries(values)) this.sliders.get(key)?.follow(value);
    }
  };

  // src/webm.js
  var TIME = 1e6;
  var uint = (value, bytes = 8) => {
    const out = new Uint8Array(bytes);
    for (let k = bytes - 1, rest = value; k >= 0; k--, rest = Math.floor(rest / 256)) out[k] = rest % 256;
    return out;
  };
  var float = (value) => {
    const out = new Uint8Array(8);
    new DataView(out.buffer).setFloat64(0, value);
    return out;
  };
  var text = (value) => new TextEncoder().encode(value);
  var joined = (parts) => {
    const out = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of parts) {
      out.set(part, at);
      at += part.length;
    }
    return out;
  };
  var element2 = (id, ...content) => {
    const size = uint(content.reduce((sum, part) => sum + part.length, 0));
    size[0] = 1;
    const width = id > 16777215 ? 4 : id > 65535 ? 3 : id > 255 ? 2 : 1;
    return joined([uint(id, width), size, ...content]);
  };
  var HEAD = element2(
    440786851,
    element2(17030, uint(1, 1)),
    // version
    element2(17143, uint(1, 1)),
    // that readers need
    element2(17138, uint(4, 1)),
    // bytes of the longest number
    element2(17139, uint(8, 1)),
    // of the longest size
    element2(17026, text("webm")),
    element2(17031, uint(4, 1)),
    // version of that
    element2(17029, uint(2, 1))
  );
  var clusterOf = (pictures) => {
    const begin = pictures[0].time;
    const blocks = pictures.map(
      ({ data, time, key }) => element2(163, uint(129, 1), uint(time - begin, 2), uint(key ? 128 : 0, 1), data)
    );
    return element2(524531317, element2(231, uint(begin)), ...blocks);
  };
  var cuesOf = (times, places) => element2(
    475249515,
    ...times.map(
      (time, k) => element2(
        187,
        element2(179, uint(time)),
        element2(183, element2(247, uint(1, 1)), element2(241, uint(places[k])))
      )
    )
  );
  var webmOf = (pictures, { codec, width, height, duration }) => {
    const groups = [];
    for (const picture of pictures)
      if (picture.key) groups.push([picture]);
      else groups[groups.length - 1].push(picture);
    const info = element2(
      357149030,
      element2(2807729, uint(TIME)),
      element2(19840, text("gne_mj")),
      element2(22337, text("gne_mj")),
      element2(17545, float(duration))
    );
    const track = element2(
      374648427,
      element2(
        174,
        element2(215, uint(1, 1)),
        // its number
        element2(29637, uint(1, 1)),
        element2(131, uint(1, 1)),
        // of pictures
        element2(156, uint(0, 1)),
        // a picture a block
        element2(134, text(codec)),
        element2(224, element2(176, uint(width)), element2(186, uint(height)))
      )
    );
    const clusters = groups.map(clusterOf);
    const times = groups.map(([{ time }]) => time);
    const before = info.length + track.length + cuesOf(times, times).length;
    const places = clusters.map(
      (_2, k) => clusters.slice(0, k).reduce((sum, { length }) => sum + length, before)
    );
    return joined([HEAD, element2(408125543, info, track, cuesOf(times, places), ...clusters)]);
  };

  // src/video.js
  var RATE = 30;
  var KEY2 = 2 * RATE;
  var LONGEST = 120;
  var LARGEST = 64e6;
  var WIDEST = 1280;
  var BITS = 0.15;
  var WAITING = 3;
  var ABOUT = "video";
  var pause = () => new Promise((resolve) => setTimeout(resolve, 0));
  var even = (value) => 2 * Math.max(1, Math.round(value / 2));
  var Film = class {
    /** @param {HTMLCanvasElement} canvas */
    constructor(canvas) {
      this.canvas = canvas;
      this.pictures = [];
      this.bytes = 0;
      this.error = null;
      this.encoder = new VideoEncoder({
        output: (chunk) => this.take(chunk),
        error: (error) => this.error = error
      });
      const { width, height } = canvas;
      const bitrate = Math.round(BITS * RATE * width * height);
      this.encoder.configure({ codec: "vp8", width, height, bitrate, framerate: RATE });
    }
    /** @param {EncodedVideoChunk} chunk */
    take(chunk) {
      const data = new Uint8Array(chunk.byteLength);
      chunk.copyTo(data);
      const time = Math.round(chunk.timestamp / 1e3);
      this.pictures.push({ data, time, key: chunk.type === "key" });
      this.bytes += data.length;
    }
    /** @param {number} n number of the picture that the canvas has now */
    async add(n) {
      const frame = new VideoFrame(this.canvas, { timestamp: Math.round(1e6 * n / RATE) });
      this.encoder.encode(frame, { keyFrame: n % KEY2 === 0 });
      frame.close();
      do
        await pause();
      while (this.encoder.encodeQueueSize > WAITING && !this.error);
      if (this.error) throw this.error;
    }
    /** The whole file. */
    async end() {
      await this.encoder.flush();
      this.encoder.close();
      const { width, height } = this.canvas;
      const duration = 1e3 * this.pictures.length / RATE;
      return webmOf(this.pictures, { codec: "V_VP8", width, height, duration });
    }
  };
  var Video = class {
    /** @param {Page} page */
    constructor(page2) {
      this.page = page2;
      this.stopped = false;
      byId("keep-video").onclick = () => this.start();
      byId("recording-stop").onclick = () => this.stopped = true;
    }
    /** Of the stretch of time that plots show, at the speed that is chosen. */
    async start() {
      const { playback, plots } = this.page;
      if (!playback || this.page.recording !== null) return;
      const [from, to] = plots.window;
      const stretch = (
        /** @type {Stretch} */
        [from, Math.min(to, playback.end)]
      );
      const refused = this.refusal(stretch, playback.speed ?? 1);
      if (refused) return notify(refused, "error", ABOUT);
      const before = playback.time;
      this.stopped = playback.playing = false;
      byId("recording").hidden = false;
      try {
        await this.record(playback, stretch);
      } catch (error) {
        notify(`The video could not be made: ${error.message}`, "error", ABOUT);
      } finally {
        byId("recording").hidden = true;
        this.page.recording = null;
        this.page.overlay.links.begin();
        playback.seek(before);
      }
    }
    /**
     * Why there can be no video, in a sentence.
     * @param {Stretch} stretch
     * @param {number} speed
     */
    refusal([from, to], speed) {
      if (!("VideoEncoder" in window))
        return "This browser cannot make videos (it has no VideoEncoder); current Chromium, Edge, Firefox and Safari can.";
      const seconds = (to - from) / speed;
      if (seconds > LONGEST)
        return `A video has at most ${LONGEST} s, and this one would have ${number(seconds)} s: show a shorter stretch in the plots (drag there with shift) or choose a higher speed.`;
      return seconds > 0 ? "" : "The plots show no stretch of this run.";
    }
    /**
     * @param {Playback} playback
     * @param {Stretch} stretch
     */
    async record(playback, [from, to]) {
      const { page: page2 } = this;
      const speed = playback.speed ?? 1;
      const canvas = this.canvas();
      const film = new Film(canvas);
      const count = Math.max(1, Math.round((to - from) / speed * RATE));
      page2.scene.setQuality(1);
      let n = 0;
      for (; n < count && !this.stopped && film.bytes < LARGEST; n++) {
        const time = from + n * speed / RATE;
        this.picture(playback, time, 1e3 * n / RATE);
        this.compose(canvas, time);
        await film.add(n);
        byId("recording-text").textContent = `Video: ${Math.round(100 * n / count)} %`;
      }
      if (this.stopped) return film.encoder.close();
      const bytes = await film.end();
      const end = from + n * speed / RATE;
      const name = `${page2.meta?.title ?? "run"} ${from.toFixed(2)}-${end.toFixed(2)} s`;
      const file = `${name.replace(/[^\w.-]+/g, "_")}.webm`;
      download(file, new Blob([bytes], { type: "video/webm" }));
      const short = n < count ? `, and ends at ${number(end)} s, as it has ${LARGEST / 1e6} MB` : "";
      notify(`The video is saved as ${file}${short}.`, "info", ABOUT);
    }
    /**
     * Draws a moment; messages go on as if the video's time had passed.
     * @param {Playback} playback
     * @param {number} time s
     * @param {number} now ms of the video
     */
    picture(playback, time, now) {
      const { page: page2 } = this;
      const { links } = page2.overlay;
      if (now === 0) links.begin();
      page2.recording = now;
      playback.seek(time, now > 0);
      links.flow(page2.meta?.systems.filter(isSolid) ?? [], now);
      page2.scene.dirty();
      page2.draw(playback, now);
    }
    /** As large as the view, or as videos should be. */
    canvas() {
      const { clientWidth: w, clientHeight: h } = byId("pane");
      const ratio = Math.min(devicePixelRatio, WIDEST / w);
      return Object.assign(document.createElement("canvas"), {
        width: even(ratio * w),
        height: even(ratio * h)
      });
    }
    /**
     * The view as it is seen, with what it is of and the time.
     * @param {HTMLCanvasElement} canvas
     * @param {number} time s
     */
    compose(canvas, time) {
      const context = (
        /** @type {CanvasRenderingContext2D} */
        canvas.getContext("2d")
      );
      const { width, height } = canvas;
      const sky = context.createLinearGradient(0, 0, 0, height);
      sky.addColorStop(0, colour("sky-top"));
      sky.addColorStop(0.5, colour("sky-middle"));
      sky.addColorStop(1, colour("sky-bottom"));
      context.fillStyle = sky;
      context.fillRect(0, 0, width, height);
      context.drawImage(this.page.scene.viewer.renderer.domElement, 0, 0, width, height);
      context.drawImage(byId("overlay"), 0, 0, width, height);
      const size = Math.max(12, Math.round(height / 36));
      Object.assign(context, {
        font: `600 ${size}px system-ui, sans-serif`,
        textBaseline: "top",
        fillStyle: colour("text")
      });
      const text2 = `${time.toFixed(2)} s`;
      context.fillText(this.page.meta?.title ?? "", size, size, width - 8 * size);
      context.fillText(text2, width - size - context.measureText(text2).width, size);
    }
  };

  // src/keys.js
  var onKeys = (actions) => addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (hasMeaning(
      event.key,
      /** @type {HTMLElement} */
      event.target
    )) return;
    if (document.querySelector("dialog[open]")) return;
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action(event);
  });
  var hasMeaning = (key, target) => {
    const type = target instanceof HTMLInputElement ? target.type : target.tagName;
    if (["number", "text", "SELECT", "TEXTAREA"].includes(type)) return true;
    if (key === " ") return ["BUTTON", "SUMMARY", "checkbox"].includes(type);
    if (!key.startsWith("Arrow")) return false;
    const slides = type === "range" && target.id !== "time-slider";
    return slides || target.getAttribute("role") === "separator";
  };

  // src/sight.js
  var inside = window.parent !== window;
  var watchSight = (tell) => {
    if (!inside) return tell(true);
    const watch = new IntersectionObserver((entries) => tell(entries[entries.length - 1].isIntersecting));
    watch.observe(document.documentElement);
  };
  var scrolls = () => inside || byId("main").scrollHeight > byId("main").clientHeight;
  var leaveWheel = () => {
    const pane = byId("pane");
    const has = () => document.hasFocus() && document.activeElement === pane;
    document.body.classList.toggle("inside", inside);
    pane.addEventListener("pointerdown", () => pane.focus({ preventScroll: true }), true);
    pane.addEventListener(
      "wheel",
      (event) => {
        if (scrolls() && !has() && !event.ctrlKey) event.stopPropagation();
      },
      true
    );
    pane.addEventListener("keydown", ({ key }) => {
      if (key === "Escape") pane.blur();
    });
  };

  // src/wiring.js
  var NARROWEST2 = 280;
  var VIEW = 380;
  var wire = (page2) => {
    const { scene, toolbar } = page2;
    const actions = {
      " ": () => page2.playPause(),
      ArrowRight: ({ shiftKey }) => page2.step(1, shiftKey),
      ArrowLeft: ({ shiftKey }) => page2.step(-1, shiftKey),
      r: () => page2.restart(),
      f: () => toolbar.fit(),
      l: () => toolbar.toggleLabels(),
      c: () => toolbar.toggleLinks(),
      g: () => toolbar.toggleGhosts(),
      p: fold,
      b: () => page2.comparison.toggle(),
      d: () => page2.switchTheme(),
      "?": () => byId("help").showModal(),
      "[": () => scene.camera.nudge(-6, 1),
      "]": () => scene.camera.nudge(6, 1),
      "+": () => scene.camera.nudge(0, 0.88),
      "=": () => scene.camera.nudge(0, 0.88),
      "-": () => scene.camera.nudge(0, 1.14)
    };
    onKeys(actions);
    byId("fit").onclick = actions.f;
    byId("labels").onclick = actions.l;
    byId("links").onclick = actions.c;
    byId("ghosts").onclick = actions.g;
    byId("fold").onclick = actions.p;
    byId("theme").onclick = actions.d;
    byId("help-open").onclick = actions["?"];
    byId("banner-close").onclick = () => byId("banner").hidden = true;
    byId("banner-show").onclick = () => page2.seekExit();
    wirePane(page2);
    leaveWheel();
    wireDivider();
    leaveKeys();
  };
  var fold = () => press(byId("fold"), !document.body.classList.toggle("folded"));
  var leaveKeys = () => {
    const pressedBy = ({ target }) => target instanceof Element ? (
      /** @type {HTMLElement | null} */
      target.closest("button, summary, select")
    ) : null;
    const release = (pressed) => {
      if (pressed && !pressed.matches(":focus-visible")) pressed.blur();
    };
    document.addEventListener("change", (event) => release(pressedBy(event)));
    document.addEventListener("click", (event) => {
      const pressed = pressedBy(event);
      if (pressed?.tagName !== "SELECT") release(pressed);
    });
  };
  var wirePane = (page2) => {
    const pane = byId("pane");
    const near = (event) => {
      const box = pane.getBoundingClientRect();
      return page2.overlay.agentNear(event.clientX - box.left, event.clientY - box.top);
    };
    pane.addEventListener("mousemove", (event) => {
      if (event.buttons) return;
      const which = near(event);
      if (JSON.stringify(which) !== JSON.stringify(page2.overlay.highlighted)) page2.highlight(which);
    });
    pane.addEventListener("mouseleave", () => page2.highlight(null));
    pane.addEventListener("dblclick", (event) => page2.toolbar.followAgent(near(event)));
  };
  var wireDivider = () => {
    const divider = byId("divider");
    const set = (width) => {
      const fitting = Math.round(Math.min(Math.max(width, NARROWEST2), innerWidth - VIEW));
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

  // src/page.js
  var SLOW2 = 100;
  var Page = class {
    /** @param {"live" | "served" | "file"} mode where the page and its numbers come from */
    constructor(mode2) {
      this.mode = mode2;
      this.scene = new Scene(byId("pane"));
      this.pace = new Pace(this.scene);
      this.overlay = new Overlay(byId("overlay"), this.scene);
      this.plots = new Plots(byId("plots"), {
        seek: (time) => this.seek(time),
        highlight: (which, plot) => this.highlight(which, plot)
      });
      this.comparison = new Comparison(this);
      this.header = new Header((time) => this.lead(time));
      this.toolbar = new Toolbar(this.scene, this.overlay);
      this.transport = new Transport(this);
      this.keep = new Keep(this);
      new Video(this);
      this.live = null;
      this.playback = null;
      this.meta = null;
      this.instant = null;
      this.drawn = false;
      this.recording = null;
      this.seen = true;
      this.wasMoving = false;
      this.before = NaN;
      this.slowDue = 0;
      wire(this);
      if (mode2 === "live") this.startLive();
      else this.startReplay();
      requestAnimationFrame((now) => this.loop(now));
    }
    /**
     * What is shown.
     * @returns {Source | null}
     */
    get source() {
      return this.playback ?? this.live;
    }
    // ---- where the data come from
    async startReplay() {
      try {
        const pack = this.mode === "file" ? await unpack(fromBase64(byId("replay").textContent)) : await fetchReplay();
        this.showReplay(pack);
      } catch (error) {
        warn(`The replay cannot be read: ${error.message}`);
      }
    }
    /** @param {Pack} pack */
    showReplay(pack) {
      const { command_lengths: lengths = [] } = (
        /** @type {Meta} */
        pack.meta
      );
      const commands = (
        /** @type {Uint8Array} */
        pack.arrays.commands?.data
      );
      let at = 0;
      for (const length of lengths) {
        this.scene.command(commands.slice(at, at + length));
        at += length;
      }
      const playback = new Playback(pack, { messages: this.messages });
      this.playback = playback;
      this.setScene(playback.meta, playback);
      this.transport.mark(marksOf(playback), playback.end);
      playback.restart();
      this.keep.go();
    }
    startLive() {
      const tuning = new Tuning((message) => live.send(message));
      const live = new Live({
        opened: () => this.opened(),
        lost: (why) => this.lost(why),
        command: (bytes) => this.scene.command(bytes),
        scene: (meta) => {
          this.setScene(meta, live);
          tuning.build(meta);
        },
        messages: this.messages,
        controls: (values) => tuning.follow(values),
        ended: (pack) => this.replayRun(pack, live.speed),
        resumed: () => this.leaveReplay(live)
      });
      this.live = live;
      this.tuning = tuning;
    }
    opened() {
      if (this.meta) this.scene.clear();
      this.meta = this.instant = null;
      byId("lost").hidden = true;
    }
    /** @param {string} why */
    lost(why) {
      byId("lost").hidden = false;
      byId("lost-text").textContent = why;
      this.slowDue = 0;
    }
    /**
     * A run has ended: it can be replayed now.
     * @param {Pack} pack
     * @param {number | null} speed
     */
    replayRun(pack, speed) {
      const options = { messages: this.messages, pace: "ended; replay", speed: speed ?? 1 };
      const playback = new Playback(pack, options);
      this.playback = playback;
      this.plots.setSource(playback);
      this.transport.mark(marksOf(playback), playback.end);
      playback.seek(momentAsked() ?? playback.end);
    }
    /** @param {Live} live */
    leaveReplay(live) {
      this.playback = null;
      this.plots.setSource(live);
      this.transport.mark([], 1);
    }
    /**
     * Messages pass along a system's links now.
     * @param {System} system
     * @param {Numbers | undefined} counts
     */
    messages = (system, counts) => {
      const drawn = this.meta?.systems.find(({ name }) => name === system.name);
      const now = this.recording ?? performance.now();
      if (drawn && isSolid(drawn)) this.overlay.links.messages(system, counts, now);
    };
    /**
     * @param {Meta} meta
     * @param {Source} source
     */
    setScene(meta, source) {
      this.meta = meta;
      this.instant = null;
      document.title = `${meta.title} · gne_mj`;
      byId("title").textContent = meta.title;
      byId("waiting").hidden = true;
      this.comparison.setMeta(meta);
      this.scene.setMeta(meta);
      this.overlay.setMeta(meta);
      this.plots.setScene(meta, source);
      this.toolbar.setMeta(meta);
    }
    // ---- what users ask for
    playPause() {
      this.source?.playPause();
      this.slowDue = 0;
    }
    /**
     * @param {number} direction
     * @param {boolean} second
     */
    step(direction, second) {
      this.source?.step(direction, second);
    }
    /** Of the simulation, also where the replay of a run that has ended is shown. */
    restart() {
      (this.live ?? this.playback)?.restart();
    }
    /** @param {number | null} speed */
    setSpeed(speed) {
      this.source?.setSpeed(speed);
      this.slowDue = 0;
    }
    /** @param {number} time */
    seek(time) {
      this.source?.seek(time);
    }
    /**
     * To a moment, with plots around it.
     * @param {number} time
     */
    lead(time) {
      this.seek(time);
      this.plots.showAround(time);
    }
    /** To where the first system left the set. */
    seekExit() {
      if (this.source) this.seek(Math.min(...Object.values(this.source.exits)));
    }
    /**
     * @param {Agent | null} which
     * @param {Plot} [plot] that was pointed at
     */
    highlight(which, plot) {
      this.overlay.highlighted = which;
      this.plots.highlight(which, plot);
      this.scene.dirty();
    }
    switchTheme() {
      setTheme(theme() === "dark" ? "light" : "dark");
      this.scene.restyle();
      this.plots.restyle();
      this.comparison.restyle();
    }
    // ---- pictures
    /**
     * Out of sight nothing is drawn, and time stands still.
     * @param {boolean} seen
     */
    setSeen(seen) {
      if (seen === this.seen) return;
      this.seen = seen;
      this.before = NaN;
      if (seen) this.scene.wake();
      else this.scene.rest();
    }
    /** @param {number} now ms */
    loop(now) {
      requestAnimationFrame((next) => this.loop(next));
      if (!this.seen || this.recording !== null) return;
      const passed = Number.isNaN(this.before) ? 0 : Math.min(now - this.before, 250) / 1e3;
      this.before = now;
      const { source } = this;
      this.pace.watch(passed, source?.playing ?? false);
      source?.advance(passed);
      if (!this.meta || !source) return;
      if (source.playing) this.overlay.links.flow(this.meta.systems.filter(isSolid), now);
      this.draw(source, now);
      if (now >= this.slowDue) this.slow(this.meta, source, now);
    }
    /**
     * @param {Source} source
     * @param {number} now ms
     */
    draw(source, now) {
      const instant = source.take();
      if (instant) {
        this.comparison.place(instant);
        this.instant = instant;
        this.scene.apply(instant, source.store);
        this.plots.setTime(instant.time);
      } else if (this.instant && this.scene.stale) this.scene.apply(this.instant, source.store);
      if (!this.instant) return;
      const render = this.scene.needsRender;
      if (render) this.scene.render();
      if (render || this.overlay.moving || this.wasMoving) this.overlay.draw(this.instant, now);
      this.wasMoving = this.overlay.moving;
      this.drawn = true;
      this.live?.saw(this.scene.complete);
    }
    /**
     * What need not be fresh at every picture.
     * @param {Meta} meta
     * @param {Source} source
     * @param {number} now ms
     */
    slow(meta, source, now) {
      const began = performance.now();
      if (source.grown) {
        source.grown = false;
        this.plots.refresh();
      } else this.plots.writeValues();
      this.header.show(meta, source);
      this.toolbar.showLegend(this.instant);
      this.transport.show(source, this.live);
      this.keep.show();
      this.slowDue = now + Math.max(SLOW2, 6 * (performance.now() - began));
    }
  };

  // src/main.js
  var { mode = "served" } = JSON.parse(byId("settings").textContent || "{}");
  var page = null;
  watchSight((seen) => {
    if (page) return page.setSeen(seen);
    if (!seen) return;
    page = new Page(mode);
    window.gne = handleOf(page);
  });
})();
