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
    const [[from, a], [to2, b]] = [RAMP[above - 1], RAMP[above]];
    return a.map((v, k) => v + (b[k] - v) * (share - from) / (to2 - from));
  };
  var css = (rgb) => `rgb(${rgb.map((v) => Math.round(255 * v)).join(", ")})`;
  var rampGradient = () => `linear-gradient(to right, ${RAMP.map(([s, c]) => `${css(c)} ${100 * s}%`).join(", ")})`;
  var palette = { dark: [], light: [] };
  var HUES = 8;
  var DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3], [12, 5]];
  var setPalette = (given) => palette = given;
  var dashOf = (run) => DASHES[run];
  var line = (k) => {
    const colours2 = palette[theme()];
    return {
      colour: colours2[k % colours2.length],
      dash: DASHES[Math.floor(k / HUES) % DASHES.length]
    };
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
    "joints",
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
      this.isLost = () => false;
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
     * Whether both agents, from 1, are there, and hear each other if they ever do.
     * @param {System} system
     * @param {[number, number]} pair
     */
    among(system, [a, b]) {
      const own = this.arrays.get(system.name);
      return isThere(own, a - 1) && isThere(own, b - 1) && !this.isLost(system, [a, b]);
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
      const [from, to2] = [this.headAt(system, a), this.headAt(system, b)];
      return from && to2 && [from, { x: (from.x + to2.x) / 2, y: (from.y + to2.y) / 2 }, to2];
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
        const [from, bend, to2] = curve;
        context.moveTo(from.x, from.y);
        context.quadraticCurveTo(bend.x, bend.y, to2.x, to2.y);
      }
      context.stroke();
      context.setLineDash([]);
      context.globalAlpha = 1;
      for (const pair of system.edges) if (this.isLost(system, pair)) this.lostEdge(system, pair);
    }
    /**
     * A link that was taken away: a broken line and a cross.
     * @param {System} system
     * @param {[number, number]} pair
     */
    lostEdge(system, [a, b]) {
      const { context } = this;
      const curve = this.curve(system, a - 1, b - 1);
      if (!curve) return;
      const [from, bend, to2] = curve;
      context.strokeStyle = colour("bad");
      context.lineWidth = 1.2;
      context.setLineDash([3, 6]);
      context.beginPath();
      context.moveTo(from.x, from.y);
      context.quadraticCurveTo(bend.x, bend.y, to2.x, to2.y);
      context.stroke();
      context.setLineDash([]);
      const { x, y } = along(curve, 0.5);
      this.cross(x, y, 1);
    }
    /**
     * The edge that is nearest to a point of the pane, if one is near.
     * @param {System[]} systems
     * @param {number} x
     * @param {number} y
     * @param {number} near px
     */
    nearest(systems, x, y, near) {
      let best = null;
      let least = near;
      for (const system of systems)
        for (const edge of system.edges) {
          const curve = this.curve(system, edge[0] - 1, edge[1] - 1);
          if (!curve) continue;
          for (let k = 3; k <= 29; k++) {
            const at = along(curve, k / 32);
            const away = Math.hypot(at.x - x, at.y - y);
            if (away < least) [best, least] = [{ system, edge }, away];
          }
        }
      return best;
    }
    /**
     * @param {Pulse} pulse
     * @param {number} age in times that a message is seen
     */
    drawPulse({ system, from, to: to2, lost }, age) {
      const { context } = this;
      const curve = this.curve(system, from, to2);
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
    show: (from, to2) => page2.plots.show([from, to2]),
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
    /** Where an agent's head, or the middle of the link between two agents, from 0, is in the pane, px. */
    head: (system, a, b = a) => headOf(page2, system, a, b),
    /** Colours of the sky as they are drawn, from its zenith down, and of the lights that shine. */
    around: () => aroundOf(page2),
    /** What robots cover of the pane, px. */
    bodies: () => page2.overlay.bodies,
    /** The labels of robots, px. */
    labels: () => page2.overlay.labels.drawn,
    /** Where the text of a force is while a robot is dragged, px. */
    told: () => page2.hands.pushing.shown?.box ?? null,
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
    const bars = scene.bars.find(({ system }) => system.name === name);
    const drawn = bars ? bars.bars[bars.system.action.owner.indexOf(agent + 1)] : scene.tinted.get(name)?.[agent]?.[0];
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
  var headOf = ({ meta, overlay, scene }, name, a, b) => {
    const system = meta?.systems.find((each) => each.name === name);
    if (!system) return null;
    if (a === b) return scene.camera.project(scene.layout.headOf(system, a));
    const curve = overlay.links.curve(system, a, b);
    return curve && along(curve, 0.5);
  };
  var aroundOf = ({ scene: { surroundings: { lights, sky } } }) => ({
    sky: sky.mesh.visible ? Object.values(sky.uniforms).map(({ value }) => css(value.toArray())) : null,
    lights: [lights.above, lights.head, ...lights.suns].map(({ color, intensity, position }) => ({
      colour: css(color.toArray()),
      intensity,
      from: position.toArray()
    }))
  });
  var isAlive = ({ scene }) => {
    const gl = scene.viewer.renderer.getContext();
    if (gl.isContextLost()) return false;
    scene.camera.render();
    const { drawingBufferWidth: w, drawingBufferHeight: h } = gl;
    const pixels = new Uint8Array(4 * w * h);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return new Set(new Uint32Array(pixels.buffer)).size > 16;
  };
  var comparedOf = ({ meta, scene }) => (meta?.systems ?? []).map(({ name, items: [first], drawn_as: as2, shown: shown2 }) => {
    const object = as2 === "fleet" ? scene.objects[first] : scene.bars.find(({ system }) => system.name === name)?.group;
    let opacity = 1;
    object?.traverse(({ material }) => {
      if (material?.color) opacity = Math.min(opacity, material.opacity);
    });
    return { name, opacity, visible: object?.visible ?? false, offset: shown2.offset };
  });
  var stateOf = ({ hands, meta, mode: mode2, live, overlay, playback, scene, source, tuning }) => ({
    mode: mode2,
    replaying: playback !== null,
    connected: live?.connected ?? false,
    theme: theme(),
    controls: [...tuning?.sliders.keys() ?? []],
    pulses: overlay.links.pulses.length,
    chosen: hands.chosen.which,
    lost: [...hands.switching.lost],
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
    const [from, to2] = plots.window;
    const { time } = plots.source.store;
    const columns = plot.columns();
    const { on: on2 } = plot.lines;
    const unit = spec.unit ? ` (${spec.unit})` : "";
    const names = on2.map((k) => quoted(plot.lines.nameOf(k) + unit));
    const rows = [["time (s)", ...names].join(",")];
    time.forEach((t, i) => {
      if (t < from || t > to2) return;
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
      spec.whose ? element("span", { class: "plot-system", text: spec.whose }) : null,
      element("span", { class: "plot-title" }, `${spec.title} `, symbolOf(spec.symbol)),
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
  var SYMBOLS = { ok: "✓", going: "▸", still: "‖", bad: "⚠", unknown: "?" };
  var status = (word) => {
    let kind = "unknown";
    if (/^(converged|completed)$/.test(word)) kind = "ok";
    else if (/left|outside|diverged|too_small/.test(word)) kind = "bad";
    else if (word === "running") kind = "going";
    else if (/^(paused|not_begun|not_connected)$/.test(word)) kind = "still";
    return { kind, symbol: SYMBOLS[kind], words: String(word || "unknown").replaceAll("_", " ") };
  };
  var percent = (share) => {
    if (!(share > 1)) return Number.isFinite(share) ? `${(100 * share).toFixed(0)} %` : "";
    const text2 = (100 * share).toFixed(share < 1.1 ? 1 : 0);
    return Number.isFinite(share) && Number(text2) > 100 ? `${text2} %` : "outside";
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
        const off = this.hidden.has(system.run);
        const under = alike.find(({ run }) => run === first) ?? null;
        const ghost = system.drawn_as === "fleet" || under !== null;
        const faint = this.ghosts && !off && system.run !== first && ghost;
        system.shown = {
          offset: offsetOf(system, this.ghosts),
          faint,
          off,
          over: faint ? under : null,
          alike: alike.map(({ name }) => name)
        };
      }
    }
    /**
     * What systems of several runs have in common.
     * @param {System} system
     */
    comparedBy({ name, run, action }) {
      return [this.runs[run]?.systems[name] ?? name, action.name, action.unit].join("\n");
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
      const seen = this.runs.filter((_, k) => !this.hidden.has(k)).map(({ heading }) => heading);
      const others = seen.length > 1 ? `; translucent, in rings: ${seen.slice(1).join("; ")}` : "";
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

  // src/arrows.js
  var SIGNS = { y: "↓↑", z: "⇓⇑" };
  var arrows = (pushing, system, agentOf, whom) => {
    const push = (
      /** @type {Push} */
      pushing.pushes.get(system.name)
    );
    const arrow2 = (axis, k, sign = 1) => {
      const what = `push ${whom} ${sign < 0 ? "against" : "along"} ${axis || "its axis"}`;
      const forces = () => push.axes.map((_, each) => each === k ? sign * push.force : 0);
      return element("button", {
        type: "button",
        class: "push",
        text: (SIGNS[axis] ?? "←→")[sign < 0 ? 0 : 1],
        title: what,
        "aria-label": what,
        onclick: () => pushing.send({ system: system.name, agent: agentOf() }, forces().slice(0, k + 1))
      });
    };
    return push.axes.flatMap((axis, k) => [-1, 1].map((sign) => arrow2(axis, k, sign)));
  };

  // src/chosen.js
  var COLUMNS = (
    /** @type {const} */
    ["position", "velocity", "control"]
  );
  var DIGITS2 = 3;
  var Chosen = class {
    /** @param {Page} page */
    constructor(page2) {
      this.page = page2;
      this.panel = byId("chosen");
      this.which = null;
      this.table = element("div");
      this.known = "";
      this.values = [];
      this.links = [];
      this.asked = "";
      byId("follow").addEventListener("change", () => this.chooseFollowed());
    }
    /** @param {Scene} meta */
    setMeta({ systems }) {
      this.asked = "";
      const still2 = systems.some(
        ({ name, agents }) => name === this.which?.system && agents > this.which.agent
      );
      this.choose(still2 ? this.which : null);
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
        ...this.linkButtons(system, which)
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
        onclick: () => this.choose(null)
      });
      const follow = element("button", {
        type: "button",
        text: "Follow",
        onclick: () => this.page.toolbar.followAgent(which)
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
      const has = (row, column) => row[column] !== void 0 && isKnown(row[column][0]);
      const columns = COLUMNS.filter((column) => rows.some((row) => has(row, column)));
      const cell = (row, column) => {
        const there = row[column];
        if (!there) return element("td");
        if (!isKnown(there[0])) return element("td", { class: "muted", text: "–" });
        const place = element("span");
        this.values.push({ at: there[0], place });
        return element("td", {}, place, element("small", { text: ` ${there[1]}` }));
      };
      const body = rows.filter((row) => columns.some((column) => has(row, column))).map(
        (row) => element(
          "tr",
          {},
          element("th", { scope: "row", text: row.name.replaceAll("_", " ") }),
          ...columns.map((column) => cell(row, column))
        )
      );
      const heads = columns.map((text2) => element("th", { scope: "col", text: text2 }));
      const head = element("tr", {}, element("th", { scope: "col", text: "joint, actuator" }), ...heads);
      const less = this.values.length < all.length;
      this.table.replaceChildren(
        ...body.length ? [element("table", {}, element("thead", {}, head), element("tbody", {}, ...body))] : [],
        ...less ? [element("p", { class: "muted", text: "Its other numbers were not recorded." })] : []
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
          onclick: () => switching.toggle(system, pair)
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
      const rows = joints ? system.joints[which.agent] ?? [] : [];
      this.tabulate(rows, (at) => Number.isFinite(joints?.[at]));
      for (const { at, place } of this.values) {
        const text2 = fixed(joints?.[at] ?? NaN, DIGITS2);
        if (place.textContent !== text2) place.textContent = text2;
      }
      for (const { pair, button } of this.links)
        press(button, !this.page.hands.switching.isLost(system, pair));
    }
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
    place.prepend(notice);
    while (place.children.length > MOST) place.lastChild?.remove();
  };
  var dismiss = (about) => shown.get(about)?.();
  var placeNotes = () => {
    const legend = byId("legend");
    const place = () => {
      const below = innerHeight - legend.getBoundingClientRect().top;
      byId("notes").style.setProperty("--below", `${below}px`);
    };
    new ResizeObserver(place).observe(legend);
  };

  // src/push.js
  var STILL = 6;
  var FULL = 50;
  var TIP = 12;
  var HIGH = 18;
  var ROWS = [0, -1, 1, -2, 2, -3, 3, -4, 4, -5, 5, -6, 6];
  var sizeOf = ({ x, y }) => Math.hypot(x, y);
  var between = (from, to2) => ({ x: to2.x - from.x, y: to2.y - from.y });
  var Pushing = class {
    /** @param {Page} page */
    constructor(page2) {
      this.page = page2;
      this.pushes = /* @__PURE__ */ new Map();
      this.drag = null;
      this.pressed = null;
      this.shown = null;
      const pane = byId("pane");
      pane.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
      pane.addEventListener("pointermove", (event) => this.move(event), { capture: true });
      pane.addEventListener("pointerup", (event) => this.release(event), { capture: true });
      pane.addEventListener("pointercancel", () => this.abandon(), { capture: true });
      addEventListener("keydown", ({ key }) => key === "Escape" && this.abandon());
    }
    /** @param {Scene} meta */
    setMeta({ pushes = [] }) {
      this.pushes = new Map(pushes.map((push) => [push.system, { ...push }]));
      this.drag = null;
    }
    // ---- hands
    /**
     * @param {PointerEvent} event
     * @returns {Place}
     */
    place({ clientX, clientY }) {
      const box = byId("pane").getBoundingClientRect();
      return { x: clientX - box.left, y: clientY - box.top };
    }
    /** @param {PointerEvent} event */
    press(event) {
      this.pressed = null;
      if (!event.isPrimary || event.button !== 0) return this.abandon();
      const from = this.place(event);
      const which = this.page.overlay.agentAt(from.x, from.y);
      const system = this.page.meta?.systems.find(({ name }) => name === which?.system);
      if (!which || !system) return void (this.pressed = from);
      this.drag = { which, system, from, to: from, up: false };
      if (!this.page.hands.running) return;
      event.stopImmediatePropagation();
      byId("pane").setPointerCapture(event.pointerId);
      byId("pane").focus({ preventScroll: true });
    }
    /** @param {PointerEvent} event */
    move(event) {
      const { drag, pushing } = this;
      if (!drag) return;
      drag.to = this.place(event);
      drag.up = event.shiftKey;
      if (!pushing) return;
      event.stopImmediatePropagation();
      this.page.scene.dirty();
    }
    /** @param {PointerEvent} event */
    release(event) {
      const { drag, pressed } = this;
      const at = this.place(event);
      const from = drag?.from ?? pressed;
      const still2 = from !== null && sizeOf(between(from, at)) <= STILL;
      this.abandon();
      if (still2 && drag) return this.page.hands.chosen.choose(drag.which);
      if (still2 && from) return this.page.hands.switching.click(from.x, from.y, event.pointerType);
      if (!drag || !this.page.hands.running) return;
      event.stopImmediatePropagation();
      drag.to = at;
      const forces = this.forces(drag);
      if (forces) this.send(drag.which, forces);
      else notify(this.refusal(drag.system), "info", `push ${drag.system.name}`);
    }
    abandon() {
      if (this.drag) this.page.scene.dirty();
      this.drag = null;
      this.pressed = null;
    }
    /** Whether a robot is dragged that can be pushed. */
    get pushing() {
      return this.drag !== null && this.page.hands.running !== null;
    }
    // ---- forces
    /**
     * @param {System} system
     * @param {number} agent
     * @returns {(Way | null)[]}
     */
    waysOf({ name }, agent) {
      return this.pushes.get(name)?.ways[agent] ?? [];
    }
    /** @param {System} system */
    refusal({ name, agent_name: noun }) {
      return this.pushes.has(name) ? `${name}: this ${noun} cannot be pushed, since a sensor alone tells its output.` : `${name}: only robots that MuJoCo moves can be pushed.`;
    }
    /**
     * The unit that an agent is pushed in.
     * @param {System} system
     * @param {number} agent
     */
    unitOf(system, agent) {
      return this.waysOf(system, agent).find((way) => way)?.unit ?? "N";
    }
    /**
     * Along which way on the screen an axis goes now, px a m; to the right where it turns.
     * @param {System} system
     * @param {number} agent
     * @param {Way} way
     * @returns {Place}
     */
    onScreen(system, agent, { along: along2, item }) {
      const { camera, layout } = this.page.scene;
      const here = (
        /** @type {Point} */
        Array.from(layout.agentAt(system, agent))
      );
      const way = along2 && item !== null ? layout.turned(item, along2) : along2;
      const a = camera.project(here);
      const b = way && camera.project(here.map((v, k) => v + 0.1 * way[k]));
      if (!a || !b) return { x: 1, y: 0 };
      return { x: (b.x - a.x) / 0.1, y: (b.y - a.y) / 0.1 };
    }
    /**
     * The force along each axis that a drag asks for, or null where none can act: along the only
     * axis; in the plane of the first two; with shift along the third.
     * @param {NonNullable<Pushing["drag"]>} drag
     */
    forces({ which, system, from, to: to2, up }) {
      const push = this.pushes.get(system.name);
      const ways = this.waysOf(system, which.agent);
      const there = [...ways.keys()].filter((k2) => ways[k2]);
      if (!push || !there.length) return null;
      const by = between(from, to2);
      const force = push.force / FULL;
      const forces = ways.map(() => 0);
      const screen = (k2) => this.onScreen(
        system,
        which.agent,
        /** @type {Way} */
        ways[k2]
      );
      const [k, l] = up && there.length > 2 ? [there[2]] : there;
      const p = screen(k);
      const q = l === void 0 ? null : screen(l);
      const area = q ? p.x * q.y - p.y * q.x : 0;
      if (!q || Math.abs(area) < 1e-3 * sizeOf(p) * sizeOf(q)) {
        const part = (by.x * p.x + by.y * p.y) / (sizeOf(p) || 1);
        forces[k] = Number((force * part).toPrecision(3));
        return forces;
      }
      const a = (by.x * q.y - by.y * q.x) / area;
      const b = (p.x * by.y - p.y * by.x) / area;
      const scale = force * sizeOf(by) / (Math.hypot(a, b) || 1);
      forces[k] = Number((scale * a).toPrecision(3));
      forces[l] = Number((scale * b).toPrecision(3));
      return forces;
    }
    /**
     * @param {Agent} which
     * @param {number[]} forces along its axes
     */
    send({ system, agent }, forces) {
      const { duration } = (
        /** @type {Push} */
        this.pushes.get(system)
      );
      this.page.live?.send({ do: "push", system, agent: agent + 1, forces, duration });
    }
    // ---- the arrow
    /**
     * The arrow, under labels, which make way for its tip.
     * @param {CanvasRenderingContext2D} context of the overlay
     */
    drawUnder(context) {
      const { drag } = this;
      this.shown = null;
      if (!drag || !this.pushing) return;
      const forces = this.forces(drag);
      if (!forces || sizeOf(between(drag.from, drag.to)) <= STILL) return;
      const { which, system } = drag;
      const force = Math.hypot(...forces);
      const { duration } = (
        /** @type {Push} */
        this.pushes.get(system.name)
      );
      const from = this.page.scene.camera.project(this.page.scene.layout.headOf(system, which.agent));
      if (!from || !force) return;
      const tip = this.tip(drag, from, forces);
      arrow(context, from, tip);
      this.page.overlay.taken.push({ x: tip.x - TIP, y: tip.y - TIP, w: 2 * TIP, h: 2 * TIP });
      const unit = this.unitOf(system, which.agent);
      const text2 = `${withUnit(force, unit)} for ${number(duration)} s`;
      this.shown = { text: text2, tip, side: tip.x >= from.x ? 1 : -1, box: null };
    }
    /**
     * Its text, beside them.
     * @param {CanvasRenderingContext2D} context of the overlay
     */
    draw(context) {
      const { shown: shown2 } = this;
      if (!shown2) return;
      const { overlay } = this.page;
      context.font = "600 13px system-ui, sans-serif";
      context.textAlign = "left";
      context.textBaseline = "middle";
      context.fillStyle = colour("accent");
      shown2.box = this.room(context.measureText(shown2.text).width + 4, shown2.tip, shown2.side);
      overlay.taken.push(shown2.box);
      overlay.haloed(shown2.text, shown2.box.x + 2, shown2.box.y + shown2.box.h / 2);
    }
    /**
     * Room for the text at an arrow's tip: within the pane, off all labels if there is any such place.
     * @param {number} w of the text, px
     * @param {Place} tip
     * @param {number} side that is tried first: 1 to the right of it, -1 to the left
     * @returns {Box}
     */
    room(w, tip, side) {
      const { overlay } = this.page;
      const { clientWidth: wide, clientHeight: high } = overlay.canvas;
      const within2 = (v, most) => Math.max(Math.min(v, most - 2), 2);
      const places = ROWS.flatMap((row) => (row ? [side, -side, 0] : [side, -side]).map((at) => ({
        x: within2(tip.x - w / 2 + at * (TIP + 2 + w / 2), wide - w),
        y: within2(tip.y - HIGH / 2 + row * (HIGH + 6), high - HIGH),
        w,
        h: HIGH
      })));
      return places.find((box) => overlay.free(box)) ?? places[0];
    }
    /**
     * Where the arrow ends: along what acts, as far as was dragged.
     * @param {NonNullable<Pushing["drag"]>} drag
     * @param {Place} from
     * @param {number[]} forces
     */
    tip({ which, system, from: begun, to: to2 }, from, forces) {
      const along2 = { x: 0, y: 0 };
      this.waysOf(system, which.agent).forEach((way, k) => {
        if (!way || !forces[k]) return;
        const { x, y } = this.onScreen(system, which.agent, way);
        along2.x += forces[k] * x;
        along2.y += forces[k] * y;
      });
      const far = sizeOf(between(begun, to2)) / (sizeOf(along2) || 1);
      return { x: from.x + far * along2.x, y: from.y + far * along2.y };
    }
  };
  var arrow = (context, from, to2) => {
    const angle = Math.atan2(to2.y - from.y, to2.x - from.x);
    context.strokeStyle = context.fillStyle = colour("accent");
    context.lineWidth = 3;
    context.lineCap = "round";
    context.beginPath();
    context.moveTo(from.x, from.y);
    context.lineTo(to2.x, to2.y);
    context.stroke();
    context.beginPath();
    context.moveTo(to2.x + 4 * Math.cos(angle), to2.y + 4 * Math.sin(angle));
    for (const side of [2.6, -2.6])
      context.lineTo(to2.x + 13 * Math.cos(angle + side), to2.y + 13 * Math.sin(angle + side));
    context.fill();
  };

  // src/switching.js
  var NEAR = 8;
  var NEAR_FINGER = 16;
  var nameOf = (system, [a, b]) => `${system} ${Math.min(a, b)}-${Math.max(a, b)}`;
  var Switching = class {
    /** @param {Page} page */
    constructor(page2) {
      this.page = page2;
      this.done = [];
      this.count = -1;
      this.time = NaN;
      this.lost = /* @__PURE__ */ new Set();
    }
    /**
     * Whether the link between two agents, from 1, is lost at the time that is shown.
     * @param {System} system
     * @param {[number, number]} pair
     */
    isLost({ name }, pair) {
      return this.lost.size > 0 && this.lost.has(nameOf(name, pair));
    }
    /**
     * What was done up to a time in s.
     * @param {Intervention[]} done
     * @param {number} time
     */
    follow(done, time) {
      if (done === this.done && done.length === this.count && time === this.time) return;
      this.done = done;
      this.count = done.length;
      this.time = time;
      this.lost = /* @__PURE__ */ new Set();
      for (const { system = "", link, lost, time: when } of done) {
        if (!link || when > time + 1e-9) continue;
        if (lost) this.lost.add(nameOf(system, link));
        else this.lost.delete(nameOf(system, link));
      }
    }
    /**
     * A click in the pane on nobody, px.
     * @param {number} x
     * @param {number} y
     * @param {string} by mouse, pen or touch
     */
    click(x, y, by) {
      const { hands, overlay, meta } = this.page;
      if (!hands.running || !overlay.links.shown || !meta) return;
      const near = by === "touch" ? NEAR_FINGER : NEAR;
      const found = overlay.links.nearest(meta.systems, x, y, near);
      if (found) this.toggle(found.system, found.edge);
    }
    /**
     * @param {System} system
     * @param {[number, number]} agents from 1
     */
    toggle(system, agents) {
      const { running } = this.page.hands;
      if (!running) return;
      if (system.edges_are !== "messages") {
        const text2 = `${system.name}: dashed lines are measurements, so that there is no link to lose.`;
        return notify(text2, "info", `link ${system.name}`);
      }
      const lost = !this.isLost(system, agents);
      running.send({ do: "link", system: system.name, agents, lost });
    }
  };

  // src/handson.js
  var HandsOn = class {
    /** @param {Page} page */
    constructor(page2) {
      const { overlay } = page2;
      this.page = page2;
      this.pushing = new Pushing(page2);
      this.switching = new Switching(page2);
      this.chosen = new Chosen(page2);
      overlay.hands = this.pushing;
      overlay.links.isLost = (system, pair) => this.switching.isLost(system, pair);
    }
    /** The simulation that hands act on; none while a replay is shown. */
    get running() {
      return this.page.playback ? null : this.page.live;
    }
    /** @param {Scene} meta */
    setMeta(meta) {
      this.pushing.setMeta(meta);
      this.chosen.setMeta(meta);
    }
    /** Another source of the same scene: what can be done is another thing. */
    renew() {
      this.chosen.choose(this.chosen.which);
    }
    /**
     * Before a picture.
     * @param {Source} source
     * @param {Instant} instant
     */
    follow({ interventions }, { time }) {
      this.switching.follow(interventions, time);
    }
  };

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
      const of2 = source.seekable ? "closest approach" : "closest approach so far";
      const chips = systems.map((system) => chipOf(system, source.stateOf(system), of2, this.lead));
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
  var chipOf = (system, state, of2, lead) => {
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
      marginOf(state, of2, lead)
    );
  };
  var marginOf = ({ status: word, margin, margin_name: name, margin_time: time }, of2, lead) => {
    const none = word === "not_begun" ? "no margin yet" : "no margin known";
    if (typeof margin !== "number") return element("span", { class: "margin", text: none });
    const text2 = `${of2}: margin ${number(margin)}${name ? ` · ${name}` : ""}`;
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

  // src/history.js
  var History = class {
    /**
     * @param {System[]} systems
     * @param {number} most samples
     */
    constructor(systems, most = 3e3) {
      this.most = most;
      this.names = systems.flatMap(
        (system) => partsOf(system).filter((part) => !["estimate", "joints"].includes(part)).map((part) => `${system.name}/${part}`)
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
          (k) => Array.from(time, (_, i) => orNull(data[i * width + k]))
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
        const keep = (values) => values.filter((_, i) => i % 2 === 0);
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
  var unshuffled = (bytes, size, columns) => {
    const rows = bytes.length / (size * columns);
    const out = new Uint8Array(bytes.length);
    let from = 0;
    for (let byte = 0; byte < size; byte++)
      for (let column = 0; column < columns; column++)
        for (let row = 0; row < rows; row++)
          out[(row * columns + column) * size + byte] = bytes[from++];
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
      const columns = entry.shape.slice(1).reduce((a, b) => a * b, 1);
      const own = entry.shuffled ? unshuffled(raw, Type.BYTES_PER_ELEMENT, columns) : raw.slice();
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
  var FULL2 = 1013;
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
          code === FULL2 ? `this page is not connected: ${reason}` : "connection lost: the simulation has ended or the server is gone"
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
      this.values = {};
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
      else if (message.kind === "controls") this.takeValues(message.values);
      else if (message.kind === "interventions") this.interventions = message.done;
    }
    /** @param {Record<string, number>} values where sliders are now */
    takeValues(values) {
      for (const key of Object.keys(values)) if (values[key] !== this.values[key]) dismiss(key);
      this.values = values;
      this.listener.controls(values);
    }
    // ---- in words
    /**
     * @param {System} system
     * @returns {State}
     */
    stateOf({ name }) {
      const state = this.frame?.state[name] ?? { status: "waiting" };
      if (state.status !== "running") return state;
      if (!this.connected) return { ...state, status: "not_connected" };
      if (this.playing) return state;
      return { ...state, status: this.time > 0 ? "paused" : "not_begun" };
    }
    get pace() {
      if (!this.frame) return "";
      if (!this.connected) return "not connected";
      if (!this.playing) return "paused";
      const { speed, pace } = this.frame;
      const wished = speed === null ? "as fast as possible" : `×${number(speed)}`;
      const reached = speed !== null && pace !== null && Math.abs(pace / speed - 1) < 0.05;
      return pace === null || reached ? wished : `${wished}, ×${number(pace)} reached`;
    }
  };

  // src/labels.js
  var HIGH2 = 20;
  var STEP = HIGH2 + 4;
  var PLACES = [
    [0, 0, 0, 0],
    [0, -1, 0, 0],
    [0.65, -0.5, 0, 0],
    [-0.65, -0.5, 0, 0],
    [0.55, 0.5, 1, 0.5],
    [-0.55, 0.5, -1, 0.5],
    [0, 1, 0, 1],
    [0, -2, 0, 0],
    [0.8, -1.5, 0, 0],
    [-0.8, -1.5, 0, 0],
    [0.6, 1, 0, 1],
    [-0.6, 1, 0, 1],
    [0, 2, 0, 1],
    [0, -3, 0, 0],
    [0.9, 0.4, 0, 0],
    [-0.9, 0.4, 0, 0],
    [1.2, 0.5, 1, 0.5],
    [-1.2, 0.5, -1, 0.5],
    [0, -4, 0, 0]
  ];
  var labelOrder = (n) => {
    const zeros = (k) => k === 0 ? 32 : Math.log2(k & -k);
    return [...Array(n).keys()].sort((a, b) => zeros(b) - zeros(a) || a - b);
  };
  var placed = ([right, down, side, below], pill, body) => ({
    ...pill,
    x: pill.x + right * pill.w + side * body.w / 2,
    y: pill.y + down * STEP + below * body.h
  });
  var nearest = (box, x, y) => ({
    x: Math.min(Math.max(x, box.x), box.x + box.w),
    y: Math.min(Math.max(y, box.y), box.y + box.h)
  });
  var Labels = class {
    /** @param {Overlay} overlay */
    constructor(overlay) {
      this.overlay = overlay;
      this.orders = /* @__PURE__ */ new Map();
      this.places = /* @__PURE__ */ new Map();
      this.drawn = [];
    }
    /** @param {System[]} systems of another scene */
    begin(systems) {
      this.orders = new Map(systems.map((system) => [system.name, labelOrder(system.agents)]));
      this.places.clear();
    }
    /**
     * @param {System} system
     * @param {Instant} instant
     * @param {boolean} labelled whether they are to be seen, besides the one that is pointed at
     */
    draw(system, instant, labelled) {
      const shares = instant.systems[system.name].share;
      const share = (agent) => shares ? shares[agent] : NaN;
      const pointed = (agent) => this.overlay.isHighlighted(system, agent);
      const first = (agent) => pointed(agent) || share(agent) > 1;
      const order = this.orders.get(system.name) ?? [];
      const urgent = order.filter(first);
      const seen = [...urgent, ...order.filter((each) => !first(each))].filter(
        (agent) => isThere(instant.systems[system.name], agent) && (labelled || pointed(agent))
      );
      const found = seen.flatMap((agent) => this.label(system, agent, share(agent)) ?? []);
      for (const { pill, body } of found) this.lead(pill, body);
      for (const { pill, about } of found) this.pill(pill, about);
    }
    /**
     * A label that finds room, which is then taken.
     * @param {System} system
     * @param {number} agent
     * @param {number} share
     */
    label(system, agent, share) {
      const { overlay } = this;
      const body = overlay.scene.camera.boxOf(system, agent);
      if (!body) return;
      const p = { x: body.x + body.w / 2, y: body.y };
      overlay.marks.push({ x: p.x, y: p.y, system: system.name, agent });
      const name = String(agent + 1);
      const out = share > 1;
      const used2 = percent(share);
      for (const text2 of used2 ? [used2, ""] : [""]) {
        const pill = this.room(system, agent, this.pillBox(p, name, out ? `⚠ ${text2}` : text2), body);
        if (!pill) continue;
        overlay.taken.push(pill);
        this.drawn.push({ ...pill, system: system.name });
        overlay.marks.push({ x: pill.x + pill.w / 2, y: pill.y + HIGH2 / 2, system: system.name, agent });
        return { pill, body, about: { name, system, agent, out } };
      }
      this.places.delete(`${system.name} ${agent}`);
    }
    /**
     * A label where there is room for it, first where it was, over robots only if there is no other;
     * null where there is none.
     * @param {System} system
     * @param {number} agent
     * @param {Pill} pill right above
     * @param {Box} body of the robot
     */
    room(system, agent, pill, body) {
      const { overlay } = this;
      const key = `${system.name} ${agent}`;
      const before = this.places.get(key) ?? 0;
      const places = [before, ...PLACES.keys()].map((k) => ({ k, box: placed(PLACES[k], pill, body) }));
      const free = places.filter(({ k, box }) => (k === 0 || this.inside(box)) && overlay.free(box));
      const found = free.find(({ box }) => this.inside(box) && overlay.clear(box)) ?? free[0];
      if (found) {
        const { k, box } = found;
        this.places.set(key, k === before && before > 0 && this.lonely(pill) ? 0 : k);
        return box;
      }
      return overlay.isHighlighted(system, agent) ? pill : null;
    }
    /** @param {Box} box */
    inside({ x, y, w, h }) {
      const { clientWidth: wide, clientHeight: high } = this.overlay.canvas;
      return x >= 0 && x + w <= wide && y >= 0 && y + h <= high;
    }
    /** @param {Box} box */
    lonely({ x, y, w, h }) {
      const around = { x: x - 8, y: y - 8, w: w + 16, h: h + 16 };
      return this.overlay.free(around) && this.inside(around) && this.overlay.clear({ x, y, w, h });
    }
    /**
     * @param {{x: number, y: number}} p
     * @param {string} name
     * @param {string} text
     * @returns {Pill}
     */
    pillBox(p, name, text2) {
      const { context } = this.overlay;
      context.font = "600 13px system-ui, sans-serif";
      const wide = context.measureText(name).width;
      context.font = "12px system-ui, sans-serif";
      const more = text2 ? context.measureText(text2).width + 7 : 0;
      const w = wide + more + 14;
      return { x: p.x - w / 2, y: p.y - 22, w, h: HIGH2, wide, text: text2 };
    }
    /**
     * @param {Pill} box
     * @param {{name: string, system: System, agent: number, out: boolean}} about
     */
    pill(box, { name, system, agent, out }) {
      const { context } = this.overlay;
      const chosen = this.overlay.isHighlighted(system, agent);
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
     * A line to the robot, where the label is not at it.
     * @param {Box} box
     * @param {Box} body
     */
    lead(box, body) {
      const p = nearest(body, box.x + box.w / 2, box.y + box.h / 2);
      const { x, y } = nearest(box, p.x, p.y);
      if (Math.hypot(p.x - x, p.y - y) < 8) return;
      const { context } = this.overlay;
      context.strokeStyle = colour("muted");
      context.lineWidth = 1;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(p.x, p.y);
      context.stroke();
    }
    /**
     * The look of the agent's line in the plots, under its label.
     * @param {Box} box
     * @param {number} agent
     */
    swatch(box, agent) {
      const { context } = this.overlay;
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
  };

  // src/overlay.js
  var colourOf = ({ bad, limit, chosen, title }) => bad ? "bad" : limit ? "limit" : chosen ? "accent" : title ? "muted" : "text";
  var RING = 3;
  var MANY2 = 60;
  var meet = (a, b) => a.x < b.x + b.w && b.x < a.x + a.w && a.y < b.y + b.h && b.y < a.y + a.h;
  var BODY = 24;
  var awayFrom = (a, b, x, y) => {
    const [dx, dy] = [b.x - a.x, b.y - a.y];
    const along2 = ((x - a.x) * dx + (y - a.y) * dy) / (dx * dx + dy * dy || 1);
    const t = Math.min(Math.max(along2, 0), 1);
    return Math.hypot(a.x + t * dx - x, a.y + t * dy - y);
  };
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
      this.labels = new Labels(this);
      this.hands = null;
      this.labelled = true;
      this.systems = [];
      this.runs = [];
      this.taken = [];
      this.bodies = [];
      this.marks = [];
      this.highlighted = null;
    }
    /** @param {Meta} meta */
    setMeta({ systems, runs = [], palette: palette2 }) {
      setPalette(palette2);
      this.systems = systems;
      this.runs = runs;
      this.labels.begin(systems);
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
      this.labels.drawn = [];
      const solid = this.systems.filter(isSolid);
      this.bodies = this.bodiesOf(solid.filter(({ drawn_as: as2 }) => as2 === "fleet"));
      this.links.draw(solid, instant, now);
      for (const system of this.systems) if (system.shown.faint) this.rings(system);
      if (this.runs.length && solid.length === this.systems.length)
        for (const text2 of headingTexts(solid, this.runs, this.scene.layout)) this.text(text2);
      this.hands?.drawUnder(context);
      for (const system of solid)
        if (system.drawn_as === "bars") this.barTexts(system);
        else this.labels.draw(system, instant, this.labelled);
      this.distances();
      this.hands?.draw(context);
    }
    /**
     * Rings around robots that lie over those of another run, dashed as their run is in the plots:
     * where both are nearly at one place, one would not see them.
     * @param {System} system
     */
    rings(system) {
      const { context } = this;
      if (system.drawn_as === "bars" || system.agents > MANY2) return;
      context.strokeStyle = colour("ghost");
      context.lineWidth = 2;
      context.setLineDash(dashOf(system.run));
      for (const agent of system.anchors.keys()) {
        const box = this.scene.camera.boxOf(system, agent);
        if (!box) continue;
        const [w, h] = [box.w / 2 + RING, box.h / 2 + RING];
        context.beginPath();
        context.ellipse(box.x + box.w / 2, box.y + box.h / 2, w, h, 0, 0, 2 * Math.PI);
        context.stroke();
      }
      context.setLineDash([]);
    }
    /** Metres along the lane, at the ground's stronger lines. */
    distances() {
      const { context } = this;
      const { camera, surroundings, layout } = this.scene;
      if (!layout.box) return;
      const { low, high } = layout.box;
      const y = low[1] - (layout.lane === null ? 1.5 : 0.75);
      context.font = "11px system-ui, sans-serif";
      context.textAlign = "center";
      context.textBaseline = "top";
      context.fillStyle = colour("muted");
      const step = surroundings.ground.major > 10 ? surroundings.ground.major : 5;
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
    /** @param {System[]} fleets */
    bodiesOf(fleets) {
      if (fleets.reduce((sum, { agents }) => sum + agents, 0) > MANY2) return [];
      return fleets.flatMap((system) => system.anchors.map((_, k) => this.scene.camera.boxOf(system, k))).filter((box) => box !== null);
    }
    /**
     * Whether no text is there.
     * @param {Box} box
     */
    free(box) {
      return !this.taken.some((taken) => meet(box, taken));
    }
    /**
     * Whether no robot is there.
     * @param {Box} box
     */
    clear(box) {
      return !this.bodies.some((body) => meet(box, body));
    }
    /**
     * @param {System} system
     * @param {number} agent
     */
    isHighlighted(system, agent) {
      const which = this.highlighted;
      return which?.system === system.name && which?.agent === agent;
    }
    /** @param {System} system */
    barTexts(system) {
      const bars = this.scene.layout.barsOf(system);
      for (const text2 of [bars.title(), ...bars.gaugeTexts()]) this.text(text2);
      const owners = system.action.owner;
      const digits = decimals(bars.reference);
      owners.forEach((owner, k) => {
        const p = this.scene.camera.project(bars.top(k));
        if (p) this.marks.push({ x: p.x, y: p.y, system: system.name, agent: owner - 1 });
        if (!this.labelled) return;
        const chosen = this.isHighlighted(system, owner - 1);
        const axis = system.action.axis[k] || "";
        this.text({ point: bars.foot(k), text: `${owner}${axis}`, shift: 11, bold: true, chosen });
        this.text({
          point: bars.top(k),
          text: fixed(bars.values[k] ?? null, digits),
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
     * The agent at a point of the pane: its label, or what stands there, from the ground to its head.
     * @param {number} x
     * @param {number} y
     */
    agentAt(x, y) {
      const near = this.agentNear(x, y);
      if (near) return near;
      const { camera, layout } = this.scene;
      let best = null;
      let nearest2 = BODY;
      for (const system of this.scene.fleets)
        for (let agent = 0; agent < system.agents; agent++) {
          const foot = camera.project(layout.agentAt(system, agent));
          const head = camera.project(layout.headOf(system, agent));
          if (!foot || !head) continue;
          const away = awayFrom(foot, head, x, y);
          if (away < nearest2) [best, nearest2] = [{ system: system.name, agent }, away];
        }
      return best;
    }
    /**
     * The agent whose label or head is near a point of the pane.
     * @param {number} x
     * @param {number} y
     */
    agentNear(x, y) {
      let best = null;
      let nearest2 = 26;
      for (const mark of this.marks) {
        const away = Math.hypot(mark.x - x, mark.y - y + 4);
        if (away < nearest2) [best, nearest2] = [{ system: mark.system, agent: mark.agent }, away];
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
    const sign = dot < 0 ? -1 : 1;
    let norm = 0;
    for (let c = k; c < k + 4; c++) {
      out[c] = (1 - f) * a[c] + f * sign * b[c];
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
      for (let v = 0; v < columns.length; v++) out[columns[v]] = values[i * columns.length + v];
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
    messagesBetween(name, from, to2) {
      const array = this.arrays[`${name}/messages`];
      if (!array || !(to2 > from)) return void 0;
      const width = array.data.length / this.time.length;
      const sum = new Float32Array(width);
      for (let i = this.at(from).i + 1; i <= this.at(to2).i; i++)
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
      return this.time.map((_, i) => orNull(array.data[i * width + k]));
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
      const to2 = direction > 0 ? i + 1 : f > 0 ? i : i - 1;
      this.seek(time[Math.min(Math.max(to2, 0), time.length - 1)], direction > 0);
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

  // node_modules/uplot-small.js
  var Js = "uplot";
  var Zs = "u-hz";
  var Qs = "u-vt";
  var Xs = "u-title";
  var er = "u-wrap";
  var tr = "u-under";
  var lr = "u-over";
  var nr = "u-axis";
  var Zt = "u-off";
  var ir = "u-select";
  var or = "u-cursor-x";
  var sr = "u-cursor-y";
  var rr = "u-cursor-pt";
  var fr = "u-legend";
  var ur = "u-live";
  var cr = "u-inline";
  var ar = "u-series";
  var pr = "u-marker";
  var ji = "u-label";
  var hr = "u-value";
  var Nl = "width";
  var Wl = "height";
  var qi = "bottom";
  var yl = "left";
  var Wn = "right";
  var ni = "#000";
  var $i = ni + "0";
  var Gn = "mousemove";
  var Ji = "mousedown";
  var In = "mouseup";
  var Zi = "mouseenter";
  var Qi = "mouseleave";
  var Xi = "dblclick";
  var mr = "resize";
  var gr = "scroll";
  var eo = "change";
  var sn = "dppxchange";
  var ii = "--";
  var Al = typeof window < "u";
  var jn = Al ? document : null;
  var kl = Al ? window : null;
  var dr = Al ? navigator : null;
  var oe;
  var tn;
  function qn() {
    let e = devicePixelRatio;
    oe != e && (oe = e, tn && Jn(eo, tn, qn), tn = matchMedia(`(min-resolution: ${oe - 1e-3}dppx) and (max-resolution: ${oe + 1e-3}dppx)`), Qt(eo, tn, qn), kl.dispatchEvent(new CustomEvent(sn)));
  }
  function Xe(e, i) {
    if (i != null) {
      let o = e.classList;
      !o.contains(i) && o.add(i);
    }
  }
  function $n(e, i) {
    let o = e.classList;
    o.contains(i) && o.remove(i);
  }
  function de(e, i, o) {
    e.style[i] = o + "px";
  }
  function gt(e, i, o, n) {
    let s = jn.createElement(e);
    return i != null && Xe(s, i), o?.insertBefore(s, n), s;
  }
  function ft(e, i) {
    return gt("div", e, i);
  }
  var to = /* @__PURE__ */ new WeakMap();
  function bt(e, i, o, n, s) {
    let a = "translate(" + i + "px," + o + "px)", u = to.get(e);
    a != u && (e.style.transform = a, to.set(e, a), i < 0 || o < 0 || i > n || o > s ? Xe(e, Zt) : $n(e, Zt));
  }
  var lo = /* @__PURE__ */ new WeakMap();
  function no(e, i, o) {
    let n = i + o, s = lo.get(e);
    n != s && (lo.set(e, n), e.style.background = i, e.style.borderColor = o);
  }
  var io = /* @__PURE__ */ new WeakMap();
  function oo(e, i, o, n) {
    let s = i + "" + o, a = io.get(e);
    s != a && (io.set(e, s), e.style.height = o + "px", e.style.width = i + "px", e.style.marginLeft = n ? -i / 2 + "px" : 0, e.style.marginTop = n ? -o / 2 + "px" : 0);
  }
  var oi = { passive: true };
  var wr = { ...oi, capture: true };
  function Qt(e, i, o, n) {
    i.addEventListener(e, o, n ? wr : oi);
  }
  function Jn(e, i, o, n) {
    i.removeEventListener(e, o, oi);
  }
  Al && qn();
  function dt(e, i, o, n) {
    let s;
    o = o || 0, n = n || i.length - 1;
    let a = n <= 2147483647;
    for (; n - o > 1; ) s = a ? o + n >> 1 : et((o + n) / 2), i[s] < e ? o = s : n = s;
    return e - i[o] <= i[n] - e ? o : n;
  }
  function Ro(e) {
    return (o, n, s) => {
      let a = -1, u = -1;
      for (let h = n; h <= s; h++) if (e(o[h])) {
        a = h;
        break;
      }
      for (let h = s; h >= n; h--) if (e(o[h])) {
        u = h;
        break;
      }
      return [a, u];
    };
  }
  var zo = (e) => e != null;
  var Fo = (e) => e != null && e > 0;
  var un = Ro(zo);
  var Sr = Ro(Fo);
  function _r(e, i, o, n = 0, s = false) {
    let a = s ? Sr : un, u = s ? Fo : zo;
    [i, o] = a(e, i, o);
    let h = e[i], m = e[i];
    if (i > -1) if (n == 1) h = e[i], m = e[o];
    else if (n == -1) h = e[o], m = e[i];
    else for (let g = i; g <= o; g++) {
      let y = e[g];
      u(y) && (y < h ? h = y : y > m && (m = y));
    }
    return [h ?? ce, m ?? -ce];
  }
  function cn(e, i, o, n) {
    let s = fo(e), a = fo(i);
    e == i && (s == -1 ? (e *= o, i /= o) : (e /= o, i *= o));
    let u = o == 10 ? Pt : Oo, h = s == 1 ? et : ut, m = a == 1 ? ut : et, g = h(u(Ee(e))), y = m(u(Ee(i))), d = xl(o, g), w = xl(o, y);
    return o == 10 && (g < 0 && (d = ae(d, -g)), y < 0 && (w = ae(w, -y))), n || o == 2 ? (e = d * s, i = w * a) : (e = Go(e, d), i = an(i, w)), [e, i];
  }
  function si(e, i, o, n) {
    let s = cn(e, i, o, n);
    return e == 0 && (s[0] = 0), i == 0 && (s[1] = 0), s;
  }
  var ri = 0.1;
  var so = { mode: 3, pad: ri };
  var Il = { pad: 0, soft: null, mode: 0 };
  var yr = { min: Il, max: Il };
  function rn(e, i, o, n) {
    return pn(o) ? ro(e, i, o) : (Il.pad = o, Il.soft = n ? 0 : null, Il.mode = n ? 3 : 0, ro(e, i, yr));
  }
  function ne(e, i) {
    return e ?? i;
  }
  function vr(e, i, o) {
    for (i = ne(i, 0), o = ne(o, e.length - 1); i <= o; ) {
      if (e[i] != null) return true;
      i++;
    }
    return false;
  }
  function ro(e, i, o) {
    let n = o.min, s = o.max, a = ne(n.pad, 0), u = ne(s.pad, 0), h = ne(n.hard, -ce), m = ne(s.hard, ce), g = ne(n.soft, ce), y = ne(s.soft, -ce), d = ne(n.mode, 0), w = ne(s.mode, 0), L = i - e, D = Pt(L), O = Ye(Ee(e), Ee(i)), N = Pt(O), G = Ee(N - D);
    (L < 1e-24 || G > 10) && (L = 0, (e == 0 || i == 0) && (L = 1e-24, d == 2 && g != ce && (a = 0), w == 2 && y != -ce && (u = 0)));
    let k = L || O || 1e3, H = Pt(k), x = xl(10, et(H)), q = k * (L == 0 ? e == 0 ? 0.1 : 1 : a), P = ae(Go(e - q, x / 10), 24), $ = e >= g && (d == 1 || d == 3 && P <= g || d == 2 && P >= g) ? g : ce, U = Ye(h, P < $ && e >= $ ? $ : wt($, P)), Q = k * (L == 0 ? i == 0 ? 0.1 : 1 : u), B = ae(an(i + Q, x / 10), 24), T = i <= y && (w == 1 || w == 3 && B >= y || w == 2 && B <= y) ? y : -ce, j = wt(m, B > T && i <= T ? T : Ye(T, B));
    return U == j && U == 0 && (j = 100), [U, j];
  }
  var kr = new Intl.NumberFormat(Al ? dr.language : "en-US");
  var fi = (e) => kr.format(e);
  var tt = Math;
  var on = tt.PI;
  var Ee = tt.abs;
  var et = tt.floor;
  var Ae = tt.round;
  var ut = tt.ceil;
  var wt = tt.min;
  var Ye = tt.max;
  var xl = tt.pow;
  var fo = tt.sign;
  var Pt = tt.log10;
  var Oo = tt.log2;
  var xr = (e, i = 1) => tt.sinh(e) * i;
  var Yn = (e, i = 1) => tt.asinh(e / i);
  var ce = 1 / 0;
  function uo(e) {
    return (Pt((e ^ e >> 31) - (e >> 31)) | 0) + 1;
  }
  function Zn(e, i, o) {
    return wt(Ye(e, i), o);
  }
  function Ho(e) {
    return typeof e == "function";
  }
  function X(e) {
    return Ho(e) ? e : () => e;
  }
  var Tr = () => {
  };
  var No = (e) => e;
  var Wo = (e, i) => i;
  var br = (e) => null;
  var co = (e) => true;
  var ao = (e, i) => e == i;
  var Mr = /\.\d*?(?=9{6,}|0{6,})/gm;
  var Xt = (e) => {
    if (Yo(e) || Ht.has(e)) return e;
    let i = `${e}`, o = i.match(Mr);
    if (o == null) return e;
    let n = o[0].length - 1;
    if (i.indexOf("e-") != -1) {
      let [s, a] = i.split("e");
      return +`${Xt(s)}e${a}`;
    }
    return ae(e, n);
  };
  function $t(e, i) {
    return Xt(ae(Xt(e / i)) * i);
  }
  function an(e, i) {
    return Xt(ut(Xt(e / i)) * i);
  }
  function Go(e, i) {
    return Xt(et(Xt(e / i)) * i);
  }
  function ae(e, i = 0) {
    if (Yo(e)) return e;
    let o = 10 ** i, n = e * o * (1 + Number.EPSILON);
    return Ae(n) / o;
  }
  var Ht = /* @__PURE__ */ new Map();
  function Io(e) {
    return (("" + e).split(".")[1] || "").length;
  }
  function Bl(e, i, o, n) {
    let s = [], a = n.map(Io);
    for (let u = i; u < o; u++) {
      let h = Ee(u), m = ae(xl(e, u), h);
      for (let g = 0; g < n.length; g++) {
        let y = e == 10 ? +`${n[g]}e${u}` : n[g] * m, d = (u >= 0 ? 0 : h) + (u >= a[g] ? 0 : a[g]), w = e == 10 ? y : ae(y, d);
        s.push(w), Ht.set(w, d);
      }
    }
    return s;
  }
  var Yl = {};
  var ui = [];
  var Tl = [null, null];
  var Ot = Array.isArray;
  var Yo = Number.isInteger;
  var Ar = (e) => e === void 0;
  function po(e) {
    return typeof e == "string";
  }
  function pn(e) {
    let i = false;
    if (e != null) {
      let o = e.constructor;
      i = o == null || o == Object;
    }
    return i;
  }
  function Er(e) {
    return e != null && typeof e == "object";
  }
  var Pr = Object.getPrototypeOf(Uint8Array);
  var Bo = "__proto__";
  function bl(e, i = pn) {
    let o;
    if (Ot(e)) {
      let n = e.find((s) => s != null);
      if (Ot(n) || i(n)) {
        o = Array(e.length);
        for (let s = 0; s < e.length; s++) o[s] = bl(e[s], i);
      } else o = e.slice();
    } else if (e instanceof Pr) o = e.slice();
    else if (i(e)) {
      o = {};
      for (let n in e) n != Bo && (o[n] = bl(e[n], i));
    } else o = e;
    return o;
  }
  function Te(e) {
    let i = arguments;
    for (let o = 1; o < i.length; o++) {
      let n = i[o];
      for (let s in n) s != Bo && (pn(e[s]) ? Te(e[s], bl(n[s])) : e[s] = bl(n[s]));
    }
    return e;
  }
  var Dr = 0;
  var Lr = 1;
  var Cr = 2;
  function Vr(e, i, o) {
    for (let n = 0, s, a = -1; n < i.length; n++) {
      let u = i[n];
      if (u > a) {
        for (s = u - 1; s >= 0 && e[s] == null; ) e[s--] = null;
        for (s = u + 1; s < o && e[s] == null; ) e[a = s++] = null;
      }
    }
  }
  function Rr(e, i) {
    if (Or(e)) {
      let u = e[0].slice();
      for (let h = 1; h < e.length; h++) u.push(...e[h].slice(1));
      return Hr(u[0]) || (u = Fr(u)), u;
    }
    let o = /* @__PURE__ */ new Set();
    for (let u = 0; u < e.length; u++) {
      let m = e[u][0], g = m.length;
      for (let y = 0; y < g; y++) o.add(m[y]);
    }
    let n = [Array.from(o).sort((u, h) => u - h)], s = n[0].length, a = /* @__PURE__ */ new Map();
    for (let u = 0; u < s; u++) a.set(n[0][u], u);
    for (let u = 0; u < e.length; u++) {
      let h = e[u], m = h[0];
      for (let g = 1; g < h.length; g++) {
        let y = h[g], d = Array(s).fill(void 0), w = i ? i[u][g] : Lr, L = [];
        for (let D = 0; D < y.length; D++) {
          let O = y[D], N = a.get(m[D]);
          O === null ? w != Dr && (d[N] = O, w == Cr && L.push(N)) : d[N] = O;
        }
        Vr(d, L, s), n.push(d);
      }
    }
    return n;
  }
  var zr = typeof queueMicrotask > "u" ? (e) => Promise.resolve().then(e) : queueMicrotask;
  function Fr(e) {
    let i = e[0], o = i.length, n = Array(o);
    for (let a = 0; a < n.length; a++) n[a] = a;
    n.sort((a, u) => i[a] - i[u]);
    let s = [];
    for (let a = 0; a < e.length; a++) {
      let u = e[a], h = Array(o);
      for (let m = 0; m < o; m++) h[m] = u[n[m]];
      s.push(h);
    }
    return s;
  }
  function Or(e) {
    let i = e[0][0], o = i.length;
    for (let n = 1; n < e.length; n++) {
      let s = e[n][0];
      if (s.length != o) return false;
      if (s != i) {
        for (let a = 0; a < o; a++) if (s[a] != i[a]) return false;
      }
    }
    return true;
  }
  function Hr(e, i = 100) {
    let o = e.length;
    if (o <= 1) return true;
    let n = 0, s = o - 1;
    for (; n <= s && e[n] == null; ) n++;
    for (; s >= n && e[s] == null; ) s--;
    if (s <= n) return true;
    let a = Ye(1, et((s - n + 1) / i));
    for (let u = e[n], h = n + a; h <= s; h += a) {
      let m = e[h];
      if (m != null) {
        if (m <= u) return false;
        u = m;
      }
    }
    return true;
  }
  var Uo = ["January", "February", "March", "April", "May", "June", "July", "August", "September", "October", "November", "December"];
  var Ko = ["Sunday", "Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday"];
  function jo(e) {
    return e.slice(0, 3);
  }
  var Nr = Ko.map(jo);
  var Wr = Uo.map(jo);
  var Gr = { MMMM: Uo, MMM: Wr, WWWW: Ko, WWW: Nr };
  function Hl(e) {
    return (e < 10 ? "0" : "") + e;
  }
  function Ir(e) {
    return (e < 10 ? "00" : e < 100 ? "0" : "") + e;
  }
  var Yr = { YYYY: (e) => e.getFullYear(), YY: (e) => (e.getFullYear() + "").slice(2), MMMM: (e, i) => i.MMMM[e.getMonth()], MMM: (e, i) => i.MMM[e.getMonth()], MM: (e) => Hl(e.getMonth() + 1), M: (e) => e.getMonth() + 1, DD: (e) => Hl(e.getDate()), D: (e) => e.getDate(), WWWW: (e, i) => i.WWWW[e.getDay()], WWW: (e, i) => i.WWW[e.getDay()], HH: (e) => Hl(e.getHours()), H: (e) => e.getHours(), h: (e) => {
    let i = e.getHours();
    return i == 0 ? 12 : i > 12 ? i - 12 : i;
  }, AA: (e) => e.getHours() >= 12 ? "PM" : "AM", aa: (e) => e.getHours() >= 12 ? "pm" : "am", a: (e) => e.getHours() >= 12 ? "p" : "a", mm: (e) => Hl(e.getMinutes()), m: (e) => e.getMinutes(), ss: (e) => Hl(e.getSeconds()), s: (e) => e.getSeconds(), fff: (e) => Ir(e.getMilliseconds()) };
  function ci(e, i) {
    i = i || Gr;
    let o = [], n = /\{([a-z]+)\}|[^{]+/gi, s;
    for (; s = n.exec(e); ) o.push(s[0][0] == "{" ? Yr[s[1]] : s[0]);
    return (a) => {
      let u = "";
      for (let h = 0; h < o.length; h++) u += typeof o[h] == "string" ? o[h] : o[h](a, i);
      return u;
    };
  }
  var Br = new Intl.DateTimeFormat().resolvedOptions().timeZone;
  function Ur(e, i) {
    let o;
    return i == "UTC" || i == "Etc/UTC" ? o = new Date(+e + e.getTimezoneOffset() * 6e4) : i == Br ? o = e : (o = new Date(e.toLocaleString("en-US", { timeZone: i })), o.setMilliseconds(e.getMilliseconds())), o;
  }
  var qo = (e) => e % 1 == 0;
  var fn = [1, 2, 2.5, 5];
  var Kr = Bl(10, -32, 0, fn);
  var $o = Bl(10, 0, 32, fn);
  var jr = $o.filter(qo);
  var Jt = Kr.concat($o);
  var ai = `
`;
  var Jo = "{YYYY}";
  var ho = ai + Jo;
  var Zo = "{M}/{D}";
  var Gl = ai + Zo;
  var ln = Gl + "/{YY}";
  var Qo = "{aa}";
  var qr = "{h}:{mm}";
  var vl = qr + Qo;
  var mo = ai + vl;
  var go = ":{ss}";
  var re = null;
  function Xo(e) {
    let i = e * 1e3, o = i * 60, n = o * 60, s = n * 24, a = s * 30, u = s * 365, m = (e == 1 ? Bl(10, 0, 3, fn).filter(qo) : Bl(10, -3, 0, fn)).concat([i, i * 5, i * 10, i * 15, i * 30, o, o * 5, o * 10, o * 15, o * 30, n, n * 2, n * 3, n * 4, n * 6, n * 8, n * 12, s, s * 2, s * 3, s * 4, s * 5, s * 6, s * 7, s * 8, s * 9, s * 10, s * 15, a, a * 2, a * 3, a * 4, a * 6, u, u * 2, u * 5, u * 10, u * 25, u * 50, u * 100]), g = [[u, Jo, re, re, re, re, re, re, 1], [s * 28, "{MMM}", ho, re, re, re, re, re, 1], [s, Zo, ho, re, re, re, re, re, 1], [n, "{h}" + Qo, ln, re, Gl, re, re, re, 1], [o, vl, ln, re, Gl, re, re, re, 1], [i, go, ln + " " + vl, re, Gl + " " + vl, re, mo, re, 1], [e, go + ".{fff}", ln + " " + vl, re, Gl + " " + vl, re, mo, re, 1]];
    function y(d) {
      return (w, L, D, O, N, G) => {
        let k = [], H = N >= u, x = N >= a && N < u, q = d(D), P = ae(q * e, 3), $ = Bn(q.getFullYear(), H ? 0 : q.getMonth(), x || H ? 1 : q.getDate()), U = ae($ * e, 3);
        if (x || H) {
          let Q = x ? N / a : 0, B = H ? N / u : 0, T = P == U ? P : ae(Bn($.getFullYear() + B, $.getMonth() + Q, 1) * e, 3), j = new Date(Ae(T / e)), C = j.getFullYear(), I = j.getMonth();
          for (let F = 0; T <= O; F++) {
            let ee = Bn(C + B * F, I + Q * F, 1), z = ee - d(ae(ee * e, 3));
            T = ae((+ee + z) * e, 3), T <= O && k.push(T);
          }
        } else {
          let Q = N >= s ? s : N, B = et(D) - et(P), T = U + B + an(P - U, Q);
          k.push(T);
          let j = d(T), C = j.getHours() + j.getMinutes() / o + j.getSeconds() / n, I = N / n, F = w.axes[L]._space, ee = G / F;
          for (; T = ae(T + N, e == 1 ? 0 : 3), !(T > O); ) if (I > 1) {
            let z = et(ae(C + I, 6)) % 24, te = d(T).getHours() - z;
            te > 1 && (te = -1), T -= te * n, C = (C + I) % 24;
            let fe = k[k.length - 1];
            ae((T - fe) / N, 3) * ee >= 0.7 && k.push(T);
          } else k.push(T);
        }
        return k;
      };
    }
    return [m, g, y];
  }
  var [$r, Jr, Zr] = Xo(1);
  var [Qr, Xr, ef] = Xo(1e-3);
  Bl(2, -53, 53, [1]);
  function wo(e, i) {
    return e.map((o) => o.map((n, s) => s == 0 || s == 8 || n == null ? n : i(s == 1 || o[8] == 0 ? n : o[1] + n)));
  }
  function So(e, i) {
    return (o, n, s, a, u) => {
      let h = i.find((D) => u >= D[0]) || i[i.length - 1], m, g, y, d, w, L;
      return n.map((D) => {
        let O = e(D), N = O.getFullYear(), G = O.getMonth(), k = O.getDate(), H = O.getHours(), x = O.getMinutes(), q = O.getSeconds(), P = N != m && h[2] || G != g && h[3] || k != y && h[4] || H != d && h[5] || x != w && h[6] || q != L && h[7] || h[1];
        return m = N, g = G, y = k, d = H, w = x, L = q, P(O);
      });
    };
  }
  function tf(e, i) {
    let o = ci(i);
    return (n, s, a, u, h) => s.map((m) => o(e(m)));
  }
  function Bn(e, i, o) {
    return new Date(e, i, o);
  }
  function _o(e, i) {
    return i(e);
  }
  var lf = "{YYYY}-{MM}-{DD} {h}:{mm}{aa}";
  function yo(e, i) {
    return (o, n, s, a) => a == null ? ii : i(e(n));
  }
  function nf(e, i) {
    let o = e.series[i];
    return o.width ? o.stroke(e, i) : o.points.width ? o.points.stroke(e, i) : null;
  }
  function of(e, i) {
    return e.series[i].fill(e, i);
  }
  var sf = { show: true, live: true, isolate: false, mount: Tr, markers: { show: true, width: 2, stroke: nf, fill: of, dash: "solid" }, idx: null, idxs: null, values: [] };
  function rf(e, i) {
    let o = e.cursor.points, n = ft(), s = o.size(e, i);
    de(n, Nl, s), de(n, Wl, s);
    let a = s / -2;
    de(n, "marginLeft", a), de(n, "marginTop", a);
    let u = o.width(e, i, s);
    return u && de(n, "borderWidth", u), n;
  }
  function ff(e, i) {
    let o = e.series[i].points;
    return o._fill || o._stroke;
  }
  function uf(e, i) {
    let o = e.series[i].points;
    return o._stroke || o._fill;
  }
  function cf(e, i) {
    return e.series[i].points.size;
  }
  var Un = [0, 0];
  function af(e, i, o) {
    return Un[0] = i, Un[1] = o, Un;
  }
  function nn(e, i, o, n = true) {
    return (s) => {
      s.button == 0 && (!n || s.target == i) && o(s);
    };
  }
  function Kn(e, i, o, n = true) {
    return (s) => {
      (!n || s.target == i) && o(s);
    };
  }
  var pf = { show: true, x: true, y: true, lock: false, move: af, points: { one: false, show: rf, size: cf, width: 0, stroke: uf, fill: ff }, bind: { mousedown: nn, mouseup: nn, click: nn, dblclick: nn, mousemove: Kn, mouseleave: Kn, mouseenter: Kn }, drag: { setScale: true, x: true, y: false, dist: 0, uni: null, click: (e, i) => {
    i.stopPropagation(), i.stopImmediatePropagation();
  }, _x: false, _y: false }, focus: { dist: (e, i, o, n, s) => n - s, prox: -1, bias: 0 }, hover: { skip: [void 0], prox: null, bias: 0 }, left: -10, top: -10, idx: null, dataIdx: null, idxs: null, event: null };
  var es = { show: true, stroke: "rgba(0,0,0,0.07)", width: 2 };
  var pi = Te({}, es, { filter: Wo });
  var ts = Te({}, pi, { size: 10 });
  var ls = Te({}, es, { show: false });
  var hi = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, "Noto Sans", sans-serif, "Apple Color Emoji", "Segoe UI Emoji", "Segoe UI Symbol", "Noto Color Emoji"';
  var ns = "bold " + hi;
  var is = 1.5;
  var vo = { show: true, scale: "x", stroke: ni, space: 50, gap: 5, alignTo: 1, size: 50, labelGap: 0, labelSize: 30, labelFont: ns, side: 2, grid: pi, ticks: ts, border: ls, font: hi, lineGap: is, rotate: 0 };
  var hf = "Value";
  var mf = "Time";
  var ko = { show: true, scale: "x", auto: false, sorted: 1, min: ce, max: -ce, idxs: [] };
  function gf(e, i, o, n, s) {
    return i.map((a) => a == null ? "" : fi(a));
  }
  function df(e, i, o, n, s, a, u) {
    let h = [], m = Ht.get(s) || 0;
    o = u ? o : ae(an(o, s), m);
    for (let g = o; g <= n; g = ae(g + s, m)) h.push(Object.is(g, -0) ? 0 : g);
    return h;
  }
  function Qn(e, i, o, n, s, a, u) {
    let h = [], m = e.scales[e.axes[i].scale].log, g = m == 10 ? Pt : Oo, y = et(g(o));
    s = xl(m, y), m == 10 && (s = Jt[dt(s, Jt)]);
    let d = o, w = s * m;
    m == 10 && (w = Jt[dt(w, Jt)]);
    do
      h.push(d), d = d + s, m == 10 && !Ht.has(d) && (d = ae(d, Ht.get(s))), d >= w && (s = d, w = s * m, m == 10 && (w = Jt[dt(w, Jt)]));
    while (d <= n);
    return h;
  }
  function wf(e, i, o, n, s, a, u) {
    let m = e.scales[e.axes[i].scale].asinh, g = n > m ? Qn(e, i, Ye(m, o), n, s) : [m], y = n >= 0 && o <= 0 ? [0] : [];
    return (o < -m ? Qn(e, i, Ye(m, -n), -o, s) : [m]).reverse().map((w) => -w).concat(y, g);
  }
  var os = /./;
  var Sf = /[12357]/;
  var _f = /[125]/;
  var xo = /1/;
  var Xn = (e, i, o, n) => e.map((s, a) => i == 4 && s == 0 || a % n == 0 && o.test(s.toExponential()[s < 0 ? 1 : 0]) ? s : null);
  function yf(e, i, o, n, s) {
    let a = e.axes[o], u = a.scale, h = e.scales[u], m = e.valToPos, g = a._space, y = m(10, u), d = m(9, u) - y >= g ? os : m(7, u) - y >= g ? Sf : m(5, u) - y >= g ? _f : xo;
    if (d == xo) {
      let w = Ee(m(1, u) - y);
      if (w < g) return Xn(i.slice().reverse(), h.distr, d, ut(g / w)).reverse();
    }
    return Xn(i, h.distr, d, 1);
  }
  function vf(e, i, o, n, s) {
    let a = e.axes[o], u = a.scale, h = a._space, m = e.valToPos, g = Ee(m(1, u) - m(2, u));
    return g < h ? Xn(i.slice().reverse(), 3, os, ut(h / g)).reverse() : i;
  }
  function kf(e, i, o, n) {
    return n == null ? ii : i == null ? "" : fi(i);
  }
  var To = { show: true, scale: "y", stroke: ni, space: 30, gap: 5, alignTo: 1, size: 50, labelGap: 0, labelSize: 30, labelFont: ns, side: 3, grid: pi, ticks: ts, border: ls, font: hi, lineGap: is, rotate: 0 };
  function xf(e, i) {
    let o = 3 + (e || 1) * 2;
    return ae(o * i, 3);
  }
  function Tf(e, i) {
    let { scale: o, idxs: n } = e.series[0], s = e._data[0], a = e.valToPos(s[n[0]], o, true), u = e.valToPos(s[n[1]], o, true), h = Ee(u - a), m = e.series[i], g = h / (m.points.space * oe);
    return n[1] - n[0] <= g;
  }
  var bo = { scale: null, auto: true, sorted: 0, min: ce, max: -ce };
  var ss = (e, i, o, n, s) => s;
  var Mo = { show: true, auto: true, sorted: 0, gaps: ss, alpha: 1, facets: [Te({}, bo, { scale: "x" }), Te({}, bo, { scale: "y" })] };
  var Ao = { scale: "y", auto: true, sorted: 0, show: true, spanGaps: false, gaps: ss, alpha: 1, points: { show: Tf, filter: null }, values: null, min: ce, max: -ce, idxs: [], path: null, clip: null };
  function bf(e, i, o, n, s) {
    return o / 10;
  }
  var rs = { time: true, auto: true, distr: 1, log: 10, asinh: 1, min: null, max: null, dir: 1, ori: 0 };
  var Mf = Te({}, rs, { time: false, ori: 1 });
  var Eo = {};
  function fs(e, i) {
    let o = Eo[e];
    return o || (o = { key: e, plots: [], sub(n) {
      o.plots.push(n);
    }, unsub(n) {
      o.plots = o.plots.filter((s) => s != n);
    }, pub(n, s, a, u, h, m, g) {
      for (let y = 0; y < o.plots.length; y++) o.plots[y] != s && o.plots[y].pub(n, s, a, u, h, m, g);
    } }, e != null && (Eo[e] = o)), o;
  }
  var Ml = 1;
  var ei = 2;
  function el(e, i, o) {
    let n = e.mode, s = e.series[i], a = n == 2 ? e._data[i] : e._data, u = e.scales, h = e.bbox, m = a[0], g = n == 2 ? a[1] : a[i], y = n == 2 ? u[s.facets[0].scale] : u[e.series[0].scale], d = n == 2 ? u[s.facets[1].scale] : u[s.scale], w = h.left, L = h.top, D = h.width, O = h.height, N = e.valToPosH, G = e.valToPosV;
    return y.ori == 0 ? o(s, m, g, y, d, N, G, w, L, D, O, mn, El, dn, cs, ps) : o(s, m, g, y, d, G, N, L, w, O, D, gn, Pl, di, as, hs);
  }
  function mi(e, i) {
    let o = 0, n = 0, s = ne(e.bands, ui);
    for (let a = 0; a < s.length; a++) {
      let u = s[a];
      u.series[0] == i ? o = u.dir : u.series[1] == i && (u.dir == 1 ? n |= 1 : n |= 2);
    }
    return [o, n == 1 ? -1 : n == 2 ? 1 : n == 3 ? 2 : 0];
  }
  function Af(e, i, o, n, s) {
    let a = e.mode, u = e.series[i], h = a == 2 ? u.facets[1].scale : u.scale, m = e.scales[h];
    return s == -1 ? m.min : s == 1 ? m.max : m.distr == 3 ? m.dir == 1 ? m.min : m.max : 0;
  }
  function Dt(e, i, o, n, s, a) {
    return el(e, i, (u, h, m, g, y, d, w, L, D, O, N) => {
      let G = u.pxRound, k = g.dir * (g.ori == 0 ? 1 : -1), H = g.ori == 0 ? El : Pl, x, q;
      k == 1 ? (x = o, q = n) : (x = n, q = o);
      let P = G(d(h[x], g, O, L)), $ = G(w(m[x], y, N, D)), U = G(d(h[q], g, O, L)), Q = G(w(a == 1 ? y.max : y.min, y, N, D)), B = new Path2D(s);
      return H(B, U, Q), H(B, P, Q), H(B, P, $), B;
    });
  }
  function hn(e, i, o, n, s, a) {
    let u = null;
    if (e.length > 0) {
      u = new Path2D();
      let h = i == 0 ? dn : di, m = o;
      for (let d = 0; d < e.length; d++) {
        let w = e[d];
        if (w[1] > w[0]) {
          let L = w[0] - m;
          L > 0 && h(u, m, n, L, n + a), m = w[1];
        }
      }
      let g = o + s - m, y = 10;
      g > 0 && h(u, m, n - y / 2, g, n + a + y);
    }
    return u;
  }
  function Ef(e, i, o) {
    let n = e[e.length - 1];
    n && n[0] == i ? n[1] = o : e.push([i, o]);
  }
  function gi(e, i, o, n, s, a, u) {
    let h = [], m = e.length;
    for (let g = s == 1 ? o : n; g >= o && g <= n; g += s) if (i[g] === null) {
      let d = g, w = g;
      if (s == 1) for (; ++g <= n && i[g] === null; ) w = g;
      else for (; --g >= o && i[g] === null; ) w = g;
      let L = a(e[d]), D = w == d ? L : a(e[w]), O = d - s;
      L = u <= 0 && O >= 0 && O < m ? a(e[O]) : L;
      let G = w + s;
      D = u >= 0 && G >= 0 && G < m ? a(e[G]) : D, D >= L && h.push([L, D]);
    }
    return h;
  }
  function Po(e) {
    return e == 0 ? No : e == 1 ? Ae : (i) => $t(i, e);
  }
  function us(e) {
    let i = e == 0 ? mn : gn, o = e == 0 ? (s, a, u, h, m, g) => {
      s.arcTo(a, u, h, m, g);
    } : (s, a, u, h, m, g) => {
      s.arcTo(u, a, m, h, g);
    }, n = e == 0 ? (s, a, u, h, m) => {
      s.rect(a, u, h, m);
    } : (s, a, u, h, m) => {
      s.rect(u, a, m, h);
    };
    return (s, a, u, h, m, g = 0, y = 0) => {
      g == 0 && y == 0 ? n(s, a, u, h, m) : (g = wt(g, h / 2, m / 2), y = wt(y, h / 2, m / 2), i(s, a + g, u), o(s, a + h, u, a + h, u + m, g), o(s, a + h, u + m, a, u + m, y), o(s, a, u + m, a, u, y), o(s, a, u, a + h, u, g), s.closePath());
    };
  }
  var mn = (e, i, o) => {
    e.moveTo(i, o);
  };
  var gn = (e, i, o) => {
    e.moveTo(o, i);
  };
  var El = (e, i, o) => {
    e.lineTo(i, o);
  };
  var Pl = (e, i, o) => {
    e.lineTo(o, i);
  };
  var dn = us(0);
  var di = us(1);
  var cs = (e, i, o, n, s, a) => {
    e.arc(i, o, n, s, a);
  };
  var as = (e, i, o, n, s, a) => {
    e.arc(o, i, n, s, a);
  };
  var ps = (e, i, o, n, s, a, u) => {
    e.bezierCurveTo(i, o, n, s, a, u);
  };
  var hs = (e, i, o, n, s, a, u) => {
    e.bezierCurveTo(o, i, s, n, u, a);
  };
  function ms(e) {
    return (i, o, n, s, a) => el(i, o, (u, h, m, g, y, d, w, L, D, O, N) => {
      let { pxRound: G, points: k } = u, H, x;
      g.ori == 0 ? (H = mn, x = cs) : (H = gn, x = as);
      let q = ae(k.width * oe, 3), P = (k.size - k.width) / 2 * oe, $ = ae(P * 2, 3), U = new Path2D(), Q = new Path2D(), { left: B, top: T, width: j, height: C } = i.bbox;
      dn(Q, B - $, T - $, j + $ * 2, C + $ * 2);
      let I = (F) => {
        if (m[F] != null) {
          let ee = G(d(h[F], g, O, L)), z = G(w(m[F], y, N, D));
          H(U, ee + P, z), x(U, ee, z, P, 0, on * 2);
        }
      };
      if (a) a.forEach(I);
      else for (let F = n; F <= s; F++) I(F);
      return { stroke: q > 0 ? U : null, fill: U, clip: Q, flags: Ml | ei };
    });
  }
  function gs(e) {
    return (i, o, n, s, a, u) => {
      n != s && (a != n && u != n && e(i, o, n), a != s && u != s && e(i, o, s), e(i, o, u));
    };
  }
  var Pf = gs(El);
  var Df = gs(Pl);
  function ds(e) {
    let i = ne(e?.alignGaps, 0);
    return (o, n, s, a) => el(o, n, (u, h, m, g, y, d, w, L, D, O, N) => {
      [s, a] = un(m, s, a);
      let G = u.pxRound, k = (C) => G(d(C, g, O, L)), H = (C) => G(w(C, y, N, D)), x, q;
      g.ori == 0 ? (x = El, q = Pf) : (x = Pl, q = Df);
      let P = g.dir * (g.ori == 0 ? 1 : -1), $ = { stroke: new Path2D(), fill: null, clip: null, band: null, gaps: null, flags: Ml }, U = $.stroke, Q = false;
      if (a - s >= O * 4) {
        let C = (V) => o.posToVal(V, g.key, true), I = null, F = null, ee, z, Ue, we = k(h[P == 1 ? s : a]), te = k(h[s]), fe = k(h[a]), J = C(P == 1 ? te + 1 : fe - 1);
        for (let V = P == 1 ? s : a; V >= s && V <= a; V += P) {
          let be = h[V], Se = (P == 1 ? be < J : be > J) ? we : k(be), se = m[V];
          Se == we ? se != null ? (z = se, I == null ? (x(U, Se, H(z)), ee = I = F = z) : z < I ? I = z : z > F && (F = z)) : se === null && (Q = true) : (I != null && q(U, we, H(I), H(F), H(ee), H(z)), se != null ? (z = se, x(U, Se, H(z)), I = F = ee = z) : (I = F = null, se === null && (Q = true)), we = Se, J = C(we + P));
        }
        I != null && I != F && Ue != we && q(U, we, H(I), H(F), H(ee), H(z));
      } else for (let C = P == 1 ? s : a; C >= s && C <= a; C += P) {
        let I = m[C];
        I === null ? Q = true : I != null && x(U, k(h[C]), H(I));
      }
      let [T, j] = mi(o, n);
      if (u.fill != null || T != 0) {
        let C = $.fill = new Path2D(U), I = u.fillTo(o, n, u.min, u.max, T), F = H(I), ee = k(h[s]), z = k(h[a]);
        P == -1 && ([z, ee] = [ee, z]), x(C, z, F), x(C, ee, F);
      }
      if (!u.spanGaps) {
        let C = [];
        Q && C.push(...gi(h, m, s, a, P, k, i)), $.gaps = C = u.gaps(o, n, s, a, C), $.clip = hn(C, g.ori, L, D, O, N);
      }
      return j != 0 && ($.band = j == 2 ? [Dt(o, n, s, a, U, -1), Dt(o, n, s, a, U, 1)] : Dt(o, n, s, a, U, j)), $;
    });
  }
  function Lf(e) {
    let i = ne(e.align, 1), o = ne(e.ascDesc, false), n = ne(e.alignGaps, 0), s = ne(e.extend, false);
    return (a, u, h, m) => el(a, u, (g, y, d, w, L, D, O, N, G, k, H) => {
      [h, m] = un(d, h, m);
      let x = g.pxRound, { left: q, width: P } = a.bbox, $ = (te) => x(D(te, w, k, N)), U = (te) => x(O(te, L, H, G)), Q = w.ori == 0 ? El : Pl, B = { stroke: new Path2D(), fill: null, clip: null, band: null, gaps: null, flags: Ml }, T = B.stroke, j = w.dir * (w.ori == 0 ? 1 : -1), C = U(d[j == 1 ? h : m]), I = $(y[j == 1 ? h : m]), F = I, ee = I;
      s && i == -1 && (ee = q, Q(T, ee, C)), Q(T, I, C);
      for (let te = j == 1 ? h : m; te >= h && te <= m; te += j) {
        let fe = d[te];
        if (fe == null) continue;
        let J = $(y[te]), V = U(fe);
        i == 1 ? Q(T, J, C) : Q(T, F, V), Q(T, J, V), C = V, F = J;
      }
      let z = F;
      s && i == 1 && (z = q + P, Q(T, z, C));
      let [Ue, we] = mi(a, u);
      if (g.fill != null || Ue != 0) {
        let te = B.fill = new Path2D(T), fe = g.fillTo(a, u, g.min, g.max, Ue), J = U(fe);
        Q(te, z, J), Q(te, ee, J);
      }
      if (!g.spanGaps) {
        let te = [];
        te.push(...gi(y, d, h, m, j, $, n));
        let fe = g.width * oe / 2, J = o || i == 1 ? fe : -fe, V = o || i == -1 ? -fe : fe;
        te.forEach((be) => {
          be[0] += J, be[1] += V;
        }), B.gaps = te = g.gaps(a, u, h, m, te), B.clip = hn(te, w.ori, N, G, k, H);
      }
      return we != 0 && (B.band = we == 2 ? [Dt(a, u, h, m, T, -1), Dt(a, u, h, m, T, 1)] : Dt(a, u, h, m, T, we)), B;
    });
  }
  function Do(e, i, o, n, s, a, u = ce) {
    if (e.length > 1) {
      let h = null;
      for (let m = 0, g = 1 / 0; m < e.length; m++) if (i[m] !== void 0) {
        if (h != null) {
          let y = Ee(e[m] - e[h]);
          y < g && (g = y, u = Ee(o(e[m], n, s, a) - o(e[h], n, s, a)));
        }
        h = m;
      }
    }
    return u;
  }
  function Cf(e) {
    e = e || Yl;
    let i = ne(e.size, [0.6, ce, 1]), o = e.align || 0, n = e.gap || 0, s = e.radius;
    s = s == null ? [0, 0] : typeof s == "number" ? [s, 0] : s;
    let a = X(s), u = 1 - i[0], h = ne(i[1], ce), m = ne(i[2], 1), g = ne(e.disp, Yl), y = ne(e.each, (L) => {
    }), { fill: d, stroke: w } = g;
    return (L, D, O, N) => el(L, D, (G, k, H, x, q, P, $, U, Q, B, T) => {
      let j = G.pxRound, C = o, I = n * oe, F = h * oe, ee = m * oe, z, Ue;
      x.ori == 0 ? [z, Ue] = a(L, D) : [Ue, z] = a(L, D);
      let we = x.dir * (x.ori == 0 ? 1 : -1), te = x.ori == 0 ? dn : di, fe = x.ori == 0 ? y : (A, pe, Me, il, Gt, _t, It) => {
        y(A, pe, Me, Gt, il, It, _t);
      }, J = ne(L.bands, ui).find((A) => A.series[0] == D), V = J != null ? J.dir : 0, be = G.fillTo(L, D, G.min, G.max, V), He = j($(be, q, T, Q)), Se, se, ct, qe = B, ye = j(G.width * oe), St = false, Mt = null, lt = null, Lt = null, tl = null;
      d != null && (ye == 0 || w != null) && (St = true, Mt = d.values(L, D, O, N), lt = /* @__PURE__ */ new Map(), new Set(Mt).forEach((A) => {
        A != null && lt.set(A, new Path2D());
      }), ye > 0 && (Lt = w.values(L, D, O, N), tl = /* @__PURE__ */ new Map(), new Set(Lt).forEach((A) => {
        A != null && tl.set(A, new Path2D());
      })));
      let { x0: ll, size: Dl } = g;
      if (ll != null && Dl != null) {
        C = 1, k = ll.values(L, D, O, N), ll.unit == 2 && (k = k.map((Me) => L.posToVal(U + Me * B, x.key, true)));
        let A = Dl.values(L, D, O, N);
        Dl.unit == 2 ? se = A[0] * B : se = P(A[0], x, B, U) - P(0, x, B, U), qe = Do(k, H, P, x, B, U, qe), ct = qe - se + I;
      } else qe = Do(k, H, P, x, B, U, qe), ct = qe * u + I, se = qe - ct;
      ct < 1 && (ct = 0), ye >= se / 2 && (ye = 0), ct < 5 && (j = No);
      let Ul = ct > 0, Nt = qe - ct - (Ul ? ye : 0);
      se = j(Zn(Nt, ee, F)), Se = (C == 0 ? se / 2 : C == we ? 0 : se) - C * we * ((C == 0 ? I / 2 : 0) + (Ul ? ye / 2 : 0));
      let Ne = { stroke: null, fill: null, clip: null, band: null, gaps: null, flags: 0 }, nl = St ? null : new Path2D(), At = null;
      if (J != null) At = L.data[J.series[1]];
      else {
        let { y0: A, y1: pe } = g;
        A != null && pe != null && (H = pe.values(L, D, O, N), At = A.values(L, D, O, N));
      }
      let Wt = z * se, K = Ue * se;
      for (let A = we == 1 ? O : N; A >= O && A <= N; A += we) {
        let pe = H[A];
        if (pe == null) continue;
        if (At != null) {
          let Ke = At[A] ?? 0;
          if (pe - Ke == 0) continue;
          He = $(Ke, q, T, Q);
        }
        let Me = x.distr != 2 || g != null ? k[A] : A, il = P(Me, x, B, U), Gt = $(ne(pe, be), q, T, Q), _t = j(il - Se), It = j(Ye(Gt, He)), $e = j(wt(Gt, He)), nt = It - $e;
        if (pe != null) {
          let Ke = pe < 0 ? K : Wt, at = pe < 0 ? Wt : K;
          St ? (ye > 0 && Lt[A] != null && te(tl.get(Lt[A]), _t, $e + et(ye / 2), se, Ye(0, nt - ye), Ke, at), Mt[A] != null && te(lt.get(Mt[A]), _t, $e + et(ye / 2), se, Ye(0, nt - ye), Ke, at)) : te(nl, _t, $e + et(ye / 2), se, Ye(0, nt - ye), Ke, at), fe(L, D, A, _t - ye / 2, $e, se + ye, nt);
        }
      }
      return ye > 0 ? Ne.stroke = St ? tl : nl : St || (Ne._fill = G.width == 0 ? G._fill : G._stroke ?? G._fill, Ne.width = 0), Ne.fill = St ? lt : nl, Ne;
    });
  }
  function Vf(e, i) {
    let o = ne(i?.alignGaps, 0);
    return (n, s, a, u) => el(n, s, (h, m, g, y, d, w, L, D, O, N, G) => {
      [a, u] = un(g, a, u);
      let k = h.pxRound, H = (z) => k(w(z, y, N, D)), x = (z) => k(L(z, d, G, O)), q, P, $;
      y.ori == 0 ? (q = mn, $ = El, P = ps) : (q = gn, $ = Pl, P = hs);
      let U = y.dir * (y.ori == 0 ? 1 : -1), Q = H(m[U == 1 ? a : u]), B = Q, T = [], j = [];
      for (let z = U == 1 ? a : u; z >= a && z <= u; z += U) if (g[z] != null) {
        let we = m[z], te = H(we);
        T.push(B = te), j.push(x(g[z]));
      }
      let C = { stroke: e(T, j, q, $, P, k), fill: null, clip: null, band: null, gaps: null, flags: Ml }, I = C.stroke, [F, ee] = mi(n, s);
      if (h.fill != null || F != 0) {
        let z = C.fill = new Path2D(I), Ue = h.fillTo(n, s, h.min, h.max, F), we = x(Ue);
        $(z, B, we), $(z, Q, we);
      }
      if (!h.spanGaps) {
        let z = [];
        z.push(...gi(m, g, a, u, U, H, o)), C.gaps = z = h.gaps(n, s, a, u, z), C.clip = hn(z, y.ori, D, O, N, G);
      }
      return ee != 0 && (C.band = ee == 2 ? [Dt(n, s, a, u, I, -1), Dt(n, s, a, u, I, 1)] : Dt(n, s, a, u, I, ee)), C;
    });
  }
  function Rf(e) {
    return Vf(zf, e);
  }
  function zf(e, i, o, n, s, a) {
    let u = e.length;
    if (u < 2) return null;
    let h = new Path2D();
    if (o(h, e[0], i[0]), u == 2) n(h, e[1], i[1]);
    else {
      let m = Array(u), g = Array(u - 1), y = Array(u - 1), d = Array(u - 1);
      for (let w = 0; w < u - 1; w++) y[w] = i[w + 1] - i[w], d[w] = e[w + 1] - e[w], g[w] = y[w] / d[w];
      m[0] = g[0];
      for (let w = 1; w < u - 1; w++) g[w] === 0 || g[w - 1] === 0 || g[w - 1] > 0 != g[w] > 0 ? m[w] = 0 : (m[w] = 3 * (d[w - 1] + d[w]) / ((2 * d[w] + d[w - 1]) / g[w - 1] + (d[w] + 2 * d[w - 1]) / g[w]), isFinite(m[w]) || (m[w] = 0));
      m[u - 1] = g[u - 2];
      for (let w = 0; w < u - 1; w++) s(h, e[w] + d[w] / 3, i[w] + m[w] * d[w] / 3, e[w + 1] - d[w] / 3, i[w + 1] - m[w + 1] * d[w] / 3, e[w + 1], i[w + 1]);
    }
    return h;
  }
  var ti = /* @__PURE__ */ new Set();
  function Lo() {
    for (let e of ti) e.syncRect(true);
  }
  Al && (Qt(mr, kl, Lo), Qt(gr, kl, Lo, true), Qt(sn, kl, () => {
    Be.pxRatio = oe;
  }));
  var Ff = ds();
  var Of = ms();
  function Co(e, i, o, n) {
    return (n ? [e[0], e[1]].concat(e.slice(2)) : [e[0]].concat(e.slice(1))).map((a, u) => li(a, u, i, o));
  }
  function Hf(e, i) {
    return e.map((o, n) => n == 0 ? {} : Te({}, i, o));
  }
  function li(e, i, o, n) {
    return Te({}, i == 0 ? o : n, e);
  }
  function ws(e, i, o) {
    return i == null ? Tl : [i, o];
  }
  var Nf = ws;
  function Wf(e, i, o) {
    return i == null ? Tl : rn(i, o, ri, true);
  }
  function Ss(e, i, o, n) {
    return i == null ? Tl : cn(i, o, e.scales[n].log, false);
  }
  var Gf = Ss;
  function _s(e, i, o, n) {
    return i == null ? Tl : si(i, o, e.scales[n].log, false);
  }
  var If = _s;
  function Yf(e, i, o, n, s) {
    let a = Ye(uo(e), uo(i)), u = i - e, h = dt(s / n * u, o);
    do {
      let m = o[h], g = n * m / u;
      if (g >= s && a + (m < 5 ? Ht.get(m) : 0) <= 17) return [m, g];
    } while (++h < o.length);
    return [0, 0];
  }
  function Vo(e) {
    let i, o;
    return e = e.replace(/(\d+)px/, (n, s) => (i = Ae((o = +s) * oe)) + "px"), [e, i, o];
  }
  function Bf(e) {
    e.show && [e.font, e.labelFont].forEach((i) => {
      let o = ae(i[2] * oe, 1);
      i[0] = i[0].replace(/[0-9.]+px/, o + "px"), i[1] = o;
    });
  }
  function Be(e, i, o) {
    let n = { mode: ne(e.mode, 1) }, s = n.mode;
    function a(t, l, r, f) {
      let c = l.valToPct(t);
      return f + r * (l.dir == -1 ? 1 - c : c);
    }
    function u(t, l, r, f) {
      let c = l.valToPct(t);
      return f + r * (l.dir == -1 ? c : 1 - c);
    }
    function h(t, l, r, f) {
      return l.ori == 0 ? a(t, l, r, f) : u(t, l, r, f);
    }
    n.valToPosH = a, n.valToPosV = u;
    let m = false;
    n.status = 0;
    let g = n.root = ft(Js);
    if (e.id != null && (g.id = e.id), Xe(g, e.class), e.title) {
      let t = ft(Xs, g);
      t.textContent = e.title;
    }
    let y = gt("canvas"), d = n.ctx = y.getContext("2d"), w = ft(er, g);
    Qt("click", w, (t) => {
      t.target === D && (he != gl || _e != dl) && Fe.click(n, t);
    }, true);
    let L = n.under = ft(tr, w);
    w.appendChild(y);
    let D = n.over = ft(lr, w);
    e = bl(e);
    let O = +ne(e.pxAlign, 1), N = Po(O);
    (e.plugins || []).forEach((t) => {
      t.opts && (e = t.opts(n, e) || e);
    });
    let G = e.ms || 1e-3, k = n.series = s == 1 ? Co(e.series || [], ko, Ao, false) : Hf(e.series || [null], Mo), H = n.axes = Co(e.axes || [], vo, To, true), x = n.scales = {}, q = n.bands = e.bands || [];
    q.forEach((t) => {
      t.fill = X(t.fill || null), t.dir = ne(t.dir, -1);
    });
    let P = s == 2 ? k[1].facets[0].scale : k[0].scale, $ = { axes: zs, series: Ds }, U = (e.drawOrder || ["axes", "series"]).map((t) => $[t]);
    function Q(t) {
      let l = t.distr == 3 ? (r) => Pt(r > 0 ? r : t.clamp(n, r, t.min, t.max, t.key)) : t.distr == 4 ? (r) => Yn(r, t.asinh) : t.distr == 100 ? (r) => t.fwd(r) : (r) => r;
      return (r) => {
        let f = l(r), { _min: c, _max: p } = t, S = p - c;
        return (f - c) / S;
      };
    }
    function B(t) {
      let l = x[t];
      if (l == null) {
        let r = (e.scales || Yl)[t] || Yl;
        if (r.from != null) {
          B(r.from);
          let f = Te({}, x[r.from], r, { key: t });
          f.valToPct = Q(f), x[t] = f;
        } else {
          l = x[t] = Te({}, t == P ? rs : Mf, r), l.key = t;
          let f = l.time, c = l.range, p = Ot(c);
          if ((t != P || s == 2 && !f) && (p && (c[0] == null || c[1] == null) && (c = { min: c[0] == null ? so : { mode: 1, hard: c[0], soft: c[0] }, max: c[1] == null ? so : { mode: 1, hard: c[1], soft: c[1] } }, p = false), !p && pn(c))) {
            let S = c;
            c = (_, v, b) => v == null ? Tl : rn(v, b, S);
          }
          l.range = X(c || (f ? Nf : t == P ? l.distr == 3 ? Gf : l.distr == 4 ? If : ws : l.distr == 3 ? Ss : l.distr == 4 ? _s : Wf)), l.auto = X(p ? false : l.auto), l.clamp = X(l.clamp || bf), l._min = l._max = null, l.valToPct = Q(l);
        }
      }
    }
    B("x"), B("y"), s == 1 && k.forEach((t) => {
      B(t.scale);
    }), H.forEach((t) => {
      B(t.scale);
    });
    for (let t in e.scales) B(t);
    let T = x[P], j = T.distr, C, I;
    T.ori == 0 ? (Xe(g, Zs), C = a, I = u) : (Xe(g, Qs), C = u, I = a);
    let F = {};
    for (let t in x) {
      let l = x[t];
      (l.min != null || l.max != null) && (F[t] = { min: l.min, max: l.max }, l.min = l.max = null);
    }
    let ee = e.tzDate || ((t) => new Date(Ae(t / G))), z = e.fmtDate || ci, Ue = G == 1 ? Zr(ee) : ef(ee), we = So(ee, wo(G == 1 ? Jr : Xr, z)), te = yo(ee, _o(lf, z)), fe = [], J = n.legend = Te({}, sf, e.legend), V = n.cursor = Te({}, pf, { drag: { y: s == 2 } }, e.cursor), be = J.show, He = V.show, Se = J.markers;
    J.idxs = fe, Se.width = X(Se.width), Se.dash = X(Se.dash), Se.stroke = X(Se.stroke), Se.fill = X(Se.fill);
    let se, ct, qe, ye = [], St = [], Mt, lt = false, Lt = {};
    if (J.live) {
      let t = k[1] ? k[1].values : null;
      lt = t != null, Mt = lt ? t(n, 1, 0) : { _: 0 };
      for (let l in Mt) Lt[l] = ii;
    }
    if (be) if (se = gt("table", fr, g), qe = gt("tbody", null, se), J.mount(n, se), lt) {
      ct = gt("thead", null, se, qe);
      let t = gt("tr", null, ct);
      gt("th", null, t);
      for (var tl in Mt) gt("th", ji, t).textContent = tl;
    } else Xe(se, cr), J.live && Xe(se, ur);
    let ll = { show: true }, Dl = { show: false };
    function Ul(t, l) {
      if (l == 0 && (lt || !J.live || s == 2)) return Tl;
      let r = [], f = gt("tr", ar, qe, qe.childNodes[l]);
      Xe(f, t.class), t.show || Xe(f, Zt);
      let c = gt("th", null, f);
      if (Se.show) {
        let _ = ft(pr, c);
        if (l > 0) {
          let v = Se.width(n, l);
          v && (_.style.border = v + "px " + Se.dash(n, l) + " " + Se.stroke(n, l)), _.style.background = Se.fill(n, l);
        }
      }
      let p = ft(ji, c);
      t.label instanceof HTMLElement ? p.appendChild(t.label) : p.textContent = t.label, l > 0 && (Se.show || (p.style.color = t.width > 0 ? Se.stroke(n, l) : Se.fill(n, l)), Ne("click", c, (_) => {
        if (V._lock) return;
        Bt(_);
        let v = k.indexOf(t);
        if ((_.ctrlKey || _.metaKey) != J.isolate) {
          let b = k.some((M, E) => E > 0 && E != v && M.show);
          k.forEach((M, E) => {
            E > 0 && vt(E, b ? E == v ? ll : Dl : ll, true, xe.setSeries);
          });
        } else vt(v, { show: !t.show }, true, xe.setSeries);
      }, false), sl && Ne(Zi, c, (_) => {
        V._lock || (Bt(_), vt(k.indexOf(t), Sl, true, xe.setSeries));
      }, false));
      for (var S in Mt) {
        let _ = gt("td", hr, f);
        _.textContent = "--", r.push(_);
      }
      return [f, r];
    }
    let Nt = /* @__PURE__ */ new Map();
    function Ne(t, l, r, f = true) {
      let c = Nt.get(l) || {}, p = V.bind[t](n, l, r, f);
      p && (Qt(t, l, c[t] = p), Nt.set(l, c));
    }
    function nl(t, l, r) {
      let f = Nt.get(l) || {};
      for (let c in f) (t == null || c == t) && (Jn(c, l, f[c]), delete f[c]);
      t == null && Nt.delete(l);
    }
    let At = 0, Wt = 0, K = 0, A = 0, pe = 0, Me = 0, il = pe, Gt = Me, _t = K, It = A, $e = 0, nt = 0, Ke = 0, at = 0;
    n.bbox = {};
    let wn = false, Kl = false, ol = false, Yt = false, jl = false, it = false;
    function Sn(t, l, r) {
      (r || t != n.width || l != n.height) && wi(t, l), al(false), ol = true, Kl = true, pl();
    }
    function wi(t, l) {
      n.width = At = K = t, n.height = Wt = A = l, pe = Me = 0, xs(), Ts();
      let r = n.bbox;
      $e = r.left = $t(pe * oe, 0.5), nt = r.top = $t(Me * oe, 0.5), Ke = r.width = $t(K * oe, 0.5), at = r.height = $t(A * oe, 0.5);
    }
    let ys = 3;
    function vs() {
      let t = false, l = 0;
      for (; !t; ) {
        l++;
        let r = Vs(l), f = Rs(l);
        t = l == ys || r && f, t || (wi(n.width, n.height), Kl = true);
      }
    }
    function ks({ width: t, height: l }) {
      Sn(t, l);
    }
    n.setSize = ks;
    function xs() {
      let t = false, l = false, r = false, f = false;
      H.forEach((c, p) => {
        if (c.show && c._show) {
          let { side: S, _size: _ } = c, v = S % 2, b = c.label != null ? c.labelSize : 0, M = _ + b;
          M > 0 && (v ? (K -= M, S == 3 ? (pe += M, f = true) : r = true) : (A -= M, S == 0 ? (Me += M, t = true) : l = true));
        }
      }), Ut[0] = t, Ut[1] = r, Ut[2] = l, Ut[3] = f, K -= Ct[1] + Ct[3], pe += Ct[3], A -= Ct[2] + Ct[0], Me += Ct[0];
    }
    function Ts() {
      let t = pe + K, l = Me + A, r = pe, f = Me;
      function c(p, S) {
        switch (p) {
          case 1:
            return t += S, t - S;
          case 2:
            return l += S, l - S;
          case 3:
            return r -= S, r + S;
          case 0:
            return f -= S, f + S;
        }
      }
      H.forEach((p, S) => {
        if (p.show && p._show) {
          let _ = p.side;
          p._pos = c(_, p._size), p.label != null && (p._lpos = c(_, p.labelSize));
        }
      });
    }
    if (V.dataIdx == null) {
      let t = V.hover, l = t.skip = new Set(t.skip ?? []);
      l.add(void 0);
      let r = t.prox = X(t.prox), f = t.bias ??= 0;
      V.dataIdx = (c, p, S, _) => {
        if (p == 0) return S;
        let v = S, b = r(c, p, S, _) ?? ce, M = b >= 0 && b < ce, E = T.ori == 0 ? K : A, Y = V.left, ie = i[0], le = i[p];
        if (l.has(le[S])) {
          v = null;
          let Z = null, W = null, R;
          if (f == 0 || f == -1) for (R = S; Z == null && R-- > 0; ) l.has(le[R]) || (Z = R);
          if (f == 0 || f == 1) for (R = S; W == null && R++ < le.length; ) l.has(le[R]) || (W = R);
          if (Z != null || W != null) if (M) {
            let ge = Z == null ? -1 / 0 : C(ie[Z], T, E, 0), ve = W == null ? 1 / 0 : C(ie[W], T, E, 0), Re = Y - ge, ue = ve - Y;
            Re <= ue ? Re <= b && (v = Z) : ue <= b && (v = W);
          } else v = W == null ? Z : Z == null ? W : S - Z <= W - S ? Z : W;
        } else M && Ee(Y - C(ie[S], T, E, 0)) > b && (v = null);
        return v;
      };
    }
    let Bt = (t) => {
      V.event = t;
    };
    V.idxs = fe, V._lock = false;
    let Oe = V.points;
    Oe.show = X(Oe.show), Oe.size = X(Oe.size), Oe.stroke = X(Oe.stroke), Oe.width = X(Oe.width), Oe.fill = X(Oe.fill);
    let yt = n.focus = Te({}, e.focus || { alpha: 0.3 }, V.focus), sl = yt.prox >= 0, rl = sl && Oe.one, ot = [], fl = [], ul = [];
    function Si(t, l) {
      let r = Oe.show(n, l);
      if (r instanceof HTMLElement) return Xe(r, rr), Xe(r, t.class), bt(r, -10, -10, K, A), D.insertBefore(r, ot[l]), r;
    }
    function _i(t, l) {
      if (s == 1 || l > 0) {
        let r = s == 1 && x[t.scale].time, f = t.value;
        t.value = r ? po(f) ? yo(ee, _o(f, z)) : f || te : f || kf, t.label = t.label || (r ? mf : hf);
      }
      if (rl || l > 0) {
        t.width = t.width == null ? 1 : t.width, t.paths = t.paths || Ff || br, t.fillTo = X(t.fillTo || Af), t.pxAlign = +ne(t.pxAlign, O), t.pxRound = Po(t.pxAlign), t.stroke = X(t.stroke || null), t.fill = X(t.fill || null), t._stroke = t._fill = t._paths = t._focus = null;
        let r = xf(Ye(1, t.width), 1), f = t.points = Te({}, { size: r, width: Ye(1, r * 0.2), stroke: t.stroke, space: r * 2, paths: Of, _stroke: null, _fill: null }, t.points);
        f.show = X(f.show), f.filter = X(f.filter), f.fill = X(f.fill), f.stroke = X(f.stroke), f.paths = X(f.paths), f.pxAlign = t.pxAlign;
      }
      if (be) {
        let r = Ul(t, l);
        ye.splice(l, 0, r[0]), St.splice(l, 0, r[1]), J.values.push(null);
      }
      if (He) {
        fe.splice(l, 0, null);
        let r = null;
        rl ? l == 0 && (r = Si(t, l)) : l > 0 && (r = Si(t, l)), ot.splice(l, 0, r), fl.splice(l, 0, 0), ul.splice(l, 0, 0);
      }
      Ve("addSeries", l);
    }
    function bs(t, l) {
      l = l ?? k.length, t = s == 1 ? li(t, l, ko, Ao) : li(t, l, {}, Mo), k.splice(l, 0, t), _i(k[l], l);
    }
    n.addSeries = bs;
    function Ms(t) {
      if (k.splice(t, 1), be) {
        J.values.splice(t, 1), St.splice(t, 1);
        let l = ye.splice(t, 1)[0];
        nl(null, l.firstChild), l.remove();
      }
      He && (fe.splice(t, 1), ot.splice(t, 1)[0].remove(), fl.splice(t, 1), ul.splice(t, 1)), Ve("delSeries", t);
    }
    n.delSeries = Ms;
    let Ut = [false, false, false, false];
    function As(t, l) {
      if (t._show = t.show, t.show) {
        let r = t.side % 2, f = x[t.scale];
        f == null && (t.scale = r ? k[1].scale : P, f = x[t.scale]);
        let c = f.time;
        t.size = X(t.size), t.space = X(t.space), t.rotate = X(t.rotate), Ot(t.incrs) && t.incrs.forEach((S) => {
          !Ht.has(S) && Ht.set(S, Io(S));
        }), t.incrs = X(t.incrs || (f.distr == 2 ? jr : c ? G == 1 ? $r : Qr : Jt)), t.splits = X(t.splits || (c && f.distr == 1 ? Ue : f.distr == 3 ? Qn : f.distr == 4 ? wf : df)), t.stroke = X(t.stroke), t.grid.stroke = X(t.grid.stroke), t.ticks.stroke = X(t.ticks.stroke), t.border.stroke = X(t.border.stroke);
        let p = t.values;
        t.values = Ot(p) && !Ot(p[0]) ? X(p) : c ? Ot(p) ? So(ee, wo(p, z)) : po(p) ? tf(ee, p) : p || we : p || gf, t.filter = X(t.filter || (f.distr >= 3 && f.log == 10 ? yf : f.distr == 3 && f.log == 2 ? vf : Wo)), t.font = Vo(t.font), t.labelFont = Vo(t.labelFont), t._size = t.size(n, null, l, 0), t._space = t._rotate = t._incrs = t._found = t._splits = t._values = null, t._size > 0 && (Ut[l] = true, t._el = ft(nr, w));
      }
    }
    function Ll(t, l, r, f) {
      let [c, p, S, _] = r, v = l % 2, b = 0;
      return v == 0 && (_ || p) && (b = l == 0 && !c || l == 2 && !S ? Ae(vo.size / 3) : 0), v == 1 && (c || S) && (b = l == 1 && !p || l == 3 && !_ ? Ae(To.size / 2) : 0), b;
    }
    let yi = n.padding = (e.padding || [Ll, Ll, Ll, Ll]).map((t) => X(ne(t, Ll))), Ct = n._padding = yi.map((t, l) => t(n, l, Ut, 0)), ze, Pe = null, De = null, ql = s == 1 ? k[0].idxs : null, pt = null, Cl = false;
    function vi(t, l) {
      if (i = t ?? [], n.data = n._data = i, s == 2) {
        ze = 0;
        for (let r = 1; r < k.length; r++) ze += i[r][0].length;
      } else {
        i.length == 0 && (n.data = n._data = i = [[]]), pt = i[0], ze = pt.length;
        let r = i;
        if (j == 2) {
          r = i.slice();
          let f = r[0] = Array(ze);
          for (let c = 0; c < ze; c++) f[c] = c;
        }
        n._data = i = r;
      }
      if (al(true), Ve("setData"), j == 2 && (ol = true), l !== false) {
        let r = T;
        r.auto(n, Cl) ? _n() : Rt(P, r.min, r.max), Yt = Yt || V.left >= 0, it = true, pl();
      }
    }
    n.setData = vi;
    function _n() {
      Cl = true;
      let t, l;
      s == 1 && (ze > 0 ? (Pe = ql[0] = 0, De = ql[1] = ze - 1, t = i[0][Pe], l = i[0][De], j == 2 ? (t = Pe, l = De) : t == l && (j == 3 ? [t, l] = cn(t, t, T.log, false) : j == 4 ? [t, l] = si(t, t, T.log, false) : T.time ? l = t + Ae(86400 / G) : [t, l] = rn(t, l, ri, true))) : (Pe = ql[0] = t = null, De = ql[1] = l = null)), Rt(P, t, l);
    }
    let $l, cl, yn, vn, kn, xn, Tn, bn, Mn, je;
    function ki(t, l, r, f, c, p) {
      t ??= $i, r ??= ui, f ??= "butt", c ??= $i, p ??= "round", t != $l && (d.strokeStyle = $l = t), c != cl && (d.fillStyle = cl = c), l != yn && (d.lineWidth = yn = l), p != kn && (d.lineJoin = kn = p), f != xn && (d.lineCap = xn = f), r != vn && d.setLineDash(vn = r);
    }
    function xi(t, l, r, f) {
      l != cl && (d.fillStyle = cl = l), t != Tn && (d.font = Tn = t), r != bn && (d.textAlign = bn = r), f != Mn && (d.textBaseline = Mn = f);
    }
    function An(t, l, r, f, c = 0) {
      if (f.length > 0 && t.auto(n, Cl) && (l == null || l.min == null)) {
        let p = ne(Pe, 0), S = ne(De, f.length - 1), _ = r.min == null ? _r(f, p, S, c, t.distr == 3) : [r.min, r.max];
        t.min = wt(t.min, r.min = _[0]), t.max = Ye(t.max, r.max = _[1]);
      }
    }
    let Ti = { min: null, max: null };
    function Es() {
      for (let f in x) {
        let c = x[f];
        F[f] == null && (c.min == null || F[P] != null && c.auto(n, Cl)) && (F[f] = Ti);
      }
      for (let f in x) {
        let c = x[f];
        F[f] == null && c.from != null && F[c.from] != null && (F[f] = Ti);
      }
      F[P] != null && al(true);
      let t = {};
      for (let f in F) {
        let c = F[f];
        if (c != null) {
          let p = t[f] = bl(x[f], Er);
          if (c.min != null) Te(p, c);
          else if (f != P || s == 2) if (ze == 0 && p.from == null) {
            let S = p.range(n, null, null, f);
            p.min = S[0], p.max = S[1];
          } else p.min = ce, p.max = -ce;
        }
      }
      if (ze > 0) {
        k.forEach((f, c) => {
          if (s == 1) {
            let p = f.scale, S = F[p];
            if (S == null) return;
            let _ = t[p];
            if (c == 0) {
              let v = _.range(n, _.min, _.max, p);
              _.min = v[0], _.max = v[1], Pe = dt(_.min, i[0]), De = dt(_.max, i[0]), De - Pe > 1 && (i[0][Pe] < _.min && Pe++, i[0][De] > _.max && De--), f.min = pt[Pe], f.max = pt[De];
            } else f.show && f.auto && An(_, S, f, i[c], f.sorted);
            f.idxs[0] = Pe, f.idxs[1] = De;
          } else if (c > 0 && f.show && f.auto) {
            let [p, S] = f.facets, _ = p.scale, v = S.scale, [b, M] = i[c], E = t[_], Y = t[v];
            E != null && An(E, F[_], p, b, p.sorted), Y != null && An(Y, F[v], S, M, S.sorted), f.min = S.min, f.max = S.max;
          }
        });
        for (let f in t) {
          let c = t[f], p = F[f];
          if (c.from == null && (p == null || p.min == null)) {
            let S = c.range(n, c.min == ce ? null : c.min, c.max == -ce ? null : c.max, f);
            c.min = S[0], c.max = S[1];
          }
        }
      }
      for (let f in t) {
        let c = t[f];
        if (c.from != null) {
          let p = t[c.from];
          if (p.min == null) c.min = c.max = null;
          else {
            let S = c.range(n, p.min, p.max, f);
            c.min = S[0], c.max = S[1];
          }
        }
      }
      let l = {}, r = false;
      for (let f in t) {
        let c = t[f], p = x[f];
        if (p.min != c.min || p.max != c.max) {
          p.min = c.min, p.max = c.max;
          let S = p.distr;
          p._min = S == 3 ? Pt(p.min) : S == 4 ? Yn(p.min, p.asinh) : S == 100 ? p.fwd(p.min) : p.min, p._max = S == 3 ? Pt(p.max) : S == 4 ? Yn(p.max, p.asinh) : S == 100 ? p.fwd(p.max) : p.max, l[f] = r = true;
        }
      }
      if (r) {
        k.forEach((f, c) => {
          s == 2 ? c > 0 && l.y && (f._paths = null) : l[f.scale] && (f._paths = null);
        });
        for (let f in l) ol = true, Ve("setScale", f);
        He && V.left >= 0 && (Yt = it = true);
      }
      for (let f in F) F[f] = null;
    }
    function Ps(t) {
      let l = Zn(Pe - 1, 0, ze - 1), r = Zn(De + 1, 0, ze - 1);
      for (; t[l] == null && l > 0; ) l--;
      for (; t[r] == null && r < ze - 1; ) r++;
      return [l, r];
    }
    function Ds() {
      if (ze > 0) {
        let t = k.some((l) => l._focus) && je != yt.alpha;
        t && (d.globalAlpha = je = yt.alpha), k.forEach((l, r) => {
          if (r > 0 && l.show && (bi(r, false), bi(r, true), l._paths == null)) {
            let f = je;
            je != l.alpha && (d.globalAlpha = je = l.alpha);
            let c = s == 2 ? [0, i[r][0].length - 1] : Ps(i[r]);
            l._paths = l.paths(n, r, c[0], c[1]), je != f && (d.globalAlpha = je = f);
          }
        }), k.forEach((l, r) => {
          if (r > 0 && l.show) {
            let f = je;
            je != l.alpha && (d.globalAlpha = je = l.alpha), l._paths != null && Mi(r, false);
            {
              let c = l._paths != null ? l._paths.gaps : null, p = l.points.show(n, r, Pe, De, c), S = l.points.filter(n, r, p, c);
              (p || S) && (l.points._paths = l.points.paths(n, r, Pe, De, S), Mi(r, true));
            }
            je != f && (d.globalAlpha = je = f), Ve("drawSeries", r);
          }
        }), t && (d.globalAlpha = je = 1);
      }
    }
    function bi(t, l) {
      let r = l ? k[t].points : k[t];
      r._stroke = r.stroke(n, t), r._fill = r.fill(n, t);
    }
    function Mi(t, l) {
      let r = l ? k[t].points : k[t], { stroke: f, fill: c, clip: p, flags: S, _stroke: _ = r._stroke, _fill: v = r._fill, _width: b = r.width } = r._paths;
      b = ae(b * oe, 3);
      let M = null, E = b % 2 / 2;
      l && v == null && (v = b > 0 ? "#fff" : _);
      let Y = r.pxAlign == 1 && E > 0;
      if (Y && d.translate(E, E), !l) {
        let ie = $e - b / 2, le = nt - b / 2, Z = Ke + b, W = at + b;
        M = new Path2D(), M.rect(ie, le, Z, W);
      }
      l ? En(_, b, r.dash, r.cap, v, f, c, S, p) : Ls(t, _, b, r.dash, r.cap, v, f, c, S, M, p), Y && d.translate(-E, -E);
    }
    function Ls(t, l, r, f, c, p, S, _, v, b, M) {
      let E = false;
      v != 0 && q.forEach((Y, ie) => {
        if (Y.series[0] == t) {
          let le = k[Y.series[1]], Z = i[Y.series[1]], W = (le._paths || Yl).band;
          Ot(W) && (W = Y.dir == 1 ? W[0] : W[1]);
          let R, ge = null;
          le.show && W && vr(Z, Pe, De) ? (ge = Y.fill(n, ie) || p, R = le._paths.clip) : W = null, En(l, r, f, c, ge, S, _, v, b, M, R, W), E = true;
        }
      }), E || En(l, r, f, c, p, S, _, v, b, M);
    }
    let Ai = Ml | ei;
    function En(t, l, r, f, c, p, S, _, v, b, M, E) {
      ki(t, l, r, f, c), (v || b || E) && (d.save(), v && d.clip(v), b && d.clip(b)), E ? (_ & Ai) == Ai ? (d.clip(E), M && d.clip(M), Zl(c, S), Jl(t, p, l)) : _ & ei ? (Zl(c, S), d.clip(E), Jl(t, p, l)) : _ & Ml && (d.save(), d.clip(E), M && d.clip(M), Zl(c, S), d.restore(), Jl(t, p, l)) : (Zl(c, S), Jl(t, p, l)), (v || b || E) && d.restore();
    }
    function Jl(t, l, r) {
      r > 0 && (l instanceof Map ? l.forEach((f, c) => {
        d.strokeStyle = $l = c, d.stroke(f);
      }) : l != null && t && d.stroke(l));
    }
    function Zl(t, l) {
      l instanceof Map ? l.forEach((r, f) => {
        d.fillStyle = cl = f, d.fill(r);
      }) : l != null && t && d.fill(l);
    }
    function Cs(t, l, r, f) {
      let c = H[t], p;
      if (f <= 0) p = [0, 0];
      else {
        let S = c._space = c.space(n, t, l, r, f), _ = c._incrs = c.incrs(n, t, l, r, f, S);
        p = Yf(l, r, _, f, S);
      }
      return c._found = p;
    }
    function Pn(t, l, r, f, c, p, S, _, v, b) {
      let M = S % 2 / 2;
      O == 1 && d.translate(M, M), ki(_, S, v, b, _), d.beginPath();
      let E, Y, ie, le, Z = c + (f == 0 || f == 3 ? -p : p);
      r == 0 ? (Y = c, le = Z) : (E = c, ie = Z);
      for (let W = 0; W < t.length; W++) l[W] != null && (r == 0 ? E = ie = t[W] : Y = le = t[W], d.moveTo(E, Y), d.lineTo(ie, le));
      d.stroke(), O == 1 && d.translate(-M, -M);
    }
    function Vs(t) {
      let l = true;
      return H.forEach((r, f) => {
        if (!r.show) return;
        let c = x[r.scale];
        if (c.min == null) {
          r._show && (l = false, r._show = false, al(false));
          return;
        } else r._show || (l = false, r._show = true, al(false));
        let p = r.side, S = p % 2, { min: _, max: v } = c, [b, M] = Cs(f, _, v, S == 0 ? K : A);
        if (M == 0) return;
        let E = c.distr == 2, Y = r._splits = r.splits(n, f, _, v, b, M, E), ie = c.distr == 2 ? Y.map((R) => pt[R]) : Y, le = c.distr == 2 ? pt[Y[1]] - pt[Y[0]] : b, Z = r._values = r.values(n, r.filter(n, ie, f, M, le), f, M, le);
        r._rotate = p == 2 ? r.rotate(n, Z, f, M) : 0;
        let W = r._size;
        r._size = ut(r.size(n, Z, f, t)), W != null && r._size != W && (l = false);
      }), l;
    }
    function Rs(t) {
      let l = true;
      return yi.forEach((r, f) => {
        let c = r(n, f, Ut, t);
        c != Ct[f] && (l = false), Ct[f] = c;
      }), l;
    }
    function zs() {
      for (let t = 0; t < H.length; t++) {
        let l = H[t];
        if (!l.show || !l._show) continue;
        let r = l.side, f = r % 2, c, p, S = l.stroke(n, t), _ = r == 0 || r == 3 ? -1 : 1, [v, b] = l._found;
        if (l.label != null) {
          let Ge = l.labelGap * _, Qe = Ae((l._lpos + Ge) * oe);
          xi(l.labelFont[0], S, "center", r == 2 ? "top" : qi), d.save(), f == 1 ? (c = p = 0, d.translate(Qe, Ae(nt + at / 2)), d.rotate((r == 3 ? -on : on) / 2)) : (c = Ae($e + Ke / 2), p = Qe);
          let qt = Ho(l.label) ? l.label(n, t, v, b) : l.label;
          d.fillText(qt, c, p), d.restore();
        }
        if (b == 0) continue;
        let M = x[l.scale], E = f == 0 ? Ke : at, Y = f == 0 ? $e : nt, ie = l._splits, le = M.distr == 2 ? ie.map((Ge) => pt[Ge]) : ie, Z = M.distr == 2 ? pt[ie[1]] - pt[ie[0]] : v, W = l.ticks, R = l.border, ge = W.show ? W.size : 0, ve = Ae(ge * oe), Re = Ae((l.alignTo == 2 ? l._size - ge - l.gap : l.gap) * oe), ue = l._rotate * -on / 180, ke = N(l._pos * oe), Je = (ve + Re) * _, We = ke + Je;
        p = f == 0 ? We : 0, c = f == 1 ? We : 0;
        let st = l.font[0], ht = l.align == 1 ? yl : l.align == 2 ? Wn : ue > 0 ? yl : ue < 0 ? Wn : f == 0 ? "center" : r == 3 ? Wn : yl, xt = ue || f == 1 ? "middle" : r == 2 ? "top" : qi;
        xi(st, S, ht, xt);
        let Ze = l.font[1] * l.lineGap, rt = ie.map((Ge) => N(h(Ge, M, E, Y))), mt = l._values;
        for (let Ge = 0; Ge < mt.length; Ge++) {
          let Qe = mt[Ge];
          if (Qe != null) {
            f == 0 ? c = rt[Ge] : p = rt[Ge], Qe = "" + Qe;
            let qt = Qe.indexOf(`
`) == -1 ? [Qe] : Qe.split(/\n/gm);
            for (let Ie = 0; Ie < qt.length; Ie++) {
              let Ki = qt[Ie];
              ue ? (d.save(), d.translate(c, p + Ie * Ze), d.rotate(ue), d.fillText(Ki, 0, 0), d.restore()) : d.fillText(Ki, c, p + Ie * Ze);
            }
          }
        }
        W.show && Pn(rt, W.filter(n, le, t, b, Z), f, r, ke, ve, ae(W.width * oe, 3), W.stroke(n, t), W.dash, W.cap);
        let Tt = l.grid;
        Tt.show && Pn(rt, Tt.filter(n, le, t, b, Z), f, f == 0 ? 2 : 1, f == 0 ? nt : $e, f == 0 ? at : Ke, ae(Tt.width * oe, 3), Tt.stroke(n, t), Tt.dash, Tt.cap), R.show && Pn([ke], [1], f == 0 ? 1 : 0, f == 0 ? 1 : 2, f == 1 ? nt : $e, f == 1 ? at : Ke, ae(R.width * oe, 3), R.stroke(n, t), R.dash, R.cap);
      }
      Ve("drawAxes");
    }
    function al(t) {
      k.forEach((l, r) => {
        r > 0 && (l._paths = null, t && (s == 1 ? (l.min = null, l.max = null) : l.facets.forEach((f) => {
          f.min = null, f.max = null;
        })));
      });
    }
    let Ql = false, Dn = false, Vl = [];
    function Fs() {
      Dn = false;
      for (let t = 0; t < Vl.length; t++) Ve(...Vl[t]);
      Vl.length = 0;
    }
    function pl() {
      Ql || (zr(Ei), Ql = true);
    }
    function Os(t, l = false) {
      Ql = true, Dn = l, t(n), Ei(), l && Vl.length > 0 && queueMicrotask(Fs);
    }
    n.batch = Os;
    function Ei() {
      if (wn && (Es(), wn = false), ol && (vs(), ol = false), Kl) {
        if (de(L, yl, pe), de(L, "top", Me), de(L, Nl, K), de(L, Wl, A), de(D, yl, pe), de(D, "top", Me), de(D, Nl, K), de(D, Wl, A), de(w, Nl, At), de(w, Wl, Wt), y.width = Ae(At * oe), y.height = Ae(Wt * oe), H.forEach(({ _el: t, _show: l, _size: r, _pos: f, side: c }) => {
          if (t != null) if (l) {
            let p = c === 3 || c === 0 ? r : 0, S = c % 2 == 1;
            de(t, S ? "left" : "top", f - p), de(t, S ? "width" : "height", r), de(t, S ? "top" : "left", S ? Me : pe), de(t, S ? "height" : "width", S ? A : K), $n(t, Zt);
          } else Xe(t, Zt);
        }), $l = cl = yn = kn = xn = Tn = bn = Mn = vn = null, je = 1, Fl(true), pe != il || Me != Gt || K != _t || A != It) {
          al(false);
          let t = K / _t, l = A / It;
          if (He && !Yt && V.left >= 0) {
            V.left *= t, V.top *= l, hl && bt(hl, Ae(V.left), 0, K, A), ml && bt(ml, 0, Ae(V.top), K, A);
            for (let r = 0; r < ot.length; r++) {
              let f = ot[r];
              f != null && (fl[r] *= t, ul[r] *= l, bt(f, ut(fl[r]), ut(ul[r]), K, A));
            }
          }
          if (me.show && !jl && me.left >= 0 && me.width > 0) {
            me.left *= t, me.width *= t, me.top *= l, me.height *= l;
            for (let r in Fn) de(wl, r, me[r]);
          }
          il = pe, Gt = Me, _t = K, It = A;
        }
        Ve("setSize"), Kl = false;
      }
      At > 0 && Wt > 0 && (d.clearRect(0, 0, y.width, y.height), Ve("drawClear"), U.forEach((t) => t()), Ve("draw")), me.show && jl && (Xl(me), jl = false), He && Yt && (jt(null, true, false), Yt = false), J.show && J.live && it && (Rn(), it = false), m || (m = true, n.status = 1, Ve("ready")), Cl = false, Ql = false;
    }
    n.redraw = (t, l) => {
      ol = l || false, t !== false ? Rt(P, T.min, T.max) : pl();
    };
    function Ln(t, l) {
      let r = x[t];
      if (r.from == null) {
        if (ze == 0) {
          let f = r.range(n, l.min, l.max, t);
          l.min = f[0], l.max = f[1];
        }
        if (l.min > l.max) {
          let f = l.min;
          l.min = l.max, l.max = f;
        }
        if (ze > 1 && l.min != null && l.max != null && l.max - l.min < 1e-16) return;
        t == P && r.distr == 2 && ze > 0 && (l.min = dt(l.min, i[0]), l.max = dt(l.max, i[0]), l.min == l.max && l.max++), F[t] = l, wn = true, pl();
      }
    }
    n.setScale = Ln;
    let Cn, Vn, hl, ml, Pi, Di, gl, dl, Li, Ci, he, _e, Vt = false, Fe = V.drag, Le = Fe.x, Ce = Fe.y;
    He && (V.x && (Cn = ft(or, D)), V.y && (Vn = ft(sr, D)), T.ori == 0 ? (hl = Cn, ml = Vn) : (hl = Vn, ml = Cn), he = V.left, _e = V.top);
    let me = n.select = Te({ show: true, over: true, left: 0, width: 0, top: 0, height: 0 }, e.select), wl = me.show ? ft(ir, me.over ? D : L) : null;
    function Xl(t, l) {
      if (me.show) {
        for (let r in t) me[r] = t[r], r in Fn && de(wl, r, t[r]);
        l !== false && Ve("setSelect");
      }
    }
    n.setSelect = Xl;
    function Hs(t) {
      if (k[t].show) be && $n(ye[t], Zt);
      else if (be && Xe(ye[t], Zt), He) {
        let r = rl ? ot[0] : ot[t];
        r != null && bt(r, -10, -10, K, A);
      }
    }
    function Rt(t, l, r) {
      Ln(t, { min: l, max: r });
    }
    function vt(t, l, r, f) {
      l.focus != null && Ys(t), l.show != null && k.forEach((c, p) => {
        p > 0 && (t == p || t == null) && (c.show = l.show, Hs(p), s == 2 ? (Rt(c.facets[0].scale, null, null), Rt(c.facets[1].scale, null, null)) : Rt(c.scale, null, null), pl());
      }), r !== false && Ve("setSeries", t, l), f && Ol("setSeries", n, t, l);
    }
    n.setSeries = vt;
    function Ns(t, l) {
      Te(q[t], l);
    }
    function Ws(t, l) {
      t.fill = X(t.fill || null), t.dir = ne(t.dir, -1), l = l ?? q.length, q.splice(l, 0, t);
    }
    function Gs(t) {
      t == null ? q.length = 0 : q.splice(t, 1);
    }
    n.addBand = Ws, n.setBand = Ns, n.delBand = Gs;
    function Is(t, l) {
      k[t].alpha = l, He && ot[t] != null && (ot[t].style.opacity = l), be && ye[t] && (ye[t].style.opacity = l);
    }
    let Et, zt, Kt, Sl = { focus: true };
    function Ys(t) {
      if (t != Kt) {
        let l = t == null, r = yt.alpha != 1;
        k.forEach((f, c) => {
          if (s == 1 || c > 0) {
            let p = l || c == 0 || c == t;
            f._focus = l ? null : p, r && Is(c, p ? 1 : yt.alpha);
          }
        }), Kt = t, r && pl();
      }
    }
    be && sl && Ne(Qi, se, (t) => {
      V._lock || (Bt(t), Kt != null && vt(null, Sl, true, xe.setSeries));
    });
    function kt(t, l, r) {
      let f = x[l];
      r && (t = t / oe - (f.ori == 1 ? Me : pe));
      let c = K;
      f.ori == 1 && (c = A, t = c - t), f.dir == -1 && (t = c - t);
      let p = f._min, S = f._max, _ = t / c, v = p + (S - p) * _, b = f.distr;
      return b == 3 ? xl(10, v) : b == 4 ? xr(v, f.asinh) : b == 100 ? f.bwd(v) : v;
    }
    function Bs(t, l) {
      let r = kt(t, P, l);
      return dt(r, i[0], Pe, De);
    }
    n.valToIdx = (t) => dt(t, i[0]), n.posToIdx = Bs, n.posToVal = kt, n.valToPos = (t, l, r) => x[l].ori == 0 ? a(t, x[l], r ? Ke : K, r ? $e : 0) : u(t, x[l], r ? at : A, r ? nt : 0), n.setCursor = (t, l, r) => {
      he = t.left, _e = t.top, jt(null, l, r);
    };
    function Vi(t, l) {
      de(wl, yl, me.left = t), de(wl, Nl, me.width = l);
    }
    function Ri(t, l) {
      de(wl, "top", me.top = t), de(wl, Wl, me.height = l);
    }
    let Rl = T.ori == 0 ? Vi : Ri, zl = T.ori == 1 ? Vi : Ri;
    function Us() {
      if (be && J.live) for (let t = s == 2 ? 1 : 0; t < k.length; t++) {
        if (t == 0 && lt) continue;
        let l = J.values[t], r = 0;
        for (let f in l) St[t][r++].firstChild.nodeValue = l[f];
      }
    }
    function Rn(t, l) {
      if (t != null && (t.idxs ? t.idxs.forEach((r, f) => {
        fe[f] = r;
      }) : Ar(t.idx) || fe.fill(t.idx), J.idx = fe[0]), be && J.live) {
        for (let r = 0; r < k.length; r++) (r > 0 || s == 1 && !lt) && Ks(r, fe[r]);
        Us();
      }
      it = false, l !== false && Ve("setLegend");
    }
    n.setLegend = Rn;
    function Ks(t, l) {
      let r = k[t], f = t == 0 && j == 2 ? pt : i[t], c;
      lt ? c = r.values(n, t, l) ?? Lt : (c = r.value(n, l == null ? null : f[l], t, l), c = c == null ? Lt : { _: c }), J.values[t] = c;
    }
    function jt(t, l, r) {
      Li = he, Ci = _e, [he, _e] = V.move(n, he, _e), V.left = he, V.top = _e, He && (hl && bt(hl, Ae(he), 0, K, A), ml && bt(ml, 0, Ae(_e), K, A));
      let f, c = Pe > De;
      Et = ce, zt = null;
      let p = T.ori == 0 ? K : A, S = T.ori == 1 ? K : A;
      if (he < 0 || ze == 0 || c) {
        f = V.idx = null;
        for (let _ = 0; _ < k.length; _++) {
          let v = ot[_];
          v != null && bt(v, -10, -10, K, A);
        }
        sl && vt(null, Sl, true, t == null && xe.setSeries), J.live && (fe.fill(f), it = true);
      } else {
        let _, v, b;
        s == 1 && (_ = T.ori == 0 ? he : _e, v = kt(_, P), f = V.idx = dt(v, i[0], Pe, De), b = C(i[0][f], T, p, 0));
        let M = -10, E = -10, Y = 0, ie = 0, le = true, Z = "", W = "";
        for (let R = s == 2 ? 1 : 0; R < k.length; R++) {
          let ge = k[R], ve = fe[R], Re = ve == null ? null : s == 1 ? i[R][ve] : i[R][1][ve], ue = V.dataIdx(n, R, f, v), ke = ue == null ? null : s == 1 ? i[R][ue] : i[R][1][ue];
          if (it = it || ke != Re || ue != ve, fe[R] = ue, R > 0 && ge.show) {
            let Je = ue == null ? -10 : ue == f ? b : C(s == 1 ? i[0][ue] : i[R][0][ue], T, p, 0), We = ke == null ? -10 : I(ke, s == 1 ? x[ge.scale] : x[ge.facets[1].scale], S, 0);
            if (sl && ke != null) {
              let st = T.ori == 1 ? he : _e, ht = Ee(yt.dist(n, R, ue, We, st));
              if (ht < Et) {
                let xt = yt.bias;
                if (xt != 0) {
                  let Ze = kt(st, ge.scale), rt = ke >= 0 ? 1 : -1, mt = Ze >= 0 ? 1 : -1;
                  mt == rt && (mt == 1 ? xt == 1 ? ke >= Ze : ke <= Ze : xt == 1 ? ke <= Ze : ke >= Ze) && (Et = ht, zt = R);
                } else Et = ht, zt = R;
              }
            }
            if (it || rl) {
              let st, ht;
              T.ori == 0 ? (st = Je, ht = We) : (st = We, ht = Je);
              let xt, Ze, rt, mt, Tt, Ge, Qe = true, qt = Oe.bbox;
              if (qt != null) {
                Qe = false;
                let Ie = qt(n, R);
                rt = Ie.left, mt = Ie.top, xt = Ie.width, Ze = Ie.height;
              } else rt = st, mt = ht, xt = Ze = Oe.size(n, R);
              if (Ge = Oe.fill(n, R), Tt = Oe.stroke(n, R), rl) R == zt && Et <= yt.prox && (M = rt, E = mt, Y = xt, ie = Ze, le = Qe, Z = Ge, W = Tt);
              else {
                let Ie = ot[R];
                Ie != null && (fl[R] = rt, ul[R] = mt, oo(Ie, xt, Ze, Qe), no(Ie, Ge, Tt), bt(Ie, ut(rt), ut(mt), K, A));
              }
            }
          }
        }
        if (rl) {
          let R = yt.prox, ge = Kt == null ? Et <= R : Et > R || zt != Kt;
          if (it || ge) {
            let ve = ot[0];
            ve != null && (fl[0] = M, ul[0] = E, oo(ve, Y, ie, le), no(ve, Z, W), bt(ve, ut(M), ut(E), K, A));
          }
        }
      }
      if (me.show && Vt) if (t != null) {
        let [_, v] = xe.scales, [b, M] = xe.match, [E, Y] = t.cursor.sync.scales, ie = t.cursor.drag;
        if (Le = ie._x, Ce = ie._y, Le || Ce) {
          let { left: le, top: Z, width: W, height: R } = t.select, ge = t.scales[E].ori, ve = t.posToVal, Re, ue, ke, Je, We, st = _ != null && b(_, E), ht = v != null && M(v, Y);
          st && Le ? (ge == 0 ? (Re = le, ue = W) : (Re = Z, ue = R), ke = x[_], Je = C(ve(Re, E), ke, p, 0), We = C(ve(Re + ue, E), ke, p, 0), Rl(wt(Je, We), Ee(We - Je))) : Rl(0, p), ht && Ce ? (ge == 1 ? (Re = le, ue = W) : (Re = Z, ue = R), ke = x[v], Je = I(ve(Re, Y), ke, S, 0), We = I(ve(Re + ue, Y), ke, S, 0), zl(wt(Je, We), Ee(We - Je))) : zl(0, S);
        } else On();
      } else {
        let _ = Ee(Li - Pi), v = Ee(Ci - Di);
        if (T.ori == 1) {
          let Y = _;
          _ = v, v = Y;
        }
        Le = Fe.x && _ >= Fe.dist, Ce = Fe.y && v >= Fe.dist;
        let b = Fe.uni;
        b != null ? Le && Ce && (Le = _ >= b, Ce = v >= b, !Le && !Ce && (v > _ ? Ce = true : Le = true)) : Fe.x && Fe.y && (Le || Ce) && (Le = Ce = true);
        let M, E;
        Le && (T.ori == 0 ? (M = gl, E = he) : (M = dl, E = _e), Rl(wt(M, E), Ee(E - M)), Ce || zl(0, S)), Ce && (T.ori == 1 ? (M = gl, E = he) : (M = dl, E = _e), zl(wt(M, E), Ee(E - M)), Le || Rl(0, p)), !Le && !Ce && (Rl(0, 0), zl(0, 0));
      }
      if (Fe._x = Le, Fe._y = Ce, t == null) {
        if (r) {
          if (Ui != null) {
            let [_, v] = xe.scales;
            xe.values[0] = _ != null ? kt(T.ori == 0 ? he : _e, _) : null, xe.values[1] = v != null ? kt(T.ori == 1 ? he : _e, v) : null;
          }
          Ol(Gn, n, he, _e, K, A, f);
        }
        if (sl) {
          let _ = r && xe.setSeries, v = yt.prox;
          Kt == null ? Et <= v && vt(zt, Sl, true, _) : Et > v ? vt(null, Sl, true, _) : zt != Kt && vt(zt, Sl, true, _);
        }
      }
      it && (J.idx = f, Rn()), l !== false && Ve("setCursor");
    }
    let Ft = null;
    Object.defineProperty(n, "rect", { get() {
      return Ft == null && Fl(false), Ft;
    } });
    function Fl(t = false) {
      t ? Ft = null : (Ft = D.getBoundingClientRect(), Ve("syncRect", Ft));
    }
    function zi(t, l, r, f, c, p, S) {
      V._lock || Vt && t != null && t.movementX == 0 && t.movementY == 0 || (zn(t, l, r, f, c, p, S, false, t != null), t != null ? jt(null, true, true) : jt(l, true, false));
    }
    function zn(t, l, r, f, c, p, S, _, v) {
      if (Ft == null && Fl(false), Bt(t), t != null) r = t.clientX - Ft.left, f = t.clientY - Ft.top;
      else {
        if (r < 0 || f < 0) {
          he = -10, _e = -10;
          return;
        }
        let [b, M] = xe.scales, E = l.cursor.sync, [Y, ie] = E.values, [le, Z] = E.scales, [W, R] = xe.match, ge = l.axes[0].side % 2 == 1, ve = T.ori == 0 ? K : A, Re = T.ori == 1 ? K : A, ue = ge ? p : c, ke = ge ? c : p, Je = ge ? f : r, We = ge ? r : f;
        if (le != null ? r = W(b, le) ? h(Y, x[b], ve, 0) : -10 : r = ve * (Je / ue), Z != null ? f = R(M, Z) ? h(ie, x[M], Re, 0) : -10 : f = Re * (We / ke), T.ori == 1) {
          let st = r;
          r = f, f = st;
        }
      }
      v && (l == null || l.cursor.event.type == Gn) && ((r <= 1 || r >= K - 1) && (r = $t(r, K)), (f <= 1 || f >= A - 1) && (f = $t(f, A))), _ ? (Pi = r, Di = f, [gl, dl] = V.move(n, r, f)) : (he = r, _e = f);
    }
    let Fn = { width: 0, height: 0, left: 0, top: 0 };
    function On() {
      Xl(Fn, false);
    }
    let Fi, Oi, Hi, Ni;
    function Wi(t, l, r, f, c, p, S) {
      Vt = true, Le = Ce = Fe._x = Fe._y = false, zn(t, l, r, f, c, p, S, true, false), t != null && (Ne(In, jn, Gi, false), Ol(Ji, n, gl, dl, K, A, null));
      let { left: _, top: v, width: b, height: M } = me;
      Fi = _, Oi = v, Hi = b, Ni = M;
    }
    function Gi(t, l, r, f, c, p, S) {
      Vt = Fe._x = Fe._y = false, zn(t, l, r, f, c, p, S, false, true);
      let { left: _, top: v, width: b, height: M } = me, E = b > 0 || M > 0, Y = Fi != _ || Oi != v || Hi != b || Ni != M;
      if (E && Y && Xl(me), Fe.setScale && E && Y) {
        let ie = _, le = b, Z = v, W = M;
        if (T.ori == 1 && (ie = v, le = M, Z = _, W = b), Le && Rt(P, kt(ie, P), kt(ie + le, P)), Ce) for (let R in x) {
          let ge = x[R];
          R != P && ge.from == null && ge.min != ce && Rt(R, kt(Z + W, R), kt(Z, R));
        }
        On();
      } else V.lock && (V._lock = !V._lock, jt(l, true, t != null));
      t != null && (nl(In, jn), Ol(In, n, he, _e, K, A, null));
    }
    function js(t, l, r, f, c, p, S) {
      if (V._lock) return;
      Bt(t);
      let _ = Vt;
      if (Vt) {
        let v = true, b = true, M = 10, E, Y;
        T.ori == 0 ? (E = Le, Y = Ce) : (E = Ce, Y = Le), E && Y && (v = he <= M || he >= K - M, b = _e <= M || _e >= A - M), E && v && (he = he < gl ? 0 : K), Y && b && (_e = _e < dl ? 0 : A), jt(null, true, true), Vt = false;
      }
      he = -10, _e = -10, fe.fill(null), jt(null, true, true), _ && (Vt = _);
    }
    function Ii(t, l, r, f, c, p, S) {
      V._lock || (Bt(t), _n(), On(), t != null && Ol(Xi, n, he, _e, K, A, null));
    }
    function Yi() {
      H.forEach(Bf), Sn(n.width, n.height, true);
    }
    Qt(sn, kl, Yi);
    let _l = {};
    _l.mousedown = Wi, _l.mousemove = zi, _l.mouseup = Gi, _l.dblclick = Ii, _l.setSeries = (t, l, r, f) => {
      let c = xe.match[2];
      r = c(n, l, r), r != -1 && vt(r, f, true, false);
    }, He && (Ne(Ji, D, Wi), Ne(Gn, D, zi), Ne(Zi, D, (t) => {
      Bt(t), Fl(false);
    }), Ne(Qi, D, js), Ne(Xi, D, Ii), ti.add(n), n.syncRect = Fl);
    let en = n.hooks = e.hooks || {};
    function Ve(t, l, r) {
      Dn ? Vl.push([t, l, r]) : t in en && en[t].forEach((f) => {
        f.call(null, n, l, r);
      });
    }
    (e.plugins || []).forEach((t) => {
      for (let l in t.hooks) en[l] = (en[l] || []).concat(t.hooks[l]);
    });
    let Bi = (t, l, r) => r, xe = Te({ key: null, setSeries: false, filters: { pub: co, sub: co }, scales: [P, k[1] ? k[1].scale : null], match: [ao, ao, Bi], values: [null, null] }, V.sync);
    xe.match.length == 2 && xe.match.push(Bi), V.sync = xe;
    let Ui = xe.key, Hn = fs(Ui);
    function Ol(t, l, r, f, c, p, S) {
      xe.filters.pub(t, l, r, f, c, p, S) && Hn.pub(t, l, r, f, c, p, S);
    }
    Hn.sub(n);
    function qs(t, l, r, f, c, p, S) {
      xe.filters.sub(t, l, r, f, c, p, S) && _l[t](null, l, r, f, c, p, S);
    }
    n.pub = qs;
    function $s() {
      Hn.unsub(n), ti.delete(n), Nt.clear(), Jn(sn, kl, Yi), g.remove(), se?.remove(), Ve("destroy");
    }
    n.destroy = $s;
    function Nn() {
      Ve("init", e, i), vi(i || e.data, false), F[P] ? Ln(P, F[P]) : _n(), jl = me.show && (me.width > 0 || me.height > 0), Yt = it = true, Sn(e.width, e.height);
    }
    return k.forEach(_i), H.forEach(As), o ? o instanceof HTMLElement ? (o.appendChild(g), Nn()) : o(n, Nn) : Nn(), n;
  }
  Be.assign = Te;
  Be.fmtNum = fi;
  Be.rangeNum = rn;
  Be.rangeLog = cn;
  Be.rangeAsinh = si;
  Be.orient = el;
  Be.pxRatio = oe;
  Be.join = Rr;
  Be.fmtDate = ci, Be.tzDate = Ur;
  Be.sync = fs;
  {
    Be.addGap = Ef, Be.clipGaps = hn;
    let e = Be.paths = { points: ms };
    e.linear = ds, e.stepped = Lf, e.bars = Cf, e.spline = Rf;
  }

  // src/chart.js
  var MOST_CHIPS = 14;
  var FONT = "12px system-ui, sans-serif";
  var LABEL = 13;
  var UNIT = 18;
  var LATE = 0.7;
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
      setSeries: [(_, k, how) => plot.focusedByMouse(
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
        values: (_, ticks) => ticks.map((v) => `${number(v, 6)} s`)
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
        ...!log && { values: (_, ticks) => ticks.map((v) => number(v, 6)) }
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
    return [Number((low / 1.5).toPrecision(2)), high * 1.5];
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
    drawBounds(u, plot);
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
  var saysApproach = ({ name, systems }) => name === "constraint" && systems.length === 1;
  var isLate = ({ spec, plots: { source, window: [from, to2] } }) => spec.systems.flatMap((system) => [
    source.exits[system.name],
    saysApproach(spec) ? source.stateOf(system).margin_time : NaN
  ]).some((time) => typeof time === "number" && time > from + LATE * (to2 - from) && time <= to2);
  var drawApproach = (u, { spec, plots }, system) => {
    if (plots.hiddenRuns.has(system.run)) return;
    const { margin_time: time } = plots.source.stateOf(system);
    if (typeof time !== "number") return;
    const { ctx: context, bbox } = u;
    const ratio = Be.pxRatio;
    const x = u.valToPos(time, "x", true);
    if (x < bbox.left || x > bbox.left + bbox.width) return;
    context.fillStyle = colour("limit");
    context.beginPath();
    context.moveTo(x, bbox.top + 8 * ratio);
    context.lineTo(x - 5 * ratio, bbox.top);
    context.lineTo(x + 5 * ratio, bbox.top);
    context.fill();
    if (!saysApproach(spec)) return;
    context.font = `${12 * ratio}px system-ui, sans-serif`;
    context.textBaseline = "top";
    const leftward = x > bbox.left + LATE * bbox.width;
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
  var drawBounds = (u, plot) => {
    const { ctx: context, bbox } = u;
    const { bounds, unit } = plot.spec;
    const ratio = Be.pxRatio;
    asBounds(context, ratio);
    const late = isLate(plot);
    if (late) context.textAlign = "left";
    const x = bbox.left + (late ? 4 * ratio : bbox.width - 4 * ratio);
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
      context.fillText(text2, x, y - 2 * ratio);
    }
  };
  var drawMovingBounds = (u, bounds) => {
    const { ctx: context, bbox } = u;
    const ratio = Be.pxRatio;
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
      this.values = shown2 > MOST_CHIPS ? [] : spec.groups.map((_, group) => this.add(group));
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
      const value = element("span", { class: "chip-value" });
      const what = `${spec.noun} ${spec.lines[k].label}`.trim();
      const chip = element(
        "button",
        {
          type: "button",
          class: "plot-chip",
          title: `${what}: click switches the line, a double click shows it alone`,
          onmouseenter: () => plot.point(k),
          onmouseleave: () => plot.point(null),
          onclick: () => this.change(() => lines.toggle(group)),
          ondblclick: () => this.change(() => lines.showOnly(group))
        },
        element("span", { class: "unseen", text: `line of ${what}: ` }),
        swatchOf(lines.lookOf(k)),
        element("span", { "aria-hidden": true, text: spec.total === 1 ? "" : spec.shorts[k] }),
        value,
        element("span", { class: "unseen", text: ` ${spec.unit}` })
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
  var STEP2 = 0.7;
  var SLOP = 4;
  var scaled = ([from, to2], around, factor) => [
    around - (around - from) * factor,
    around + (to2 - around) * factor
  ];
  var within = ([from, to2], whole) => {
    const width = Math.max(to2 - from, NARROWEST * whole);
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
      const factor = event.deltaY > 0 ? 1 / STEP2 : STEP2;
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
        "+": () => this.plot.plots.zoom(STEP2, u.data[0][now]),
        "=": () => this.plot.plots.zoom(STEP2, u.data[0][now]),
        "-": () => this.plot.plots.zoom(1 / STEP2, u.data[0][now]),
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
      (each) => each.slice(common).replace(/\bagents? /g, "").replace(/ and /g, "–").replace(/ to /g, "→").replace(/_(\d)\b/g, (_, digit) => "₀₁₂₃₄₅₆₇₈₉"[digit])
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
  var noteOf = (whose, of2) => {
    const note = `: ${whose.join(", ")}`;
    return whose.length < of2 && note.length < 20 ? note : "";
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
      this.seen = true;
    }
    /**
     * @param {uPlot} u
     * @param {number} time
     */
    place(u, time) {
      const x = Math.round(u.valToPos(time, "x"));
      const seen = x >= 0 && x <= u.bbox.width / Be.pxRatio;
      if (this.x === x && this.seen === seen) return;
      this.x = x;
      this.seen = seen;
      this.root.style.transform = `translateX(${x}px)`;
      this.root.style.visibility = seen ? "visible" : "hidden";
    }
  };
  var exitLine = (whose) => element(
    "div",
    { class: "exit-line", hidden: true },
    element("span", { text: whose ? `left the set: ${whose}` : "left the set" })
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
      if (!this.uplot) return this.make(width, height);
      this.uplot.setSize({ width, height });
      this.uplot.setData(this.uplot.data, true);
    }
    /**
     * @param {number} width
     * @param {number} height
     */
    make(width, height) {
      this.uplot?.destroy();
      this.uplot = new Be(optionsOf(this, width, height), this.data(), this.chart);
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
      const sign = this.turned ? -1 : 1;
      const drawn = this.columns().map(
        (column) => column.map((value) => value !== null && sign * value > 0 ? sign * value : null)
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
    panValues(from, to2) {
      this.moveValues((edge) => edge + from - to2);
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
        const [from, to2] = this.plots.window;
        root.classList.toggle("leftward", exit > from + 0.7 * (to2 - from));
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
    const of2 = wholes.filter((whole) => whole.lines.some(often));
    return {
      whole: {
        ...of2[0],
        systems: of2.flatMap((whole) => whole.systems),
        whose,
        lines: common,
        bounds: boundsOf2(of2, runs)
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
      this.seen = true;
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
        this.tool("−", "More time (−)", () => this.zoom(1 / STEP2)),
        this.tool("+", "Less time (+)", () => this.zoom(STEP2)),
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
      const [from, to2] = this.window;
      const middle = around < from || around > to2 ? (from + to2) / 2 : around;
      this.show(scaled([from, to2], middle, factor));
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
      const [from, to2] = this.window;
      this.shown.textContent = this.stretch ? `${number(from, 4)} to ${number(to2, 4)} s` : "";
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
    /**
     * Out of sight no plot follows its window's size: a notebook may have many.
     * @param {boolean} seen
     */
    setSeen(seen) {
      this.seen = seen;
      if (seen) this.resize();
    }
    resize() {
      if (!this.meta || !this.seen || !this.column.clientWidth) return;
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
  var WIDTH = 0.4;
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
      this.bars = system.action.owner.map((_, k) => this.addBar(k));
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
      bar.scale.set(WIDTH, WIDTH, 1);
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
      const { alike, faint, off } = this.system.shown;
      this.reference = Math.max(...alike.map((name) => store.greatest(`${name}/action`))) || 1;
      this.fade(faint);
      this.group.visible = !off;
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
      return this.point(x, y - WIDTH / 2, 0);
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
      const point = this.point(x - WIDTH / 2, y, TALL);
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
  var sums = /* @__PURE__ */ new WeakMap();
  var checksum = (geometry) => {
    if (sums.has(geometry)) return sums.get(geometry);
    const values = geometry.attributes.position?.array || [];
    let sum = 0;
    for (let i = 0; i < values.length; i++) sum += values[i] * (i % 7 + 1);
    const found = `${values.length} ${geometry.index?.count ?? 0} ${sum}`;
    sums.set(geometry, found);
    return found;
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
    const share = sharing();
    viewer.set_object = (path, object) => {
      object.traverse?.(share);
      set(path, object);
      changed();
    };
    const resize = viewer.set_3d_pane_size.bind(viewer);
    viewer.set_3d_pane_size = () => {
      const { clientWidth: w, clientHeight: h } = pane;
      if (w && h) resize(w, h);
    };
    viewer.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    viewer.gui.domElement.style.display = "none";
    viewer.scene_tree.folder = folder();
    for (const name of ["Grid", "Axes", "Lights"]) viewer.set_property([name], "visible", false);
    viewer.hide_background();
    return viewer;
  };
  var sharing = () => {
    const known = /* @__PURE__ */ new Map();
    const waiting = /* @__PURE__ */ new Map();
    return (mesh2) => {
      const { geometry } = mesh2;
      if (geometry?.type !== "BufferGeometry") return;
      const { uuid } = geometry;
      if (geometry.attributes.position) {
        known.set(uuid, geometry);
        for (const each of waiting.get(uuid) ?? []) each.geometry = geometry;
        waiting.delete(uuid);
      } else if (known.has(uuid)) mesh2.geometry = known.get(uuid);
      else waiting.set(uuid, [...waiting.get(uuid) ?? [], mesh2]);
    };
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
  var AROUND2 = 3;
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
        minDistance: 0.2,
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
     * Distance from the target at which all is in view from a direction.
     * @param {Three} direction
     * @param {Three} target
     * @param {Room[]} rooms what all is
     */
    fitDistance(direction, target, rooms = this.layout.seen()) {
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
      let distance = this.controls.minDistance;
      for (const { point, radius, half } of rooms) {
        const p = point.clone().sub(target);
        const out = (axis) => radius * Math.hypot(axis.x, axis.z) + half * Math.abs(axis.y);
        const nearer = p.dot(back) + out(back);
        distance = Math.max(
          distance,
          (Math.abs(p.dot(right)) + out(right)) / (0.88 * wide) + nearer,
          (Math.abs(p.dot(up)) + out(up)) / (0.76 * tangent) + nearer
        );
      }
      return distance;
    }
    /**
     * From the side, and for a long lane nearly along it, so that the near ones stay large; fleets
     * that are wider than they are long from behind.
     */
    defaultDirection() {
      const { box, bars, planar } = this.layout;
      const [length, width] = box ? [0, 1].map((axis) => box.high[axis] - box.low[axis]) : [0, 0];
      const long = Math.min(Math.max((length - 40) / 60, 0), 1);
      const azimuth = (width > length && planar ? -174 : -84 + 75 * long) * DEGREE;
      const rows = bars.reduce((sum, each) => sum + each.rows, 0);
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
      this.look(target, direction, this.distanceFrom(direction, target));
      this.zoom = 1;
      this.followPoint = target;
      this.placed = true;
    }
    /**
     * From how far what is followed is looked at first.
     * @param {Three} direction
     * @param {Three} target
     */
    distanceFrom(direction, target) {
      const { kind, system, agent = 0 } = this.follow;
      const fleet = this.layout.fleets.find((each) => each.name === system);
      if (kind !== "agent" || !fleet) return this.fitDistance(direction, target);
      return AROUND2 * this.fitDistance(direction, target, [this.layout.roomOf(fleet, agent)]);
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
    /**
     * What an agent of a fleet covers of the pane, in CSS pixels; null behind the camera.
     * @param {System} system
     * @param {number} agent
     * @returns {Box | null}
     */
    boxOf(system, agent) {
      const [foot, head] = this.layout.endsOf(system, agent).map((end) => this.project(end));
      if (!foot || !head) return null;
      const { point, radius } = this.layout.roomOf(system, agent);
      const { direction } = this.arm();
      const depth = this.lens.position.clone().sub(point).dot(direction);
      const tangent = Math.tan(this.lens.fov / 2 * DEGREE);
      const wide = radius * this.pane.clientHeight / (2 * tangent * Math.max(depth, this.lens.near));
      const deep = wide * Math.abs(direction.y);
      const top = Math.min(foot.y, head.y) - deep;
      return { x: head.x - wide, y: top, w: 2 * wide, h: Math.max(foot.y, head.y) + deep - top };
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
      const bars = this.scene.layout.barsOf(system);
      system.action.owner.forEach((owner, k) => {
        if (owner === holder + 1) return;
        const [outline] = this.copiesOf(k, () => [this.outline()]);
        const [x, y] = bars.spot(k);
        outline.position.set(...bars.point(x, y, 0));
        outline.visible = Number.isFinite(row[k]);
        const height = bars.scale * bars.heightOf(row[k]);
        outline.scale.set(0.5 * bars.scale, 0.5 * bars.scale, height || 1e-4);
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
        copies.forEach((copy2, k) => {
          copy2.matrix.copy(matrixIn(this.scene.viewer, sources[k]));
          ahead.forEach((v, axis) => copy2.matrix.elements[12 + axis] += v);
          copy2.visible = Math.hypot(...ahead) > 0.01;
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
      const copy2 = new THREE.Mesh(mesh2.geometry, material);
      copy2.matrixAutoUpdate = false;
      this.group.add(copy2);
      return copy2;
    }
  };

  // src/hidden.js
  var MANY3 = 60;
  var SHARP = 35;
  var Hidden = class {
    constructor() {
      this.all = [];
    }
    /**
     * Outlines of what stands for agents; those of before are forgotten.
     * @param {Iterable<Three[][]>} systems meshes of each agent, by system
     */
    build(systems) {
      for (const { lines, mesh: mesh2 } of this.all) {
        mesh2.remove(lines);
        lines.geometry.dispose();
        lines.material.dispose();
      }
      this.all = [];
      const meshes = [...systems].flat().flat();
      if (meshes.length > MANY3) return;
      for (const mesh2 of meshes) {
        const material = new THREE.LineBasicMaterial({
          depthFunc: THREE.GreaterDepth,
          depthWrite: false,
          transparent: true,
          opacity: 0.85
        });
        const lines = new THREE.LineSegments(new THREE.EdgesGeometry(mesh2.geometry, SHARP), material);
        lines.renderOrder = 5;
        mesh2.add(lines);
        this.all.push({ lines, mesh: mesh2 });
      }
    }
    /** In the colours that the robots have now. */
    colour() {
      for (const { lines, mesh: mesh2 } of this.all) lines.material.color.copy(mesh2.material.color);
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
    begin(fleets, bars, plans) {
      this.fleets = fleets;
      this.bars = bars;
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
     * A direction of an item's own frame as it is in the world.
     * @param {number} item
     * @param {Point} along
     * @returns {Point}
     */
    turned(item, along2) {
      const [w, x, y, z] = this.poses.slice(8 * item + 3, 8 * item + 7);
      return new THREE.Vector3(...along2).applyQuaternion(new THREE.Quaternion(x, y, z, w)).toArray();
    }
    /**
     * Where links of an agent begin: above a robot, on top of a bar.
     * @param {System} system
     * @param {number} agent
     * @returns {Point}
     */
    headOf(system, agent) {
      if (system.drawn_as === "bars") return this.barsOf(system).topOfAgent(agent);
      const [foot, head] = this.endsOf(system, agent);
      return [head[0], head[1], foot[2] + 0.8 * (head[2] - foot[2])];
    }
    /**
     * The lowest and the highest point over and under the place of an agent of a fleet.
     * @param {System} system
     * @param {number} agent
     * @returns {[Point, Point]}
     */
    endsOf(system, agent) {
      const [x, y, z] = this.agentAt(system, agent);
      const [, low, high] = system.rooms[agent];
      return [
        [x, y, z + low],
        [x, y, z + high]
      ];
    }
    /**
     * The room that an agent of a fleet takes, as three.js sees it.
     * @param {System} system
     * @param {number} agent
     * @returns {Room}
     */
    roomOf(system, agent) {
      const [foot, head] = this.endsOf(system, agent);
      const point = toView([foot[0], foot[1], (foot[2] + head[2]) / 2]);
      return { point, radius: system.rooms[agent][0], half: (head[2] - foot[2]) / 2 };
    }
    /** The rooms of all agents of fleets, as three.js sees them. */
    rooms() {
      return this.fleets.flatMap(
        (system) => system.anchors.map((_, agent) => this.roomOf(system, agent))
      );
    }
    /**
     * The bars of a system that is drawn as such.
     * @param {System} system
     */
    barsOf(system) {
      return (
        /** @type {Bars} */
        this.bars.find((bars) => bars.system === system)
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
      const reach = Math.max(...this.fleets.flatMap(({ rooms }) => rooms.map(([radius]) => radius)));
      for (let p = 0; p < poses.length; p += 8)
        for (const axis of [0, 1]) {
          const out = Math.max(poses[p + axis] - high[axis], low[axis] - poses[p + axis]) - reach;
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
    /**
     * What should be in view, as three.js sees it.
     * @returns {Room[]}
     */
    seen() {
      const rooms = this.rooms();
      for (const room of rooms) room.radius += this.spill;
      const points = [
        ...this.plans.flatMap((plan) => plan.corners(this.time, this.floor)),
        ...this.bars.flatMap((bars) => bars.corners())
      ];
      return [...rooms, ...points.map((point) => ({ point: toView(point), radius: 0, half: 0 }))];
    }
    /** The middle of the agents, without what swings about them, as three.js sees it. */
    middle() {
      const box = new THREE.Box3();
      for (const { point, half } of this.rooms())
        for (const y of [point.y - half, point.y + half]) box.expandByPoint(point.clone().setY(y));
      for (const bars of this.bars)
        for (const corner of bars.corners()) box.expandByPoint(toView(corner));
      return box.isEmpty() ? new THREE.Vector3() : box.getCenter(new THREE.Vector3());
    }
  };

  // src/plan.js
  var STRIP = new THREE.PlaneGeometry(1, 1);
  var AROUND3 = 48;
  var MARK = new THREE.RingGeometry(0.06, 0.1, AROUND3);
  var WIDTH2 = 0.05;
  var LEAD = 0.02;
  var RIM = 0.025;
  var STEP3 = 4e-3;
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
      return this.add(new THREE.RingGeometry(Math.max(radius - RIM, 0), radius, AROUND3), 0.8);
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
    corners(time, floor) {
      const [x, y] = this.origin(time);
      return this.plan.region.map(([a, b]) => (
        /** @type {Point} */
        [x + a, y + b, floor]
      ));
    }
    /**
     * @param {Instant} instant
     * @param {Layout} layout
     */
    update(instant, layout) {
      const own = instant.systems[this.system.name];
      const [x, y] = this.origin(instant.time);
      const level = layout.floor + STEP3;
      this.group.visible = !this.system.shown.faint && !this.system.shown.off;
      if (this.region)
        for (const part of [this.region.fill, this.region.edge]) part.position.set(x, y, level);
      for (const distance of this.distances) this.placeDistance(distance, own, layout);
      for (let agent = 0; agent < this.system.agents; agent++) {
        const [px, py] = layout.agentAt(this.system, agent);
        for (const mesh2 of [this.discs[agent], this.leads[agent], this.marks[agent]])
          if (mesh2) mesh2.visible = isThere(own, agent);
        this.discs[agent]?.position.set(px, py, level + STEP3);
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
      this.stretch(strip, ends[0], ends[1], WIDTH2, layout.floor + 2 * STEP3);
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
      const to2 = this.origin(time);
      if (to2.length < 2 || !action) return;
      const axes = owner.flatMap((each, k) => each === agent + 1 ? [k] : []);
      axes.forEach((k, axis) => to2[axis] += action[k]);
      if (axes.length === 1) to2[1] = from[1];
      this.marks[agent].position.set(to2[0], to2[1], level + 3 * STEP3);
      this.stretch(this.leads[agent], from, to2, LEAD, level + 2 * STEP3);
    }
    /**
     * @param {Three} strip
     * @param {ArrayLike<number>} from
     * @param {ArrayLike<number>} to
     * @param {number} width
     * @param {number} level
     */
    stretch(strip, from, to2, width, level) {
      const [dx, dy] = [to2[0] - from[0], to2[1] - from[1]];
      strip.position.set((from[0] + to2[0]) / 2, (from[1] + to2[1]) / 2, level);
      strip.rotation.z = Math.atan2(dy, dx);
      strip.scale.set(Math.max(Math.hypot(dx, dy), 1e-6), width, 1);
    }
  };
  var plansOf = (parent, systems) => systems.flatMap((system) => system.plan ? [new Plan(parent, system, system.plan)] : []);

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
        polygonOffset: true,
        // behind a lane's floor, also where that is seen at a grazing angle
        polygonOffsetFactor: 4,
        polygonOffsetUnits: 4,
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
    place(target, distance, floor, lane) {
      const u = this.uniforms;
      const minor = distance < 45 ? 1 : distance < 200 ? 5 : 25;
      this.major = 10 * minor;
      const { major } = this;
      const snap = (v) => Math.round(v / major) * major;
      const reach = Math.max(8, 4 * distance);
      const origin = [snap(target[0]), snap(target[1])];
      this.mesh.position.set(origin[0], origin[1], floor - 0.02);
      this.mesh.scale.setScalar(2 * reach + major);
      u.size.value = 2 * reach + major;
      [u.minor.value, u.major.value, u.reach.value] = [minor, major, reach];
      u.middle.value.set(target[0] - origin[0], target[1] - origin[1]);
      const [low, high] = lane ?? [0, 0];
      u.laneWidth.value = lane === null ? 0 : 0.75 + (high - low) / 2;
      u.lane.value = (low + high) / 2 - origin[1];
    }
  };

  // src/lights.js
  var OWN2 = { above: 0.72, rest: 0.5 };
  var MODELS = { above: 0.7, rest: 0.3 };
  var SUN = { from: [[-3, -7, 9, 1]], head: 0 };
  var Lights = class {
    /** @param {Three} scene */
    constructor(scene) {
      this.scene = scene;
      this.above = new THREE.HemisphereLight(16777215, 8949920);
      this.above.position.set(0, 0, 1);
      this.head = new THREE.DirectionalLight(16777215);
      scene.add(this.above, this.head, this.head.target);
      this.suns = [];
      this.show(null);
    }
    /** @param {Light | null} light of a model that has some */
    show(light2) {
      const { above, rest } = light2 ? MODELS : OWN2;
      const { from, head } = light2 ?? SUN;
      this.scene.remove(...this.suns);
      this.suns = from.map(([x, y, z, part]) => {
        const sun = new THREE.DirectionalLight(16777215, rest * part);
        sun.position.set(x, y, z);
        return sun;
      });
      this.scene.add(...this.suns);
      this.above.intensity = above;
      this.head.intensity = rest * head;
      this.head.visible = head > 0;
    }
    /**
     * The light at the camera looks where that does.
     * @param {Three} direction from what it looks at to the camera, as three.js sees it
     */
    place({ x, y, z }) {
      this.head.position.set(x, -z, y);
    }
  };

  // src/sky.js
  var VERTEX2 = `
  varying vec3 ray;
  uniform mat4 lens, turn; // from the picture to the camera, and from it to the world
  void main() {
    vec4 far = lens * vec4(position.xy, 1.0, 1.0);
    ray = mat3(turn) * far.xyz / far.w;
    gl_Position = vec4(position.xy, 1.0, 1.0);
  }`;
  var FRAGMENT2 = `
  varying vec3 ray;
  uniform vec3 zenith, horizon, nadir;
  void main() {
    float up = normalize(ray).y;
    vec3 end = up > 0.0 ? zenith : nadir;
    gl_FragColor = vec4(mix(horizon, end, smoothstep(0.0, 0.7, abs(up))), 1.0);
  }`;
  var NIGHT = 0.25;
  var HAZE = 0.35;
  var inTheme = (rgb) => new THREE.Color(...rgb.map((v) => theme() === "dark" ? NIGHT * v : 1 - HAZE * (1 - v)));
  var Sky = class {
    /** @param {Three} scene */
    constructor(scene) {
      const colours2 = ["zenith", "horizon", "nadir"];
      this.uniforms = Object.fromEntries(colours2.map((name) => [name, { value: null }]));
      const material = new THREE.ShaderMaterial({
        uniforms: { ...this.uniforms, lens: { value: null }, turn: { value: null } },
        vertexShader: VERTEX2,
        fragmentShader: FRAGMENT2,
        depthTest: false,
        depthWrite: false
      });
      this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
      this.mesh.renderOrder = -2;
      this.mesh.frustumCulled = false;
      this.mesh.visible = false;
      this.mesh.onBeforeRender = (...[, , lens]) => {
        material.uniforms.lens.value = lens.projectionMatrixInverse;
        material.uniforms.turn.value = lens.matrixWorld;
      };
      scene.add(this.mesh);
      this.colours = null;
    }
    /** @param {number[][] | null} colours at its zenith, at its horizon and below, from 0 to 1 */
    show(colours2) {
      this.colours = colours2;
      this.restyle();
    }
    restyle() {
      this.mesh.visible = this.colours !== null;
      Object.values(this.uniforms).forEach((uniform, k) => {
        uniform.value = this.colours && inTheme(this.colours[k]);
      });
    }
    /** What is far fades into it; null without a sky. */
    get horizon() {
      return this.uniforms.horizon.value;
    }
  };

  // src/surroundings.js
  var FADES = [2.5, 8];
  var Surroundings = class {
    /** @param {Three} scene */
    constructor(scene) {
      this.scene = scene;
      this.sky = new Sky(scene);
      this.lights = new Lights(scene);
      this.ground = new Ground(scene);
    }
    /** @param {Meta} meta of which the first system that has a sky, or lights, gives them */
    setMeta({ systems }) {
      this.sky.show(systems.find(({ sky }) => sky)?.sky ?? null);
      this.lights.show(systems.find(({ light: light2 }) => light2)?.light ?? null);
      this.ground.mesh.visible = systems.every(({ floor }) => floor === null);
      this.restyle();
    }
    restyle() {
      const { uniforms } = this.ground;
      uniforms.colour.value.set(colour("grid"));
      uniforms.strength.value = theme() === "dark" ? 0.75 : 0.85;
      this.sky.restyle();
      this.scene.fog = new THREE.Fog(this.sky.horizon ?? colour("sky-middle"), 1, 2);
    }
    /**
     * Goes with the camera.
     * @param {Camera} camera
     * @param {Layout} layout
     */
    place(camera, { floor, lane }) {
      const { x, y, z } = camera.controls.target;
      const { direction, distance } = camera.arm();
      const { fog } = this.scene;
      [fog.near, fog.far] = FADES.map((times) => times * Math.max(distance, 5));
      this.lights.place(direction);
      this.ground.place([x, -z, y], distance, floor, lane);
    }
  };

  // src/scene.js
  var FAINT2 = 0.4;
  var BELOW2 = 0.02;
  var AGAIN2 = 500;
  var Scene = class {
    /** @param {HTMLElement} pane */
    constructor(pane) {
      this.viewer = viewerIn(pane, () => this.stale = true);
      this.layout = new Layout();
      this.camera = new Camera(this.viewer, pane, this.layout);
      this.surroundings = new Surroundings(this.viewer.scene);
      this.batches = new Batches(this.viewer.scene);
      this.ghosts = new Ghosts(this);
      this.hidden = new Hidden();
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
      this.surroundings.restyle();
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
      this.surroundings.setMeta(meta);
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
      this.hidden.build(this.tinted.values());
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
    fade(system) {
      const { items: [first, count], world = "", shown: shown2 } = system;
      const still2 = nodeAt(this.viewer, world)?.children["<object>"]?.object;
      if (still2) {
        still2.position.set(...shown2.offset, -BELOW2 * this.fleets.indexOf(system));
        still2.visible = !shown2.faint && !shown2.off;
      }
      for (const object of this.objects.slice(first, first + count))
        object?.traverse(({ material, userData }) => {
          if (!material?.color) return;
          const { opacity, transparent, depthWrite } = userData.solid ??= { ...material };
          material.opacity = shown2.faint ? FAINT2 * opacity : opacity;
          material.transparent = shown2.faint || transparent;
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
      const part = theme() === "dark" ? 0.35 : 1;
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
      this.hidden.colour();
    }
    /** Found once: a model's own, or under robots of a lane, which may float around z = 0. */
    findFloor() {
      if (this.floorKnown || !this.complete || this.objects.length === 0) return;
      this.viewer.scene.updateMatrixWorld(true);
      const box = new THREE.Box3();
      for (const anchor of this.fleets.flatMap(({ anchors }) => anchors))
        box.expandByObject(this.objects[anchor]);
      [this.layout.floor = Math.min(0, box.min.y)] = this.fleets.flatMap(({ floor }) => floor ?? []);
      this.floorKnown = true;
    }
    /**
     * Bars stand behind the fleets.
     * @param {Instant} instant
     * @param {Store} store
     */
    placeBars(instant, store) {
      const { box, floor } = this.layout;
      let behind = box ? box.high[1] + 2.4 : 0;
      for (const bars of this.bars) {
        const { over } = bars.system.shown;
        const under = over && this.bars.find(({ system }) => system === over);
        if (under) {
          bars.update(instant, store, under.origin, under.scale);
          continue;
        }
        const span = box ? box.high[0] - box.low[0] : 0;
        const scale = box ? Math.min(Math.max(0.6 * span / bars.width, 0.8), 6) : 1;
        const x = box ? (box.low[0] + box.high[0]) / 2 : 0;
        bars.update(instant, store, [x, behind, floor], scale);
        behind += scale * (bars.depth + 1);
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
      this.surroundings.place(this.camera, this.layout);
      this.camera.render();
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
  var nameOf2 = (system, agent) => `${system.agent_name} ${agent + 1}`;
  var optionsOf2 = (system) => [...Array(system.agents).keys()].map(
    (agent) => element("option", {
      value: JSON.stringify({ system: system.name, agent }),
      text: nameOf2(system, agent)
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
    setMeta({ systems, controls }) {
      this.systems = systems;
      const live = controls !== void 0;
      this.fillFollow();
      this.setFollow(byId("follow").value);
      this.fillGhosts();
      this.describeLinks(live);
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
    /** @param {boolean} live whether they can be lost */
    describeLinks(live) {
      const linked = this.systems.filter((system) => system.edges.length > 0);
      byId("links").hidden = linked.length === 0;
      const words = new Set(linked.map((system) => system.edges_are));
      const parts = [];
      if (words.has("messages")) parts.push("lines: messages pass");
      if (words.has("measurements")) parts.push("dashed lines: measured directly");
      if (linked.some((system) => system.links.length && system.message_period !== null))
        parts.push("✕ lost");
      if (words.has("messages") && live) parts.push("click a line: the link is lost, or there again");
      if (linked.some((system) => system.triggered)) parts.push("sent by triggers: see the plot");
      const planned = this.systems.filter(({ plan }) => plan);
      if (planned.length) parts.push("rings: outputs, where robots head");
      if (planned.some(({ quantities }) => quantities.some(({ between: between2 }) => between2.length)))
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
      const who = nameOf2(system, agent);
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
      const { label, min, max } = this.control;
      const attributes = { type: "number", min, max, step: "any" };
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
      const { min, max } = this.control;
      if (this.logarithmic) return Math.log(value / min) / Math.log(max / min);
      return (value - min) / (max - min);
    }
    /** @param {number} place */
    valueAt(place) {
      const { min, max } = this.control;
      return this.logarithmic ? min * (max / min) ** place : min + (max - min) * place;
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
    /**
     * @param {(message: object) => void} send to the simulation
     * @param {Pushing} pushing
     */
    constructor(send, pushing) {
      this.send = send;
      this.pushing = pushing;
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
        element(
          "div",
          { class: "tuning-items" },
          ...controls.map((control) => this.slider(control)),
          ...pushes.map(() => this.pushes(system))
        )
      );
    }
    /** @param {Control} control */
    slider(control) {
      const { key } = control;
      const slider = new Slider(control, (value) => this.send({ do: "set", key, value }));
      this.sliders.set(key, slider);
      return slider.root;
    }
    /** @param {System} system */
    pushes(system) {
      const unit = this.pushing.unitOf(system, 0);
      return element(
        "div",
        { class: "pushes", role: "group", "aria-label": `pushes of ${system.name}` },
        element(
          "p",
          { class: "small" },
          "Drag a robot to push it, or with ",
          this.field(system, "force", `force of a push, in ${unit}`, 1e3),
          ` ${unit} for `,
          this.field(system, "duration", "duration of a push, in s", 100),
          " s:"
        ),
        system.agents <= MOST_PUSHED ? this.pushList(system) : this.pushChoice(system)
      );
    }
    /**
     * A number of all pushes of a system.
     * @param {System} system
     * @param {"force" | "duration"} key
     * @param {string} label
     * @param {number} max
     */
    field({ name }, key, label, max) {
      const push = (
        /** @type {Push} */
        this.pushing.pushes.get(name)
      );
      const field = element("input", {
        ...{ type: "number", min: 0, max, step: "any", class: "push-number", title: label },
        "aria-label": label,
        value: push[key]
      });
      field.onchange = () => {
        const value = Number(field.value);
        if (value > 0 && value <= max) push[key] = value;
        field.value = String(push[key]);
      };
      return field;
    }
    /**
     * Buttons for each agent.
     * @param {System} system
     */
    pushList(system) {
      const { agents, agent_name: noun } = system;
      const list = element("div", { class: "push-list" });
      for (let agent = 1; agent <= agents; agent++) {
        const buttons = arrows(this.pushing, system, () => agent - 1, `${noun} ${agent}`);
        const name = element("b", { text: agent });
        list.append(element("span", { class: "push-one" }, name, ...buttons));
      }
      return list;
    }
    /**
     * Buttons for the agent that is chosen, when agents are many.
     * @param {System} system
     */
    pushChoice(system) {
      const { agents, agent_name: noun } = system;
      const select = element("select", { "aria-label": `${noun} to push` });
      for (let agent = 1; agent <= agents; agent++)
        select.append(element("option", { value: agent, text: `${noun} ${agent}` }));
      const buttons = arrows(
        this.pushing,
        system,
        () => Number(select.value) - 1,
        `the chosen ${noun}`
      );
      return element("span", { class: "push-one" }, select, ...buttons);
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
      (_, k) => clusters.slice(0, k).reduce((sum, { length }) => sum + length, before)
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
      const [from, to2] = plots.window;
      const stretch = (
        /** @type {Stretch} */
        [from, Math.min(to2, playback.end)]
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
    refusal([from, to2], speed) {
      if (!("VideoEncoder" in window))
        return "This browser cannot make videos (it has no VideoEncoder); current Chromium, Edge, Firefox and Safari can.";
      const seconds = (to2 - from) / speed;
      if (seconds > LONGEST)
        return `A video has at most ${LONGEST} s, and this one would have ${number(seconds)} s: show a shorter stretch in the plots (drag there with shift) or choose a higher speed.`;
      return seconds > 0 ? "" : "The plots show no stretch of this run.";
    }
    /**
     * @param {Playback} playback
     * @param {Stretch} stretch
     */
    async record(playback, [from, to2]) {
      const { page: page2 } = this;
      const speed = playback.speed ?? 1;
      const canvas = this.canvas();
      const film = new Film(canvas);
      const count = Math.max(1, Math.round((to2 - from) / speed * RATE));
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
    placeNotes();
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
      this.hands = new HandsOn(this);
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
      const tuning = new Tuning((message) => live.send(message), this.hands.pushing);
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
      this.hands.renew();
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
      byId("title").textContent = byId("title").title = meta.title;
      byId("waiting").hidden = true;
      this.comparison.setMeta(meta);
      this.scene.setMeta(meta);
      this.overlay.setMeta(meta);
      this.plots.setScene(meta, source);
      this.toolbar.setMeta(meta);
      this.hands.setMeta(meta);
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
      this.plots.setSeen(seen);
      this.scene[seen ? "wake" : "rest"]();
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
      this.hands.follow(source, this.instant);
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
      this.hands.chosen.show(this.instant);
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
