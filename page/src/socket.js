// The wire to a running simulation.
import { decodePack, isPack } from "./pack.js";
/** @import { Pack } from "./types.d.ts" */

const AGAIN = 2000; // ms until the next try
const FULL = 1013; // the server's code for a browser too many

export class Socket {
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
        code === FULL
          ? `this page is not connected: ${reason}`
          : "connection lost: the simulation has ended or the server is gone",
      );
      setTimeout(() => (this.socket = this.connect()), AGAIN);
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
    // the server sends no more frames than are taken, so that a slow page is never behind
    if (pack.meta.kind !== "scene") this.send({ do: "shown" });
  }

  get open() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  /** @param {object} message */
  send(message) {
    if (this.open) this.socket.send(JSON.stringify(message));
  }
}
