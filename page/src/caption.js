// What stands above a plot: whose and what it is, and what can be done with it.
import { element, press } from "./dom.js";
import { saveCsv, savePng } from "./export.js";
/** @import { Plot } from "./plot.js" */

/**
 * A little TeX as text with subscripts: "y_i - y_{i-1}"; null if it holds more than that.
 * @param {string} tex
 */
const symbolOf = (tex) => {
  const plain = tex
    .replace(/\\(lVert|rVert|Vert|\|)/g, "‖")
    .replace(/\\(left|right|,|;|mathrm|text)/g, "")
    .replace(/-/g, "−");
  if (!plain || /[\\^]/.test(plain)) return null;
  const made = element("span", { class: "symbol" });
  for (const [, sub, one, other] of plain.matchAll(/_\{([^}]*)\}|_(\w)|([^_]+)/g))
    made.append(other ?? element("sub", { text: sub ?? one }));
  return made;
};

/** @param {Plot} plot */
export const captionOf = (plot) => {
  const { spec } = plot;
  const what = `${spec.whose} ${spec.title}`.trim();
  const tool = (/** @type {string} */ text, /** @type {string} */ title, /** @type {any} */ act) =>
    element("button", { type: "button", text, title, "aria-label": `${title}: ${what}`, onclick: act });
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
      tool("PNG", "Save the picture", () => savePng(plot)),
    ),
  );
};

/**
 * A short piece of a line as it is drawn in the plot.
 * @param {{colour: string, dash: number[]}} look
 */
export const swatchOf = (look) => {
  const made = element("canvas", { class: "swatch", width: 28, height: 6, "aria-hidden": true });
  const context = /** @type {CanvasRenderingContext2D} */ (made.getContext("2d"));
  Object.assign(context, { strokeStyle: look.colour, lineWidth: 5 });
  context.setLineDash(look.dash.map((length) => 1.6 * length));
  context.moveTo(0, 3);
  context.lineTo(28, 3);
  context.stroke();
  return made;
};
