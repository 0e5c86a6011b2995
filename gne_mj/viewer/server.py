"""The page's server: meshcat's, on the loopback interface only and for this process alone.

It runs in a thread of the process that simulates, so that it ends with it however that ends. The
page's address holds a secret, which keeps other users of the machine out; requests must name a
loopback host and come from the page itself, which keeps out what other pages in the browser may
try. A browser gets a frame only when it has shown the one before last, so that a slow one misses
frames and nobody waits for it.
"""

import asyncio
import json
import secrets
import socket
import struct
import threading
import warnings
from collections.abc import Callable
from contextlib import suppress
from mimetypes import guess_type
from typing import Any

import tornado.web
import umsgpack
from tornado.httpserver import HTTPServer
from tornado.iostream import StreamClosedError

from gne_mj.errors import InvalidInput
from gne_mj.viewer.html import packed_page, page_file, served_page

with warnings.catch_warnings():  # it imports a module of pyzmq that pyzmq warns of
    warnings.simplefilter("ignore", DeprecationWarning)
    from meshcat.servers.zmqserver import WebSocketHandler, ZMQWebSocketBridge

HOST = "127.0.0.1"
BROWSERS, CONNECTIONS = 16, 64  # at once
UNSHOWN = 2  # frames under way to a browser
PATIENCE = 10.0  # s, for everything that could take for ever
FAREWELL = 1.0  # s that closing waits for browsers
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline';"
    " img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none';"
    " frame-ancestors 'none'"
)


class Server:
    """Serves one page until it is closed or the process ends.

    Args:
        title: of the page.
        replay: a replay's compressed pack, for a page that shows just that; None for a live page,
            which can have one later.
        port: 0 for any that is free.
        received: for a live page: called in the server's thread with each message of a browser, a
            dict, and that browser; ``{"do": "connect"}`` is the first one.

    Attributes:
        url: the page's address, with its secret.
        port: where it listens, on 127.0.0.1.
        dropped: frames that browsers were not sent, having some to show yet.

    Raises:
        InvalidInput: the port is taken.
    """

    def __init__(
        self,
        title: str,
        *,
        replay: bytes | None = None,
        port: int = 0,
        received: "Callable[[dict[str, Any], Browser], None] | None" = None,
    ) -> None:
        self.replay, self.received = replay, received
        self.live = received is not None
        self.title, self.dropped = title, 0
        self.secret = secrets.token_urlsafe(16)
        try:
            self._socket = socket.create_server((HOST, port))
        except OSError as error:
            raise InvalidInput(
                "port", port, f"it cannot be listened on ({error.strerror}); leave it out"
            ) from None
        self._socket.setblocking(False)
        self.port = int(self._socket.getsockname()[1])
        self.url = f"http://{HOST}:{self.port}/{self.secret}/"
        self.hosts = {f"{HOST}:{self.port}", f"localhost:{self.port}"}
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, name="gne-mj view", daemon=True)
        self._thread.start()
        self._ready.wait(PATIENCE)

    def _run(self) -> None:
        asyncio.run(self._serve())

    async def _serve(self) -> None:
        self._loop, self._closing = asyncio.get_running_loop(), asyncio.Event()
        self._bridge = _Bridge(self, self._socket)
        self._ready.set()
        await self._closing.wait()
        with suppress(TimeoutError):
            await asyncio.wait_for(self._bridge.stop(), FAREWELL)

    @property
    def browsers(self) -> "list[Browser]":
        """Those that are connected, and have been welcomed."""
        return [each for each in list(self._bridge.websocket_pool) if each.welcomed]

    def send(self, command: Any) -> None:
        """Draw one of meshcat's commands, now and for browsers to come.

        With this a server is the window of a ``meshcat.Visualizer(window=server)``.
        """
        lowered = command.lower()
        frames = [lowered["type"].encode(), lowered["path"].encode(), umsgpack.packb(lowered)]
        self._call(self._bridge.handle_zmq, frames)

    def welcome(self, browser: "Browser", messages: list[bytes]) -> None:
        """Send a new browser what it has to know, after which it gets frames."""
        self._call(browser.welcome, messages)

    def publish(self, frame: bytes) -> None:
        """Offer a frame to all browsers; returns at once."""
        self._call(self._bridge.publish, frame)

    def tell(self, message: dict[str, Any], browser: "Browser | None" = None) -> None:
        """Send a message, which is never left out, to one browser or to all."""
        self._call(self._bridge.tell, json.dumps(message, allow_nan=False), browser)

    def broadcast(self, message: bytes) -> None:
        """Send a pack, which is never left out, to all browsers."""
        self._call(self._bridge.tell, message, None)

    def close(self) -> None:
        """End it; browsers see the connection close."""
        if self._thread.is_alive():
            self._call(self._closing.set)
            self._thread.join(PATIENCE)

    def _call(self, function: Callable[..., Any], *arguments: Any) -> None:
        # The loop is closed only while the process or the server is ending.
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(function, *arguments)


