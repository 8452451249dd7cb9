"""Connections that say nothing or leave: the page answers, and the terminal is quiet."""

import json
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from http.client import HTTPConnection
from pathlib import Path

import pytest

from hybridnav.errors import InvalidValueError
from hybridnav.ext.page import app, serve
from tests.ext.page.server import TOKEN, Client, folder_in, served, site_of

HEAD = f"POST /{TOKEN}/plan HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n"
BODY = "Content-Type: application/json\r\nContent-Length: 100\r\n\r\n{"
PATIENCE_S = 20.0


@pytest.fixture
def client(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Iterator[Client]:
    """A server that waits for half a second, and must say nothing."""
    monkeypatch.setattr(app, "REQUEST_S", 0.5)
    folder = folder_in(tmp_path)
    with served(site_of(folder / "four.yaml"), folder) as client:
        yield client
        assert client.get("floor/0/rooms.json").code == 200  # it still answers
    assert capfd.readouterr().err == ""


def opened(client: Client, text: str) -> socket.socket:
    """Return a connection on which a text was sent."""
    made = socket.create_connection(("127.0.0.1", client.port), timeout=PATIENCE_S)
    made.sendall(text.replace("PORT", str(client.port)).encode())
    return made


def is_over(connection: socket.socket) -> bool:
    """Whether the server has ended a connection."""
    connection.setblocking(False)
    try:
        return connection.recv(1) == b""
    except BlockingIOError:
        return False
    except ConnectionError:
        return True


def test_the_page_answers_beside_four_hundred_connections_that_wait(client, monkeypatch):
    monkeypatch.setattr(app, "REQUEST_S", 600.0)
    with ExitStack() as stack:
        made = [stack.enter_context(opened(client, HEAD)) for _ in range(400)]
        assert client.get("floor/0/map.json").code == 200
        still = [one for one in made if not is_over(one)]
        assert 0 < len(still) <= app.MOST_CONNECTIONS
        # Those that have waited longest go first.
        assert still == made[-len(still) :]


@pytest.mark.parametrize("text", ["", "GET", HEAD, HEAD + BODY])
def test_a_request_that_does_not_end_is_ended(client: Client, text: str) -> None:
    with opened(client, text) as waiting:
        deadline = time.monotonic() + PATIENCE_S
        while not is_over(waiting) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert is_over(waiting)


def test_a_request_that_trickles_is_ended(client: Client) -> None:
    with opened(client, HEAD) as slow:
        deadline = time.monotonic() + PATIENCE_S
        with suppress(ConnectionError):
            while time.monotonic() < deadline:
                slow.sendall(b"a")
                time.sleep(0.05)
        assert time.monotonic() < deadline


@pytest.mark.parametrize("text", [HEAD, HEAD + BODY])
def test_a_client_that_leaves_is_no_error(client: Client, text: str) -> None:
    for _ in range(5):
        opened(client, text).close()
    time.sleep(0.2)


def test_a_connection_that_asks_twice_slowly_is_kept(client: Client) -> None:
    with closing(HTTPConnection("127.0.0.1", client.port, timeout=PATIENCE_S)) as kept:
        ports = set()
        for _ in range(3):
            kept.request("GET", f"/{TOKEN}/floor/0/rooms.json")
            ports.add(kept.sock.getsockname())
            assert json.loads(kept.getresponse().read())["rooms"]
            time.sleep(0.7)  # longer than a request may take
    assert len(ports) == 1


def test_a_port_that_is_none_is_refused(tmp_path: Path) -> None:
    site = site_of(folder_in(tmp_path) / "four.yaml")
    with pytest.raises(InvalidValueError, match="port 70000 cannot be used: expected one from 0"):
        serve(site, tmp_path, port=70_000)
