// A video of a stretch of a replay: each picture is drawn at its exact time, however long that takes.
import { isSolid } from "./compare.js";
import { byId } from "./dom.js";
import { download } from "./export.js";
import { notify } from "./notices.js";
import { colour } from "./theme.js";
import { webmOf } from "./webm.js";
import { number } from "./words.js";
/** @import { Page } from "./page.js" */
/** @import { Playback } from "./playback.js" */
/** @import { Picture } from "./webm.js" */
/** @import { Stretch } from "./window.js" */

const RATE = 30; // pictures a second
const KEY = 2 * RATE; // pictures from one that needs none before to the next
const LONGEST = 120; // s
const LARGEST = 64e6; // bytes
const WIDEST = 1280; // px
const BITS = 0.15; // a pixel
const WAITING = 3; // pictures that the encoder may have yet to code
const ABOUT = "video";

const pause = () => new Promise((resolve) => setTimeout(resolve, 0));

/** @param {number} value */
const even = (value) => 2 * Math.max(1, Math.round(value / 2));

/** Codes the pictures of a canvas. */
class Film {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    /** @type {Picture[]} */
    this.pictures = [];
    this.bytes = 0;
    /** @type {Error | null} */
    this.error = null;
    this.encoder = new VideoEncoder({
      output: (chunk) => this.take(chunk),
      error: (error) => (this.error = error),
    });
    const { width, height } = canvas;
    const bitrate = Math.round(BITS * RATE * width * height);
    this.encoder.configure({ codec: "vp8", width, height, bitrate, framerate: RATE });
  }

  /** @param {EncodedVideoChunk} chunk */
  take(chunk) {
    const data = new Uint8Array(chunk.byteLength);
    chunk.copyTo(data);
    const time = Math.round(chunk.timestamp / 1000);
    this.pictures.push({ data, time, key: chunk.type === "key" });
    this.bytes += data.length;
  }

  /** @param {number} n number of the picture that the canvas has now */
  async add(n) {
    const frame = new VideoFrame(this.canvas, { timestamp: Math.round((1e6 * n) / RATE) });
    this.encoder.encode(frame, { keyFrame: n % KEY === 0 });
    frame.close();
    do await pause();
    while (this.encoder.encodeQueueSize > WAITING && !this.error);
    if (this.error) throw this.error;
  }

  /** The whole file. */
  async end() {
    await this.encoder.flush();
    this.encoder.close();
    const { width, height } = this.canvas;
    const duration = (1000 * this.pictures.length) / RATE;
    return webmOf(this.pictures, { codec: "V_VP8", width, height, duration });
  }
}

export class Video {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    this.stopped = false;
    byId("keep-video").onclick = () => this.start();
    byId("recording-stop").onclick = () => (this.stopped = true);
  }

  /** Of the stretch of time that plots show, at the speed that is chosen. */
  async start() {
    const { playback, plots } = this.page;
    if (!playback || this.page.recording !== null) return;
    const [from, to] = plots.window;
    const stretch = /** @type {Stretch} */ ([from, Math.min(to, playback.end)]);
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
    const { page } = this;
    const speed = playback.speed ?? 1;
    const canvas = this.canvas();
    const film = new Film(canvas);
    const count = Math.max(1, Math.round(((to - from) / speed) * RATE));
    page.scene.setQuality(1);
    let n = 0;
    for (; n < count && !this.stopped && film.bytes < LARGEST; n++) {
      const time = from + (n * speed) / RATE;
      this.picture(playback, time, (1000 * n) / RATE);
      this.compose(canvas, time);
      await film.add(n);
      byId("recording-text").textContent = `Video: ${Math.round((100 * n) / count)} %`;
    }
    if (this.stopped) return film.encoder.close();
    const bytes = await film.end();
    const end = from + (n * speed) / RATE;
    const name = `${page.meta?.title ?? "run"} ${from.toFixed(2)}-${end.toFixed(2)} s`;
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
    const { page } = this;
    const { links } = page.overlay;
    if (now === 0) links.begin();
    page.recording = now;
    playback.seek(time, now > 0);
    links.flow(page.meta?.systems.filter(isSolid) ?? [], now);
    page.scene.dirty();
    page.draw(playback, now);
  }

  /** As large as the view, or as videos should be. */
  canvas() {
    const { clientWidth: w, clientHeight: h } = byId("pane");
    const ratio = Math.min(devicePixelRatio, WIDEST / w);
    return Object.assign(document.createElement("canvas"), {
      width: even(ratio * w),
      height: even(ratio * h),
    });
  }

  /**
   * The view as it is seen, with what it is of and the time.
   * @param {HTMLCanvasElement} canvas
   * @param {number} time s
   */
  compose(canvas, time) {
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
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
      fillStyle: colour("text"),
    });
    const text = `${time.toFixed(2)} s`;
    context.fillText(this.page.meta?.title ?? "", size, size, width - 8 * size);
    context.fillText(text, width - size - context.measureText(text).width, size);
  }
}
