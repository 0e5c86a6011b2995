"use strict";
// The wire to a running simulation.
(() => {
  const AGAIN = 2000; // ms until the next try
  const FULL = 1013; // the server's code for a browser too many

  GNE.Live = class {
    /** callbacks: pack(pack), command(bytes), message(object), opened(), lost(why). */
    constructor(callbacks) {
      this.callbacks = callbacks;
      this.connect();
    }

    connect() {
      const url = new URL("socket", location.href);
      url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
      this.socket = new WebSocket(url);
      this.socket.binaryType = "arraybuffer";
      this.socket.onopen = () => this.callbacks.opened();
      this.socket.onmessage = ({ data }) => this.receive(data);
      this.socket.onclose = ({ code, reason }) => {
        this.callbacks.lost(
          code === FULL
            ? `this page is not connected: ${reason}`
            : "connection lost: the simulation has ended or the server is gone",
        );
        setTimeout(() => this.connect(), AGAIN);
      };
    }

    receive(data) {
      if (typeof data === "string") return this.callbacks.message(JSON.parse(data));
      const bytes = new Uint8Array(data);
      if (!GNE.isPack(bytes)) return this.callbacks.command(bytes);
      const pack = GNE.decodePack(bytes);
      this.callbacks.pack(pack);
      // the server sends no more frames than are taken, so that a slow page is never behind
      if (pack.meta.kind !== "scene") this.send({ do: "shown" });
    }

    get open() {
      return this.socket.readyState === WebSocket.OPEN;
    }

    send(message) {
      if (this.open) this.socket.send(JSON.stringify(message));
    }
  };
})();