def framed(message: bytes | str) -> bytes:
    """A message as it goes over a WebSocket (RFC 6455), whole and unmasked as servers send it."""
    data, kind = (message, 0x82) if isinstance(message, bytes) else (message.encode(), 0x81)
    if len(data) < 126:
        return struct.pack("!BB", kind, len(data)) + data
    if len(data) < 1 << 16:
        return struct.pack("!BBH", kind, 126, len(data)) + data
    return struct.pack("!BBQ", kind, 127, len(data)) + data


class _Guarded(tornado.web.RequestHandler):
    """Answers only requests that name this server's loopback address as their host."""

    server: Server

    def prepare(self) -> None:
        if self.request.host not in self.server.hosts:
            raise tornado.web.HTTPError(403)

    def set_default_headers(self) -> None:
        for name, value in {
            "Content-Security-Policy": _POLICY,
            "Cache-Control": "no-store",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Referrer-Policy": "no-referrer",
            "Server": "gne-mj",
            "X-Content-Type-Options": "nosniff",
        }.items():
            self.set_header(name, value)


class _File(_Guarded):
    """The page, its files, the replay's pack, and the replay as one file to keep."""

    def initialize(self, server: Server) -> None:
        self.server = server

    def get(self, name: str) -> None:
        server = self.server
        if name == "":
            self.write(served_page("live" if server.live else "served", server.title))
        elif name == "replay" and server.replay is not None:
            self.set_header("Content-Type", "application/octet-stream")
            self.write(server.replay)
        elif name == "run.html" and server.replay is not None:
            self.set_header("Content-Type", "text/html; charset=utf-8")
            self.set_header("Content-Disposition", "attachment")
            self.write(packed_page(server.replay, server.title))
        else:
            try:
                data = page_file(name)
            except (OSError, ValueError):
                raise tornado.web.HTTPError(404) from None
            self.set_header("Content-Type", guess_type(name)[0] or "application/octet-stream")
            self.write(data)


class _Nothing(_Guarded):
    """What there is at every other address."""

    def initialize(self, server: Server) -> None:
        self.server = server

    def prepare(self) -> None:
        super().prepare()
        raise tornado.web.HTTPError(404)


