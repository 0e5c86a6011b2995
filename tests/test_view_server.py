"""The page's server: whom it listens to, whom it answers, and that nobody waits for a browser."""

import asyncio
import socket
import threading
import time
from urllib.parse import urlparse

import psutil
import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from gne_mj.errors import InvalidInput
from gne_mj.viewer.pack import pack
from gne_mj.viewer.server import CONNECTIONS, UNSHOWN, Server


@pytest.fixture
def static():
    server = Server("a replay", replay=b"the pack")
    yield server
    server.close()


class Asked:
    """A live page's owner: welcomes browsers, and keeps what they say."""

    def __init__(self):
        self.messages = []
        self.server = Server("live", received=self)

    def __call__(self, message, browser):
        self.messages.append(message)
        if message.get("do") == "connect":
            self.server.welcome(browser, [pack({"kind": "scene"}, {})])


@pytest.fixture
def live():
    asked = Asked()
    yield asked
    asked.server.close()


def get(url, **headers):
    async def fetch():
        try:
            return await AsyncHTTPClient().fetch(HTTPRequest(url, headers=headers))
        except HTTPClientError as error:
            return error.response

    return asyncio.run(fetch())


async def connect(server, origin=None, **headers):
    origin = origin or f"http://127.0.0.1:{server.port}"
    url = server.url.replace("http://", "ws://") + "socket"
    return await websocket_connect(
        HTTPRequest(url, headers={"Origin": origin, **headers}), max_message_size=2**26
    )


def test_it_listens_on_the_loopback_address_only(static):
    listening = {
        connection.laddr
        for connection in psutil.Process().net_connections("inet")
        if connection.status == psutil.CONN_LISTEN
    }
    assert [at.ip for at in listening if at.port == static.port] == ["127.0.0.1"]
    # not even the ports that meshcat's own server takes
    assert not [at for at in listening if at.port in range(6000, 6100) or at.port == 7000]
    assert {at.ip for at in listening} <= {"127.0.0.1", "::1"}


def test_other_addresses_of_the_machine_are_refused(static):
    for family, address in ((socket.AF_INET, "127.0.0.2"), (socket.AF_INET6, "::1")):
        with socket.socket(family) as one:
            one.settimeout(2)
            assert one.connect_ex((address, static.port)) != 0


def test_the_page_its_files_and_the_pack_are_served(static):
    page = get(static.url)
    assert page.code == 200
    assert b'{"mode": "served"}' in page.body
    assert b"<title>a replay</title>" in page.body
    assert "default-src 'none'" in page.headers["Content-Security-Policy"]
    assert page.headers["X-Content-Type-Options"] == "nosniff"
    assert get(static.url + "replay").body == b"the pack"
    assert get(static.url + "page.js").headers["Content-Type"].startswith("text/javascript")
    assert b"MeshCat" in get(static.url + "meshcat.min.js").body


@pytest.mark.parametrize(
    "name",
    ["nothing.js", "../server.py", "..%2Fserver.py", "vendor/../../server.py", "vendor", "%00.js",
     "/etc/passwd", "vendor/..%2F..%2F__init__.py", "socket"],
)  # fmt: skip
def test_nothing_else_is(static, name):
    assert get(static.url + name).code in (400, 404)


@pytest.mark.slow
def test_connections_are_limited(static):
    idle = [socket.create_connection(("127.0.0.1", static.port)) for _ in range(3 * CONNECTIONS)]
    time.sleep(0.2)
    closed = 0
    for one in idle:
        one.settimeout(0.02)
        try:
            closed += one.recv(1) == b""
        except TimeoutError:
            pass
        except ConnectionError:
            closed += 1
    for one in idle:
        one.close()
    assert closed == 2 * CONNECTIONS
    time.sleep(0.2)
    assert get(static.url).code == 200


def test_without_the_secret_there_is_nothing(static):
    root = f"http://127.0.0.1:{static.port}/"
    for path in ("", "replay", "page.js", "x" * len(static.secret) + "/"):
        answer = get(root + path)
        assert answer.code == 404
        assert answer.headers["Server"] == "gne-mj"
    other = Server("another", replay=b"")
    other.close()
    assert urlparse(other.url).path != urlparse(static.url).path


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "localhost:1"]
)
def test_a_name_that_was_made_to_point_here_is_refused(static, host):
    # as of DNS rebinding: the browser thinks that it talks to another site
    assert get(static.url, Host=host.format(port=static.port)).code == 403
    assert get(static.url, Host=f"localhost:{static.port}").code == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1:{port}"])
def test_other_pages_cannot_connect(live, origin):
    with pytest.raises(HTTPClientError, match="403"):
        asyncio.run(connect(live.server, origin.format(port=live.server.port)))
    assert live.messages == []


def test_another_host_cannot_connect(live):
    with pytest.raises(HTTPClientError, match="403"):
        asyncio.run(connect(live.server, Host="evil.example"))


