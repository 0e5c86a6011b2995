// What a developer, or a test, may ask of a page: window.gne, the only name that the page defines.
import { css } from "./colours.js";
import { along } from "./links.js";
import { theme } from "./theme.js";
/** @import { Page } from "./page.js" */
/** @import { Scene, Source, Three } from "./types.d.ts" */

/** @param {Page} page */
export const handleOf = (page) => ({
  /** Whether something has been drawn. */
  get ready() {
    return page.drawn;
  },
  /** Simulated time that is shown, s. */
  time: () => page.source?.time ?? 0,
  /** Shows a time of a replay, at once. */
  seek(/** @type {number} */ time) {
    page.seek(time);
    if (page.source) page.draw(page.source, performance.now());
  },
  /** Shows a stretch of time in the plots, s. */
  show: (/** @type {number} */ from, /** @type {number} */ to) => page.plots.show([from, to]),
  /** How fast a replay plays, times real time. */
  speed: (/** @type {number} */ speed) => page.setSpeed(speed),
  /** Where the scene graph has an object, in MuJoCo's coordinates, by its path in meshcat. */
  position: (/** @type {string} */ path) => page.scene.position(path),
  /** CSS colour of an agent (from 0) as it is drawn. */
  tint: (/** @type {number} */ agent, /** @type {string} */ system) => tintOf(page, agent, system),
  /** What lies on the ground under a system's robots: outputs, the region's middle, strips. */
  plan: (/** @type {string} */ system) => planOf(page, system),
  /** How each system is drawn, beside those of other runs or over them. */
  compared: () => comparedOf(page),
  /** Where an agent's head, or the middle of the link between two agents, from 0, is in the pane, px. */
  head: (/** @type {string} */ system, /** @type {number} */ a, /** @type {number} */ b = a) =>
    headOf(page, system, a, b),
  /** Colours of the sky as they are drawn, from its zenith down, and of the lights that shine. */
  around: () => aroundOf(page),
  /** What robots cover of the pane, px. */
  bodies: () => page.overlay.bodies,
  /** The labels of robots, px. */
  labels: () => page.overlay.labels.drawn,
  /** Where the text of a force is while a robot is dragged, px. */
  told: () => page.hands.pushing.shown?.box ?? null,
  /** What is plotted. */
  get plots() {
    return page.plots.describe();
  },
  get framesReceived() {
    return page.live?.framesReceived ?? 0;
  },
  /** How far the camera is, in distances at which all fits. */
  zoom: () => page.scene.camera.zoom,
  /** Whether the 3-D view has a context, and a picture. */
  alive: () => isAlive(page),
  /** What the page is doing. */
  state: () => stateOf(page),
});

/**
 * @param {Page} page
 * @param {number} agent
 * @param {string} name of the system
 */
const tintOf = ({ scene }, agent, name) => {
  const bars = scene.bars.find(({ system }) => system.name === name);
  const drawn = bars
    ? bars.bars[bars.system.action.owner.indexOf(agent + 1)]
    : scene.tinted.get(name)?.[agent]?.[0];
  return drawn ? css(drawn.material.color.toArray()) : null;
};

/**
 * @param {Page} page
 * @param {string} name of the system
 */
const planOf = ({ scene }, name) => {
  const plan = scene.plans.find(({ system }) => system.name === name);
  if (!plan) return null;
  const place = (/** @type {Three} */ object) => object.position.toArray().slice(0, 2);
  return {
    outputs: plan.marks.map(place),
    region: plan.region && place(plan.region.edge),
    strips: plan.distances.map(({ strip }) => css(strip.material.color.toArray())),
    discs: plan.discs.map((disc) => disc && disc.geometry.parameters.outerRadius),
  };
};

/**
 * @param {Page} page
 * @param {string} name of the system
 * @param {number} a
 * @param {number} b
 */
const headOf = ({ meta, overlay, scene }, name, a, b) => {
  const system = meta?.systems.find((each) => each.name === name);
  if (!system) return null;
  if (a === b) return scene.camera.project(scene.layout.headOf(system, a));
  const curve = overlay.links.curve(system, a, b);
  return curve && along(curve, 0.5);
};

/** @param {Page} page */
const aroundOf = ({ scene: { surroundings: { lights, sky } } }) => ({
  sky: sky.mesh.visible ? Object.values(sky.uniforms).map(({ value }) => css(value.toArray())) : null,
  lights: [lights.above, lights.head, ...lights.suns].map(({ color, intensity, position }) => ({
    colour: css(color.toArray()),
    intensity,
    from: position.toArray(),
  })),
});

/** @param {Page} page */
const isAlive = ({ scene }) => {
  const gl = scene.viewer.renderer.getContext();
  if (gl.isContextLost()) return false;
  scene.camera.render(); // what was drawn before is gone by now
  const { drawingBufferWidth: w, drawingBufferHeight: h } = gl;
  const pixels = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return new Set(new Uint32Array(pixels.buffer)).size > 16; // colours
};

/** @param {Page} page */
const comparedOf = ({ meta, scene }) =>
  (meta?.systems ?? []).map(({ name, items: [first], drawn_as: as, shown }) => {
    const object = as === "fleet" ? scene.objects[first] : scene.bars.find(({ system }) => system.name === name)?.group;
    let opacity = 1;
    object?.traverse((/** @type {Three} */ { material }) => {
      if (material?.color) opacity = Math.min(opacity, material.opacity);
    });
    return { name, opacity, visible: object?.visible ?? false, offset: shown.offset };
  });

/** @param {Page} page */
const stateOf = ({ hands, meta, mode, live, overlay, playback, scene, source, tuning }) => ({
  mode,
  replaying: playback !== null,
  connected: live?.connected ?? false,
  theme: theme(),
  controls: [...(tuning?.sliders.keys() ?? [])],
  pulses: overlay.links.pulses.length,
  chosen: hands.chosen.which,
  lost: [...hands.switching.lost],
  following: scene.camera.following,
  follow: scene.camera.follow,
  ghosts: scene.ghosts.shown,
  ...(meta && source && shownOf(meta, source)),
});

/**
 * @param {Scene} meta
 * @param {Source} source
 */
const shownOf = (meta, source) => ({
  time: source.time,
  playing: source.playing,
  speed: source.speed,
  exits: source.exits,
  interventions: source.interventions,
  systems: Object.fromEntries(meta.systems.map((each) => [each.name, source.stateOf(each)])),
});