class Browser(_Guarded, WebSocketHandler):
    """The connection of one browser with a live page."""

    bridge: "_Bridge"  # set by meshcat's class

    def initialize(self, server: Server) -> None:
        """Tornado's way of making a handler."""
        self.server = server
        self.welcomed, self._unshown = False, 0

    def prepare(self) -> None:
        """Only the page itself may connect; Tornado alone looks at the host, not the scheme."""
        super().prepare()
        origin = self.request.headers.get("Origin")
        if origin is not None and not self.check_origin(origin):
            raise tornado.web.HTTPError(403)

    def check_origin(self, origin: str) -> bool:
        """Whether a page is this one."""
        return origin in {f"http://{host}" for host in self.server.hosts}

    def open(self, *_: Any) -> None:
        """A new browser gets the scene; what else it must know it is told when welcomed."""
        if len(self.bridge.websocket_pool) >= BROWSERS:
            self.close(1013, f"there are {BROWSERS} browsers already")
            return
        self.bridge.websocket_pool.add(self)
        self.bridge.send_scene(self)
        self._received({"do": "connect"})

    def welcome(self, messages: list[bytes]) -> None:
        """See :meth:`Server.welcome`."""
        for message in messages:
            self.say(framed(message))
        self.welcomed = True

    def offer(self, frame: bytes) -> None:
        """Send a frame, unless the browser has yet to show some; as :func:`framed` has it."""
        if not self.welcomed:
            return
        if self._unshown >= UNSHOWN:
            self.server.dropped += 1
            return
        self._unshown += 1
        self.say(frame)

    def say(self, message: bytes) -> None:
        """Send a message, as :func:`framed` has it, whatever is under way.

        What the socket takes at once goes there without Tornado's futures, which cost more than
        all else of a frame; what it does not take waits in Tornado's stream.
        """
        connection = self.ws_connection
        if connection is None or connection.is_closing():  # `on_close` follows
            return
        stream, sent = connection.stream, 0
        try:
            if not stream.writing():
                sent = stream.socket.send(message)
        except OSError:  # it is full, or has ended, which the stream finds out too
            pass
        if sent < len(message):
            with suppress(StreamClosedError):
                stream.write(message[sent:])

    def on_message(self, message: str | bytes) -> None:
        """What a browser asks for; what is no JSON object is nothing."""
        try:
            asked = json.loads(message)
        except (ValueError, RecursionError):
            return
        if not isinstance(asked, dict):
            return
        if asked.get("do") == "shown":
            self._unshown = max(0, self._unshown - 1)
        else:
            self._received(asked)

    def on_close(self) -> None:
        """It is gone."""
        self.bridge.websocket_pool.discard(self)

    def _received(self, message: dict[str, Any]) -> None:
        if self.server.received is not None:
            self.server.received(message, self)


class _Http(HTTPServer):
    """Closes connections beyond so many at once, before they can use up the process's files."""

    def _handle_connection(self, connection: socket.socket, address: Any) -> None:
        if len(self._connections) >= CONNECTIONS:
            connection.close()
        else:
            super()._handle_connection(connection, address)


class _Application(tornado.web.Application):
    """Listens where it is bound already, whatever port it is told."""

    def __init__(self, bridge: "_Bridge", server: Server, listening: socket.socket) -> None:
        folder = f"/{server.secret}/"
        routes: list[Any] = [(f"{folder}(.*)", _File, {"server": server})]
        if server.live:
            own = {"bridge": bridge, "server": server}
            routes.insert(0, (f"{folder}(socket)", Browser, own))
        super().__init__(
            routes,
            default_handler_class=_Nothing,
            default_handler_args={"server": server},
            log_function=lambda handler: None,
            websocket_ping_interval=PATIENCE,
            websocket_ping_timeout=PATIENCE,
            websocket_max_message_size=4096,
        )
        self._listening = listening

    def listen(self, port: int, *_: Any, **__: Any) -> HTTPServer:
        http = _Http(
            self,
            idle_connection_timeout=PATIENCE,
            body_timeout=PATIENCE,
            max_body_size=4096,
            max_header_size=16384,
        )
        http.add_socket(self._listening)
        self.http = http
        return http


class _Replies:
    """Stands in for the ZeroMQ socket on which meshcat's bridge answers: nobody asks it."""

    def send(self, reply: bytes) -> None:
        if reply.startswith(b"error"):
            raise ValueError(reply.decode())


class _Bridge(ZMQWebSocketBridge):
    """Meshcat's bridge between drawing commands and browsers, without a ZeroMQ socket."""

    def __init__(self, server: Server, listening: socket.socket) -> None:
        self._server, self._listening = server, listening
        super().__init__(zmq_url="none", port=server.port)

    def make_app(self) -> _Application:
        return _Application(self, self._server, self._listening)

    def setup_zmq(self, url: str) -> tuple[Any, None, str]:
        return _Replies(), None, url

    def publish(self, frame: bytes) -> None:
        message = framed(frame)
        for browser in self.websocket_pool:
            browser.offer(message)

    def tell(self, message: bytes | str, browser: Browser | None) -> None:
        sent = framed(message)
        for each in self.websocket_pool if browser is None else (browser,):
            each.say(sent)

    def forward_to_websockets(self, frames: list[bytes]) -> None:
        self.tell(frames[2], None)

    async def stop(self) -> None:
        self.app.http.stop()
        for browser in list(self.websocket_pool):
            browser.close(1001, "the simulation has ended")
        await self.app.http.close_all_connections()
        while self.websocket_pool:  # until they have closed their side too
            await asyncio.sleep(0.01)