def test_what_is_no_message_is_nothing(live):
    async def talk():
        one = await connect(live.server)
        for text in ("", "no json", "[1]", "7", "[" * 4000, '{"do": "pause"}'):
            await one.write_message(text)
        await one.write_message(b"\x00\x01", binary=True)
        await wait_for(lambda: {"do": "pause"} in live.messages)
        await leave(one)

    asyncio.run(talk())
    assert live.messages == [{"do": "connect"}, {"do": "pause"}]


def test_a_long_message_ends_the_connection(live):
    async def talk():
        one = await connect(live.server)
        await one.write_message("x" * 5000)
        await ended(one)
        one.close()

    asyncio.run(talk())


def test_a_browser_that_shows_nothing_gets_no_more_frames(live):
    frame = pack({"kind": "frame"}, {})

    async def talk():
        slow, quick = await connect(live.server), await connect(live.server)
        await wait_for(lambda: len(live.server.browsers) == 2)
        for browser in (slow, quick):
            await browser.read_message()  # the scene
        shown = 0
        for _ in range(20):
            live.server.publish(frame)
            assert await asyncio.wait_for(quick.read_message(), 5) == frame
            await quick.write_message('{"do": "shown"}')
            shown += 1
            await asyncio.sleep(0.01)
        live.server.tell({"kind": "notice"})
        received = []
        while not isinstance(message := await slow.read_message(), str):
            received.append(message)
        await leave(slow)
        await wait_for(lambda: len(live.server.browsers) == 1)
        live.server.publish(frame)
        assert await asyncio.wait_for(quick.read_message(), 5)
        await leave(quick)
        return shown, len(received)

    assert asyncio.run(talk()) == (20, UNSHOWN)


def test_publishing_never_waits(live):
    frame = pack({"kind": "frame"}, {"poses": __import__("numpy").zeros((1000, 8))})

    async def talk():
        stuck = await connect(live.server)
        await wait_for(lambda: live.server.browsers)
        for _ in range(2000):  # 128 MB, which no socket's buffer takes
            live.server.publish(frame)
        await wait_for(lambda: live.server.dropped >= 1990)
        await leave(stuck)

    asyncio.run(talk())


@pytest.mark.parametrize("length", [0, 125, 126, 65535, 65536])
def test_messages_of_every_length_arrive(live, length):
    """Tornado's client reads how long they are said to be."""

    async def talk():
        one = await connect(live.server)
        await wait_for(lambda: live.server.browsers)
        await one.read_message()  # the scene
        live.server.broadcast(bytes(length))
        live.server.tell({"kind": "x" * length})
        assert await asyncio.wait_for(one.read_message(), 5) == bytes(length)
        assert await asyncio.wait_for(one.read_message(), 5) == f'{{"kind": "{"x" * length}"}}'
        await leave(one)

    asyncio.run(talk())


def test_what_a_socket_does_not_take_at_once_comes_later_and_in_order(live):
    async def talk():
        one = await connect(live.server)
        await wait_for(lambda: live.server.browsers)
        await one.read_message()  # the scene
        for number in range(4):
            live.server.broadcast(bytes([number]) * 6_000_000)  # more than its buffers have room
            live.server.tell({"number": number})
        await asyncio.sleep(0.2)
        for number in range(4):
            assert await asyncio.wait_for(one.read_message(), 5) == bytes([number]) * 6_000_000
            assert await asyncio.wait_for(one.read_message(), 5) == f'{{"number": {number}}}'
        await leave(one)

    asyncio.run(talk())


def test_a_port_can_be_chosen_unless_it_is_taken(static):
    with pytest.raises(InvalidInput, match=f"^port: got {static.port}, but it cannot be listened"):
        Server("another", replay=b"", port=static.port)
    port = static.port
    static.close()
    again = Server("another", replay=b"", port=port)
    assert again.port == port
    again.close()


def test_closing_ends_the_thread_and_the_connections(live):
    async def talk():
        one = await connect(live.server)
        await wait_for(lambda: live.server.browsers)
        closing = threading.Thread(target=live.server.close)
        closing.start()
        await ended(one)
        one.close()
        closing.join()
        return one.close_code

    assert asyncio.run(talk()) == 1001
    assert not live.server._thread.is_alive()
    live.server.publish(b"")  # as a simulation that goes on would
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", live.server.port)) != 0


async def leave(connection):
    connection.close()
    await ended(connection)


async def ended(connection):
    while await asyncio.wait_for(connection.read_message(), 5) is not None:
        pass


async def wait_for(condition, patience=5.0):
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, "it never came true"
        await asyncio.sleep(0.01)


def test_a_program_that_ends_is_not_kept_alive(static):
    """By a page that it has not closed."""
    threads = [thread for thread in threading.enumerate() if thread.name == "gne-mj view"]
    assert len(threads) == 1
    assert threads[0].daemon
