"use strict";
// Drawn flat over the 3-D pane: labels, links, messages on their way, distances on the ground.
(() => {
  const TRAVEL = 650; // ms a message is seen on its way
  const REST = 400; // ms between two of one link
  const FLOW = 1800; // ms between two of one link, where messages flow continuously
  const MANY = 160; // links, from which on only some of them show messages
  const DENSE = 300; // edges, from which on they are straight

  /** Agents in the order in which they get a label when there is no room for all: 1, 9, 5, ... */
  const labelOrder = (n) => {
    const zeros = (k) => (k === 0 ? 32 : Math.log2(k & -k));
    return [...Array(n).keys()].sort((a, b) => zeros(b) - zeros(a) || a - b);
  };

  const along = ([a, c, b], t) => {
    const u = 1 - t;
    return {
      x: u * u * a.x + 2 * u * t * c.x + t * t * b.x,
      y: u * u * a.y + 2 * u * t * c.y + t * t * b.y,
    };
  };

  GNE.Overlay = class {
    constructor(canvas, scene) {
      this.canvas = canvas;
      this.scene = scene;
      this.context = canvas.getContext("2d");
      this.show = { links: true, labels: true };
      this.pulses = [];
      this.lastPulse = new Map();
      this.marks = []; // where labels are, for the mouse
      this.highlighted = null;
    }

    setMeta(meta) {
      this.meta = meta;
      this.orders = new Map(meta.systems.map((system) => [system.name, labelOrder(system.agents)]));
      this.pulses = [];
      this.lastPulse.clear();
    }

    /** Whether pictures must go on although nothing new came. */
    get moving() {
      return this.pulses.length > 0;
    }

    // ---- messages

    /** Starts pulses for messages (links x [passed, lost]), not more than the eye can follow. */
    messages(system, counts, now) {
      if (!this.pulsing || !counts || document.hidden) return;
      const every = Math.max(1, Math.ceil(system.links.length / MANY));
      for (let link = 0; link < system.links.length; link += every) {
        const [passed, lost] = [counts[2 * link], counts[2 * link + 1]];
        if (passed + lost > 0) this.pulse(system, link, lost > 0, now, REST);
      }
    }

    /** A slow steady flow, where messages have no instants. */
    flow(system, now) {
      if (!this.pulsing) return;
      const every = Math.max(1, Math.ceil(system.links.length / MANY));
      for (let link = 0; link < system.links.length; link += every) {
        const key = `${system.name}/${link}`;
        // each begins at a moment of its own
        if (!this.lastPulse.has(key)) this.lastPulse.set(key, now - ((link * 617) % FLOW));
        this.pulse(system, link, false, now, FLOW);
      }
    }

    get pulsing() {
      return this.show.links && !GNE.reducedMotion();
    }

    pulse(system, link, lost, now, rest) {
      const key = `${system.name}/${link}`;
      if (now - (this.lastPulse.get(key) ?? -Infinity) < rest) return;
      this.lastPulse.set(key, now);
      const [hearer, sender] = system.links[link];
      this.pulses.push({ system, from: sender - 1, to: hearer - 1, lost, born: now });
    }

    // ---- drawing

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
      if (this.show.links) this.links(now);
      else this.pulses = []; // or they would keep pictures coming
      for (const system of this.meta.systems)
        if (system.drawn_as === "bars") this.barTexts(system, instant);
        else if (this.show.labels) this.labels(system, instant);
      this.distances();
    }

    /** Metres along the lane, at the ground's stronger lines. */
    distances() {
      const { scene, context } = this;
      if (!scene.box) return;
      const major = scene.ground.major;
      const { low, high } = scene.box;
      const y = low[1] - (scene.lane === null ? 1.5 : 0.75);
      context.font = "11px system-ui, sans-serif";
      context.textAlign = "center";
      context.textBaseline = "top";
      context.fillStyle = GNE.colour("muted");
      const step = major > 10 ? major : 5;
      for (
        let x = Math.floor((low[0] - 2 * step) / step) * step;
        x <= high[0] + 2 * step;
        x += step
      ) {
        const p = scene.project([x, y, scene.floor]);
        if (!p || !this.free({ x: p.x - 26, y: p.y, w: 52, h: 18 })) continue;
        this.taken.push({ x: p.x - 26, y: p.y, w: 52, h: 18 });
        this.haloed(`${GNE.number(x, 6)} m`, p.x, p.y + 4);
      }
    }

    /** Curve between two agents on the screen: its two ends and the point that bends it. */
    curve(system, a, b) {
      if (system.edges.length > DENSE) return this.straight(system, a, b);
      const [p, q] = [this.scene.headOf(system, a), this.scene.headOf(system, b)];
      const length = Math.hypot(...p.map((v, k) => v - q[k]));
      const middle = p.map((v, k) => (v + q[k]) / 2);
      middle[2] += Math.max(0.25, 0.22 * length);
      const ends = [p, middle, q].map((point) => this.scene.project(point));
      return ends.includes(null) ? null : ends;
    }

    straight(system, a, b) {
      const [from, to] = [this.headAt(system, a), this.headAt(system, b)];
      return from && to && [from, { x: (from.x + to.x) / 2, y: (from.y + to.y) / 2 }, to];
    }

    /** Where the links of an agent begin on the screen; once a picture for each. */
    headAt(system, agent) {
      const key = `${system.name}/${agent}`;
      if (!this.heads.has(key))
        this.heads.set(key, this.scene.project(this.scene.headOf(system, agent)));
      return this.heads.get(key);
    }

    links(now) {
      this.heads = new Map();
      for (const system of this.meta.systems) this.edges(system);
      const context = this.context;
      this.pulses = this.pulses.filter(({ born, lost }) => now - born < (lost ? 1.5 : 1) * TRAVEL);
      for (const pulse of this.pulses) this.drawPulse(context, pulse, (now - pulse.born) / TRAVEL);
    }

    edges(system) {
      const context = this.context;
      const dense = system.edges.length > 60;
      context.lineWidth = dense ? 0.8 : 1.4;
      context.strokeStyle = GNE.colour("link");
      context.globalAlpha = dense ? Math.max(0.15, 30 / system.edges.length) : 0.75;
      context.setLineDash(system.edges_are === "messages" ? [] : [4, 4]);
      context.beginPath();
      for (const [a, b] of system.edges) {
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

    drawPulse(context, { system, from, to, lost }, age) {
      const curve = this.curve(system, from, to);
      if (!curve) return;
      const { x, y } = along(curve, lost ? Math.min(age, 0.5) : age);
      context.fillStyle = context.strokeStyle = GNE.colour(lost ? "bad" : "pulse");
      if (lost && age > 0.5) {
        context.globalAlpha = Math.max(0, 1.5 - age);
        context.lineWidth = 2;
        context.beginPath();
        context.moveTo(x - 4, y - 4);
        context.lineTo(x + 4, y + 4);
        context.moveTo(x + 4, y - 4);
        context.lineTo(x - 4, y + 4);
        context.stroke();
        context.globalAlpha = 1;
        return;
      }
      context.beginPath();
      context.arc(x, y, 3, 0, 2 * Math.PI);
      context.fill();
    }

    // ---- labels

    free(box) {
      return !this.taken.some(
        (t) => box.x < t.x + t.w && t.x < box.x + box.w && box.y < t.y + t.h && t.y < box.y + box.h,
      );
    }

    labels(system, instant) {
      const shares = instant.systems[system.name].share;
      const share = (agent) => (shares ? shares[agent] : NaN);
      const first = (agent) => this.isHighlighted(system, agent) || share(agent) > 1;
      const order = this.orders.get(system.name);
      const urgent = order.filter(first);
      for (const agent of [...urgent, ...order.filter((each) => !first(each))])
        this.label(system, agent, share(agent));
    }

    isHighlighted(system, agent) {
      return this.highlighted?.system === system.name && this.highlighted.agent === agent;
    }

    label(system, agent, share) {
      const [x, y, z] = this.scene.agentAt(system, agent);
      const p = this.scene.project([x, y, z + system.height]);
      if (!p) return;
      this.marks.push({ x: p.x, y: p.y, system: system.name, agent });
      const number = String(agent + 1);
      const out = share > 1;
      const digits = out && share < 1.1 ? 1 : 0; // not "100 %" of what is outside
      const percent = Number.isFinite(share) ? `${(100 * share).toFixed(digits)} %` : out ? "outside" : "";
      for (const text of percent ? [percent, ""] : [""]) {
        const box = this.pillBox(p, number, out ? `⚠ ${text}` : text);
        if (!this.free(box) && !this.isHighlighted(system, agent)) continue;
        this.taken.push(box);
        return this.pill(box, { number, system, agent, out });
      }
    }

    pillBox(p, number, text) {
      const context = this.context;
      context.font = "600 13px system-ui, sans-serif";
      const wide = context.measureText(number).width;
      context.font = "12px system-ui, sans-serif";
      const more = text ? context.measureText(text).width + 7 : 0;
      const w = wide + more + 14;
      return { x: p.x - w / 2, y: p.y - 22, w, h: 20, wide, text };
    }

    pill(box, { number, system, agent, out }) {
      const context = this.context;
      const chosen = this.isHighlighted(system, agent);
      context.beginPath();
      context.roundRect(box.x, box.y, box.w, box.h, 5);
      context.fillStyle = out ? GNE.colour("bad-fill") : GNE.colour("pill");
      context.fill();
      context.lineWidth = chosen ? 2 : 1;
      context.strokeStyle = GNE.colour(chosen ? "accent" : "pill-edge");
      context.stroke();
      context.textBaseline = "middle";
      context.textAlign = "left";
      context.fillStyle = out ? "#fff" : GNE.colour("text");
      context.font = "600 13px system-ui, sans-serif";
      context.fillText(number, box.x + 7, box.y + 10.5);
      context.font = "12px system-ui, sans-serif";
      if (!out) context.fillStyle = GNE.colour("muted");
      context.fillText(box.text, box.x + 14 + box.wide, box.y + 10.5);
      if (system.agents <= 14 && !out) this.swatch(box, agent);
    }

    /** The look of the agent's line in the plots, under its label. */
    swatch(box, agent) {
      const context = this.context;
      const { colour, dash } = GNE.line(agent);
      context.strokeStyle = colour;
      context.lineWidth = 2.5;
      context.setLineDash(dash);
      context.beginPath();
      context.moveTo(box.x + 5, box.y + box.h);
      context.lineTo(box.x + box.w - 5, box.y + box.h);
      context.stroke();
      context.setLineDash([]);
    }

    barTexts(system) {
      const bars = this.scene.bars.find((each) => each.system === system);
      for (const text of [bars.title(), ...bars.gaugeTexts()]) this.text(text);
      const owners = system.action.owner;
      const decimals = GNE.decimals(bars.reference);
      owners.forEach((owner, k) => {
        const p = this.scene.project(bars.top(k));
        if (p) this.marks.push({ x: p.x, y: p.y, system: system.name, agent: owner - 1 });
        if (!this.show.labels) return;
        const chosen = this.isHighlighted(system, owner - 1);
        const axis = system.action.axis[k] || "";
        this.text({ point: bars.foot(k), text: `${owner}${axis}`, shift: 11, bold: true, chosen });
        this.text({
          point: bars.top(k),
          text: GNE.fixed(bars.values[k] ?? null, decimals),
          shift: -9,
          chosen,
        });
      });
    }

    text({ point, text, shift = 0, align = "center", bold, bad, limit, title, chosen }) {
      const p = this.scene.project(point);
      if (!p) return;
      const context = this.context;
      context.font = `${bold || title ? "600 " : ""}12px system-ui, sans-serif`;
      const w = context.measureText(text).width;
      const left = align === "center" ? p.x - w / 2 : p.x + 4;
      const box = { x: left - 2, y: p.y + shift - 7, w: w + 4, h: 14 };
      if (!this.free(box) && !chosen) return;
      this.taken.push(box);
      context.textAlign = "left";
      context.textBaseline = "middle";
      const colour = bad ? "bad" : limit ? "limit" : chosen ? "accent" : title ? "muted" : "text";
      context.fillStyle = GNE.colour(colour);
      this.haloed(text, left, p.y + shift);
    }

    /** Text that can be read on anything. */
    haloed(text, x, y) {
      const context = this.context;
      context.lineWidth = 3;
      context.lineJoin = "round";
      context.strokeStyle = GNE.colour("halo");
      context.strokeText(text, x, y);
      context.fillText(text, x, y);
    }

    /** The agent whose label or head is near a point of the pane. */
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
})();
