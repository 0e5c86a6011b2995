// What a plot shows as a file: CSV of its numbers, PNG of its picture.
import { element } from "./dom.js";
import { colour } from "./theme.js";
/** @import { Plot } from "./plot.js" */

const DIGITS = 9; // of numbers in a file

/**
 * Hands a file to the browser.
 * @param {string} name
 * @param {Blob} blob
 */
export const download = (name, blob) => {
  const url = URL.createObjectURL(blob);
  element("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
};

/** @param {Plot} plot */
const fileOf = ({ spec }) =>
  [spec.whose, spec.name, spec.axis].filter(Boolean).join("-").replace(/[^\w-]+/g, "_");

/** @param {string} text */
const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

/**
 * The lines that are switched on, over the stretch of time that is shown.
 * @param {Plot} plot
 */
export const csvOf = (plot) => {
  const { spec, plots } = plot;
  const [from, to] = plots.window;
  const { time } = plots.source.store;
  const columns = plot.columns();
  const { on } = plot.lines;
  const unit = spec.unit ? ` (${spec.unit})` : "";
  const names = on.map((k) => quoted(plot.lines.nameOf(k) + unit));
  const rows = [["time (s)", ...names].join(",")];
  time.forEach((t, i) => {
    if (t < from || t > to) return;
    const values = on.map((k) => columns[k][i]);
    const texts = [t, ...values].map((v) => (v === null ? "" : Number(v.toPrecision(DIGITS))));
    rows.push(texts.join(","));
  });
  return [...rows, ""].join("\n");
};

/** @param {Plot} plot */
export const saveCsv = (plot) =>
  download(`${fileOf(plot)}.csv`, new Blob([csvOf(plot)], { type: "text/csv" }));

/**
 * Caption, lines and key, as they are seen.
 * @param {Plot} plot
 */
export const pictureOf = (plot) => {
  const { lines, uplot, spec } = plot;
  if (!uplot) return null;
  const chart = uplot.ctx.canvas;
  const ratio = chart.width / uplot.width;
  const { on } = lines;
  const several = spec.systems.length > 1;
  const wide = several ? 230 : 110;
  const perRow = Math.max(1, Math.floor(uplot.width / wide));
  const key = on.length > 14 || (spec.total === 1 && !several) ? [] : on;
  const [above, below] = [26, 8 + 18 * Math.ceil(key.length / perRow)];
  const canvas = element("canvas", {
    width: chart.width,
    height: chart.height + ratio * (above + below),
  });
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
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

/** @param {Plot} plot */
export const savePng = (plot) =>
  pictureOf(plot)?.toBlob((blob) => blob && download(`${fileOf(plot)}.png`, blob));
