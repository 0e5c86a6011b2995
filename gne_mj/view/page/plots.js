"use strict";
// Plots over time: each system's actions and bounded quantities, by uPlot.
(() => {
  const MOST_LINES = 40;
  const MOST_CHIPS = 14;
  const FONT = "12px system-ui, sans-serif";

  /** A little TeX as text with subscripts: "y_i - y_{i-1}"; null if it holds more than that. */
  const symbolOf = (tex) => {
    const plain = tex
      .replace(/\\(lVert|rVert|Vert|\|)/g, "‖")
      .replace(/\\(left|right|,|;|mathrm|text)/g, "")
      .replace(/-/g, "−");
    if (!plain || /[\\^]/.test(plain)) return null;
    const made = GNE.element("span", { class: "symbol" });
    for (const [, sub, one, other] of plain.matchAll(/_\{([^}]*)\}|_(\w)|([^_]+)/g))
      made.append(other ?? GNE.element("sub", { text: sub ?? one }));
    return made;
  };

  /** Labels without what all of them say: "gap of agents 1 and 2" as "1–2". */
  const shortOf = (labels) => {
    if (labels.length < 2) return labels;
    const [first] = labels;
    let n = 0;
    while (n < first.length && labels.every((each) => each[n] === first[n])) n++;
    const common = first.slice(0, n).lastIndexOf(" ") + 1;
    return labels.map((each) =>
      each
        .slice(common)
        .replace(/\bagents? /g, "")
        .replace(/ and /g, "–")
        .replace(/ to /g, "→")
        .replace(/_(\d)\b/g, (_, digit) => "₀₁₂₃₄₅₆₇₈₉"[digit]),
    );
  };

  /** What to plot of a system: actions by axis, then quantities. */
  const specsOf = (system) => {
    const { action, agent_name: agent } = system;
    const specs = [...new Set(action.axis)].map((axis) => {
      const columns = [...action.owner.keys()].filter((k) => action.axis[k] === axis);
      return {
        system,
        name: "action",
        axis,
        array: `${system.name}/action`,
        unit: action.unit,
        columns,
        title: axis ? `${action.name}, ${axis}` : action.name,
        symbol: "",
        labels: columns.map((k) => String(action.owner[k])),
        agents: columns.map((k) => action.owner[k] - 1),
        noun: agent,
        bounds: [],
      };
    });
    for (const quantity of system.quantities) {
      const ofAgents = quantity.labels.length === system.agents && system.agents > 1;
      specs.push({
        system,
        name: quantity.name,
        axis: "",
        array: `${system.name}/quantity/${quantity.name}`,
        unit: quantity.unit,
        columns: [...quantity.labels.keys()],
        title: quantity.long_name,
        symbol: quantity.symbol,
        labels: quantity.labels.map((each) => each || quantity.long_name),
        agents: quantity.labels.map((_, k) => (ofAgents ? k : null)),
        noun: ofAgents ? agent : "",
        bounds: boundsOf(quantity),
      });
    }
    return specs.map(thinned);
  };

  /** Each different bound with the entries that have it. */
  const boundsOf = ({ bound, lower_bound, labels }) => {
    const found = new Map();
    const shorts = shortOf(labels);
    for (const values of [bound, lower_bound])
      (values || []).forEach((value, k) => {
        if (!Number.isFinite(value)) return;
        if (!found.has(value))
          found.set(value, { value, whose: [], lower: values === lower_bound });
        found.get(value).whose.push(shorts[k]);
      });
    const all = [...found.values()];
    for (const each of all) {
      const whose = `: ${each.whose.join(", ")}`;
      each.note = each.whose.length < labels.length && whose.length < 20 ? whose : "";
    }
    return all.sort((a, b) => a.value - b.value);
  };

  const thinned = (spec) => {
    const chosen = GNE.chosen(spec.columns.length, MOST_LINES);
    const pick = (values) => chosen.map((k) => values[k]);
    const total = spec.columns.length;
    return {
      ...spec,
      total,
      columns: pick(spec.columns),
      shorts: pick(shortOf(spec.labels)),
      labels: pick(spec.labels),
      agents: pick(spec.agents),
    };
  };

  const niceSpan = (t) => {
    const ten = 10 ** Math.floor(Math.log10(t));
    return ten * [1, 1.5, 2, 3, 5, 7.5, 10].find((step) => step * ten >= t);
  };

  class Plot {
    constructor(plots, spec) {
      this.plots = plots;
      this.spec = spec;
      this.hovered = null; // index into the samples
      this.build();
    }

    build() {
      const { spec } = this;
      this.chips = GNE.element("div", { class: "plot-chips" });
      this.chart = GNE.element("div", { class: "chart" });
      const shown = spec.columns.length;
      this.several = spec.total > shown ? `${shown} of ${spec.total} shown` : "";
      this.note = GNE.element("span", { class: "plot-note", text: this.several });
      this.root = GNE.element(
        "figure",
        { class: "plot", "aria-label": `${spec.system.name}: ${spec.title} over time` },
        GNE.element(
          "figcaption",
          {},
          GNE.element("span", { class: "plot-system", text: spec.system.name }),
          GNE.element("span", { class: "plot-title", text: spec.title }),
          symbolOf(spec.symbol),
          this.note,
        ),
        this.chips,
        this.chart,
      );
      this.values = this.makeChips();
      this.readout = GNE.element("span", { class: "readout" });
      if (!this.values.length) this.chips.append(this.readout);
    }

    lineOf(k) {
      const { spec } = this;
      if (spec.total === 1) return { colour: GNE.colour("text"), dash: [] };
      return GNE.line(spec.agents[k] ?? spec.columns[k]);
    }

    makeChips() {
      const { spec } = this;
      if (spec.columns.length > MOST_CHIPS) return [];
      return spec.labels.map((label, k) => {
        const { colour, dash } = this.lineOf(k);
        const value = GNE.element("span", { class: "chip-value" });
        const swatch = GNE.element("canvas", {
          class: "swatch",
          width: 28,
          height: 6,
          "aria-hidden": true,
        });
        const context = swatch.getContext("2d");
        Object.assign(context, { strokeStyle: colour, lineWidth: 5 });
        context.setLineDash(dash.map((length) => 1.6 * length));
        context.moveTo(0, 3);
        context.lineTo(28, 3);
        context.stroke();
        const text = spec.total === 1 ? "" : spec.shorts[k];
        const chip = GNE.element(
          "span",
          {
            class: "plot-chip",
            title: `${spec.noun} ${label}`.trim(),
            onmouseenter: () => this.point(k),
            onmouseleave: () => this.point(null),
          },
          swatch,
          text,
          value,
        );
        this.chips.append(chip);
        return value;
      });
    }

    /** One line is pointed at: it stands out, and so does its agent in the scene. */
    point(k) {
      const agent = k === null ? null : this.spec.agents[k];
      this.focus(k);
      this.plots.callbacks.highlight(
        agent === null || agent === undefined ? null : { system: this.spec.system.name, agent },
        this,
      );
    }

    focus(k) {
      if (this.focused === k) return;
      this.focused = k;
      this.markChip(k);
      this.uplot?.setSeries(k === null ? null : k + 1, { focus: true });
    }

    markChip(k) {
      this.values.forEach((value, each) =>
        value.parentElement.classList.toggle("chosen", each === k),
      );
    }

    highlight(which) {
      const own = which?.system === this.spec.system.name;
      const k = own ? this.spec.agents.indexOf(which.agent) : -1;
      this.focus(k < 0 ? null : k);
    }

    // ---- uPlot

    make(width, height) {
      this.height = height;
      this.uplot?.destroy();
      this.focused = this.timeLine = null;
      this.uplot = new uPlot(this.options(width, height), this.data(), this.chart);
      this.timeLine = GNE.element("div", { class: "time-line" });
      this.exitLine = GNE.element(
        "div",
        { class: "exit-line", hidden: true },
        GNE.element("span", { text: "left the set" }),
      );
      this.uplot.over.append(this.timeLine, this.exitLine);
      this.listen(this.uplot.over);
    }

    setSize(width, height) {
      this.height = height;
      this.uplot.setSize({ width, height });
    }

    options(width, height) {
      const axis = {
        stroke: GNE.colour("muted"),
        font: FONT,
        grid: { stroke: GNE.colour("plot-grid"), width: 1 },
        ticks: { stroke: GNE.colour("plot-grid"), width: 1, size: 4 },
      };
      return {
        width,
        height,
        legend: { show: false },
        padding: [6, 16, 0, 0],
        scales: {
          x: { time: false, range: () => [0, this.plots.span()] },
          y: { range: (_, low, high) => this.rangeY(low, high) },
        },
        axes: [
          {
            ...axis,
            size: 24,
            gap: 2,
            space: 60,
            values: (_, ticks) => ticks.map((v) => `${GNE.number(v, 6)} s`),
          },
          {
            ...axis,
            size: 50,
            gap: 3,
            space: 24,
            label: this.spec.unit || undefined,
            labelSize: 18,
            labelGap: 0,
            labelFont: FONT,
            values: (_, ticks) => ticks.map((v) => GNE.number(v, 6)),
          },
        ],
        series: [{}, ...this.spec.labels.map((label, k) => this.series(label, k))],
        focus: { alpha: 0.22 },
        cursor: {
          drag: { x: false, y: false },
          points: { show: this.spec.total <= MOST_CHIPS, size: 6 },
          focus: { prox: 14 },
          sync: { key: "gne", setSeries: false, scales: ["x", null] },
        },
        hooks: {
          drawAxes: [(u) => this.drawBounds(u)],
          draw: [() => this.setTime(this.plots.now)], // the axis is another one only by now
          setCursor: [(u) => this.hover(u)],
          setSeries: [(_, k, how) => this.focusedByMouse(k, how)],
        },
      };
    }

    series(label, k) {
      const { colour, dash } = this.lineOf(k);
      const many = this.spec.columns.length > MOST_CHIPS;
      return {
        label,
        stroke: colour,
        dash: dash.length ? dash : undefined,
        width: many ? 1 : 1.75,
        points: { show: false },
        spanGaps: false,
      };
    }

    data() {
      const { store } = this.plots;
      return [store.time, ...this.spec.columns.map((k) => store.column(this.spec.array, k))];
    }

    rangeY(low, high) {
      for (const { value } of this.spec.bounds) {
        low = low === null ? value : Math.min(low, value);
        high = high === null ? value : Math.max(high, value);
      }
      if (low === null || high === null || !Number.isFinite(low + high)) return [0, 1];
      const size = high - low || Math.abs(high) || 1;
      // room for a bound's label above its line
      const room = this.spec.bounds.length ? 18 / Math.max(this.height - 36, 40) : 0.08;
      return [low - 0.07 * size, high + room * size * 1.2];
    }

    drawBounds(u) {
      const { ctx: context, bbox } = u;
      const ratio = uPlot.pxRatio;
      context.save();
      context.beginPath();
      context.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      context.clip();
      this.drawInterventions(u, context);
      context.strokeStyle = context.fillStyle = GNE.colour("limit");
      context.lineWidth = 1.5 * ratio;
      context.font = `${12 * ratio}px system-ui, sans-serif`;
      context.textBaseline = "bottom";
      context.textAlign = "right";
      let last = Infinity;
      for (const bound of this.spec.bounds) {
        const y = u.valToPos(bound.value, "y", true);
        context.setLineDash([6 * ratio, 4 * ratio]);
        context.beginPath();
        context.moveTo(bbox.left, y);
        context.lineTo(bbox.left + bbox.width, y);
        context.stroke();
        if (last - y < 13 * ratio) continue; // no room for another label
        last = y;
        const text = `bound ${GNE.withUnit(bound.value, this.spec.unit)}${bound.note}`;
        context.fillText(text, bbox.left + bbox.width - 4 * ratio, y - 2 * ratio);
      }
      context.restore();
    }

    drawInterventions(u, context) {
      context.strokeStyle = GNE.colour("muted");
      context.lineWidth = 1;
      context.setLineDash([2, 4]);
      for (const { time } of this.plots.interventions) {
        const x = u.valToPos(time, "x", true);
        context.beginPath();
        context.moveTo(x, u.bbox.top);
        context.lineTo(x, u.bbox.top + u.bbox.height);
        context.stroke();
      }
    }

    hover(u) {
      this.hovered = u.cursor.left >= 0 ? u.cursor.idx : null;
      this.writeValues();
    }

    focusedByMouse(k, how) {
      if (how?.focus === undefined || this.uplot?.cursor.left === undefined) return;
      if (!this.mouseInside) return;
      const line = k === null || k === undefined ? null : k - 1;
      if (line === this.focused) return;
      this.focused = line;
      this.markChip(line);
      const agent = line === null ? null : this.spec.agents[line];
      this.plots.callbacks.highlight(
        agent === null || agent === undefined ? null : { system: this.spec.system.name, agent },
        this,
      );
    }

    listen(over) {
      let dragging = false;
      const seek = (event) => {
        const left = event.clientX - over.getBoundingClientRect().left;
        this.plots.callbacks.seek(this.uplot.posToVal(left, "x"));
      };
      over.addEventListener("pointerdown", (event) => {
        if (event.button !== 0 || !this.plots.seekable) return;
        dragging = true;
        over.setPointerCapture(event.pointerId);
        seek(event);
      });
      over.addEventListener("pointermove", (event) => dragging && seek(event));
      over.addEventListener("pointerup", () => (dragging = false));
      over.addEventListener("pointercancel", () => (dragging = false));
      over.addEventListener("mouseenter", () => (this.mouseInside = true));
      over.addEventListener("mouseleave", () => {
        this.mouseInside = false;
        this.point(null);
      });
    }

    refresh() {
      this.uplot?.setData(this.data(), true);
      this.writeValues();
    }

    setTime(t) {
      if (!this.timeLine) return;
      const place = (line, time) => {
        const x = Math.round(this.uplot.valToPos(time, "x"));
        if (line.at === x) return; // painting anew costs more than all else here
        line.at = x;
        line.style.transform = `translateX(${x}px)`;
        line.style.visibility = Number.isFinite(x) ? "visible" : "hidden";
      };
      place(this.timeLine, t);
      const exit = this.plots.exits[this.spec.system.name];
      this.exitLine.hidden = !Number.isFinite(exit);
      if (!this.exitLine.hidden) {
        place(this.exitLine, exit);
        this.exitLine.classList.toggle("leftward", exit > 0.7 * this.plots.span());
      }
    }

    /** Values at the mouse, or now. */
    writeValues() {
      const u = this.uplot;
      if (!u) return;
      const decimals = GNE.decimals(this.plots.store.greatest(this.spec.array));
      const i = this.hovered ?? u.valToIdx(this.plots.now);
      const hover = this.hovered === null ? "" : `at ${GNE.fixed(u.data[0][i] ?? null, 2)} s`;
      this.note.textContent = [this.several, hover].filter(Boolean).join(" · ");
      const value = (k) => GNE.fixed(u.data[k + 1][i] ?? null, decimals);
      this.values.forEach((place, k) => (place.textContent = value(k)));
      if (this.values.length) return;
      const k = this.focused;
      this.readout.textContent =
        k === null || k === undefined
          ? "point at a line for its value"
          : `${this.spec.noun} ${this.spec.labels[k]}: ${value(k)} ${this.spec.unit}`.trim();
    }
  }

  GNE.Plots = class {
    constructor(column, callbacks) {
      this.column = column;
      this.callbacks = callbacks;
      this.plots = [];
      this.exits = {}; // time at which a system left the set
      this.interventions = [];
      this.now = 0;
      this.seekable = false;
      new ResizeObserver(() => this.resize()).observe(column);
    }

    /** Plots for a scene; a store has time, column(array, k). */
    setScene(meta, store) {
      this.meta = meta;
      this.store = store;
      this.plots = meta.systems.flatMap(specsOf).map((spec) => new Plot(this, spec));
      this.column.replaceChildren(...this.plots.map((plot) => plot.root));
      this.size = null;
      this.resize();
    }

    setStore(store) {
      this.store = store;
      this.refresh();
    }

    restyle() {
      if (this.meta) this.setScene(this.meta, this.store);
    }

    /** Right end of the time axis: the run's, or live a round number beyond what is there. */
    span() {
      const time = this.store.time;
      const last = time.length ? time[time.length - 1] : 0;
      const { duration } = this.meta;
      // an exit at the very end should not hide in the frame
      const exit = Math.max(0, ...Object.values(this.exits));
      if (this.seekable) return Math.max(last, 1.06 * exit, 1e-6);
      const nice = niceSpan(Math.max(last, 2));
      return duration && last <= duration ? Math.min(nice, duration) : nice;
    }

    resize() {
      if (!this.meta || !this.column.clientWidth) return;
      const width = this.column.clientWidth - 24;
      const count = Math.max(this.plots.length, 1);
      const extra = this.plots.reduce(
        (sum, { root, chart }) => sum + root.offsetHeight - chart.offsetHeight,
        0,
      );
      const room = (this.column.clientHeight - extra - 16) / count;
      const height = Math.floor(Math.min(Math.max(room, 112), 300));
      const size = `${width} ${height}`;
      if (size === this.size) return;
      this.size = size;
      for (const plot of this.plots)
        if (plot.uplot) plot.setSize(width, height);
        else plot.make(width, height);
      for (const plot of this.plots) plot.setTime(this.now);
    }

    refresh() {
      for (const plot of this.plots) plot.refresh();
    }

    setTime(t) {
      this.now = t;
      for (const plot of this.plots) plot.setTime(t);
    }

    writeValues() {
      for (const plot of this.plots) plot.writeValues();
    }

    highlight(which, except) {
      for (const plot of this.plots) if (plot !== except) plot.highlight(which);
    }

    describe() {
      return this.plots.map(({ spec, uplot }) => ({
        system: spec.system.name,
        name: spec.name,
        axis: spec.axis,
        title: spec.title,
        series: [...spec.labels],
        total: spec.total,
        bounds: spec.bounds.map(({ value }) => value),
        width: uplot?.width ?? 0,
        samples: uplot?.data[0].length ?? 0,
      }));
    }
  };
})();
