"""The server, which answers only browsers that send its token.

Slow clients do not delay others: a request has a deadline, and the number of connections has a limit. Beyond the limit a new
connection replaces the one that has waited longest for its request.

A foreign page in the same browser has no access either. Its requests name another host (DNS rebinding) or another origin
(Sec-Fetch-Site), and no header allows it to read an answer (CORS). The browser also blocks embedded content of this server
(Cross-Origin-Resource-Policy).
"""

from __future__ import annotations

import errno
import hmac
import io
import ipaddress
import re
import secrets
import socket
import sys
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from http.server import BaseHTTPRequestHandler
from itertools import islice
from socketserver import TCPServer, ThreadingMixIn
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

from viewsphere.errors import UserError, ViewsphereError
from viewsphere.printable import printable
from viewsphere.report.paths import without_folders
from viewsphere.view.answers import Answer, Answers
from viewsphere.view.live import Live

PORT = 8642
LOOPBACK = "127.0.0.1"

QUIET = 30.0
"""Seconds from an answer (or the start) until the next request is complete: browsers keep idle connections this long."""

MOST_CONNECTIONS = 256
"""Connections at once, each a thread. A browser opens 6; half of a usual limit of 1,024 open files stays free for pictures."""

MOST_HEAD = 32_768
"""Maximum bytes of a request's line and headers; a browser with a large cookie jar sends half as many."""

CROWDED = 0.05
"""Seconds to wait if the system provides no more connections, so that the server does not spin."""

TOKEN = re.compile(r"[A-Za-z0-9_-]{16,256}")
"""The form of a token, which is part of an address and a cookie."""

WORD = re.compile(rb"[A-Za-z0-9_-]{16,}")
"""Parts of a request that may be a token."""

WITHOUT_TOKEN = "expected the address that viewsphere view printed, with its token"

TEXT = "text/plain; charset=utf-8"

MOST_PARAMETERS = 40
"""Maximum number of parameters in a request."""

GUARD = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
"""Sent with every answer."""

NOTHING = "default-src 'none'; frame-ancestors 'none'"
"""The policy of answers other than pages; a page declares in its head what it may load."""

OWN_SITES = ("same-origin", "none")
"""Values of a browser's header for requests from this server's page, or from no page."""


@dataclass(frozen=True)
class Address:
    """The address to listen at; `port` 0 means any free port. Without a token the server makes one."""

    host: str = LOOPBACK
    port: int = PORT
    token: str | None = None

    @property
    def is_loopback(self) -> bool:
        """Return whether only this machine can reach the address."""
        if self.host == "localhost":
            return True
        address = _address(self.host)
        return address is not None and address.is_loopback


class Server(ThreadingMixIn, TCPServer):
    """A server for one data set at an address. Raises UserError if it cannot listen there.

    It is a plain `TCPServer`, because http.server's own class queries a name server for this machine's name first.
    """

    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = 64

    def __init__(self, live: Live, address: Address) -> None:
        if address.token is not None and not TOKEN.fullmatch(address.token):
            raise UserError("--token: use 16 to 256 letters, digits, - and _, or leave the option out to get a random token")
        self.token = address.token or secrets.token_urlsafe(24)
        self.answers, self.address, self.lines = Answers(live), address, _Lines()
        try:
            info = socket.getaddrinfo(address.host, address.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
            self.address_family = info[0]
            super().__init__((address.host, address.port), _Handler)
        except socket.gaierror as error:
            raise UserError(f"--host {address.host}: expected an address of this machine, found: {error.strerror}") from None
        except (OSError, OverflowError) as error:
            raise UserError(_refused(address, error)) from None

    @property
    def port(self) -> int:
        """The port that it listens at."""
        return self.server_address[1]

    @property
    def url(self) -> str:
        """The address to open in a browser, with the token."""
        host = {"0.0.0.0": socket.gethostname(), "::": socket.gethostname()}.get(self.address.host, self.address.host)
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{self.port}/?{urlencode({'token': self.token})}"

    @property
    def cookie(self) -> str:
        """The name of the token's cookie; it contains the port, because cookies do not distinguish ports."""
        return f"viewsphere-{self.port}"

    def names(self, host: str) -> bool:
        """Return whether a request's Host is this server's, and not a foreign name that resolves to it."""
        name, port = _parted(host)
        if port != self.port:
            return False
        if self.address.is_loopback:
            return name in {"localhost", "127.0.0.1", "::1", self.address.host.lower()}
        # Nobody else can own an IP address as a name, and its requests need the token as well.
        return _address(name) is not None or name in {"localhost", self.address.host.lower(), socket.gethostname().lower()}

    def get_request(self) -> tuple[socket.socket, Any]:
        """The next connection. If the system provides no more, the connection that is silent longest ends; raises OSError."""
        try:
            return super().get_request()
        except OSError as error:
            if error.errno in (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM):
                self.lines.end_oldest()
                time.sleep(CROWDED)
            raise

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in a separate thread."""
        self.lines.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        """Close a connection."""
        self.lines.remove(request)
        super().shutdown_request(request)

    def service_actions(self) -> None:
        """End connections whose request is incomplete at its deadline."""
        self.lines.end_late()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report an internal error in one line, and ignore closed connections; other requests continue."""
        error = sys.exc_info()[1]
        if not isinstance(error, (ConnectionError, TimeoutError)):
            self.complain(error)

    def complain(self, error: BaseException | None) -> None:
        """Print an internal error for the user who runs the server."""
        print(printable(f"viewsphere: view: {type(error).__name__}: {error}"), file=sys.stderr)  # noqa: T201


class _Lines:
    """The open connections, each with the time at which the server began to wait for its request."""

    def __init__(self) -> None:
        self._waiting: dict[socket.socket, float] = {}
        self._answered: dict[socket.socket, None] = {}
        self._lock = threading.Lock()

    def add(self, line: socket.socket) -> None:
        """Count a new connection; if there are too many, the one that is silent longest ends."""
        with self._lock:
            is_crowded = len(self._waiting) + len(self._answered) >= MOST_CONNECTIONS
        if is_crowded:
            self.end_oldest()
        self.wait(line)

    def wait(self, line: socket.socket) -> None:
        """Note that the server now waits for a request on a connection."""
        with self._lock:
            self._answered.pop(line, None)
            self._waiting[line] = time.monotonic()

    def hear(self, line: socket.socket) -> None:
        """Note that a connection's request is complete."""
        with self._lock:
            self._waiting.pop(line, None)
            self._answered[line] = None

    def remove(self, line: socket.socket) -> None:
        """Note that a connection is closed."""
        with self._lock:
            self._waiting.pop(line, None)
            self._answered.pop(line, None)

    def end_oldest(self) -> None:
        """End the connection that has waited longest for its request, else the one that takes longest to read its answer."""
        with self._lock:
            for line in (*islice(self._waiting, 1), *islice(self._answered, 1))[:1]:
                self._end(line)

    def end_late(self) -> None:
        """End the connections that have waited longer than `QUIET` for their request."""
        with self._lock:
            past = time.monotonic() - QUIET
            for line in [line for line, since in self._waiting.items() if since < past]:
                self._end(line)

    def _end(self, line: socket.socket) -> None:
        self._waiting.pop(line, None)
        self._answered.pop(line, None)
        with suppress(OSError):  # it may have ended by now
            line.shutdown(socket.SHUT_RDWR)  # its thread reads the end, and closes it


def _parted(host: str) -> tuple[str, int | None]:
    """The name, in lower case, and the port of a Host; None for an invalid port."""
    found = re.fullmatch(r"(\[[0-9a-fA-F:.]+\]|[^\[\]:/\\@\s]+)(?::([0-9]{1,5}))?", host)
    if found is None:
        return "", None
    return found[1].strip("[]").lower(), int(found[2] or 80)


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


def _refused(address: Address, error: Exception) -> str:
    """Return the reason why the server cannot listen at an address, and the fix."""
    code = error.errno if isinstance(error, OSError) else None
    if code == errno.EADDRINUSE:
        return (
            f"--port {address.port}: expected a free port, found one that another program listens at: choose another, or 0 "
            "for any that is free"
        )
    if code == errno.EADDRNOTAVAIL:
        return f"--host {address.host}: expected an address of this machine, found another: 0.0.0.0 means all it has"
    if code == errno.EACCES:
        return f"--port {address.port}: expected a port that one may listen at, found a reserved one: choose one from 1024 on"
    return f"--port {address.port}: expected to listen at {address.host}, found: {error}"


class _Handler(BaseHTTPRequestHandler):
    server: Server  # pyright: ignore[reportIncompatibleVariableOverride]
    protocol_version = "HTTP/1.1"
    server_version = "viewsphere"
    sys_version = ""
    timeout = QUIET
    raw_requestline: bytes

    def do_GET(self) -> None:
        self._answer()

    def do_HEAD(self) -> None:
        self._answer()

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing, because a page sends a dozen requests a second."""

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Refuse in one line of text and close the connection, because any further data on it is unreliable."""
        self.close_connection = True
        self._send(HTTPStatus(code), Answer(f"{message or HTTPStatus(code).phrase}\n".encode("utf-8", "replace"), TEXT))

    def handle_one_request(self) -> None:
        """Wait for a request, and answer it."""
        self.server.lines.wait(self.connection)
        super().handle_one_request()

    def parse_request(self) -> bool:
        """Return whether there is a request to answer. Headers are parsed only for requests that contain the token."""
        self.request_version, self.requestline = self.protocol_version, ""
        self.command = "HEAD" if self.raw_requestline.startswith(b"HEAD ") else "GET"
        head = self._head()
        if head is None:
            self.send_error(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE)
            return False
        self.server.lines.hear(self.connection)
        if not self._holds_token(self.raw_requestline + head):
            self.send_error(HTTPStatus.FORBIDDEN, WITHOUT_TOKEN)
            return False
        stream, self.rfile = self.rfile, io.BufferedReader(io.BytesIO(head))  # pyright: ignore[reportArgumentType]
        try:
            return super().parse_request()
        finally:
            self.rfile = stream

    def _head(self) -> bytes | None:
        """The lines of the headers up to the empty one; None if they are too long."""
        head, line = b"", self.raw_requestline
        while line not in (b"\r\n", b"\n", b""):
            left = MOST_HEAD - len(self.raw_requestline) - len(head)
            if left <= 0:
                return None
            line = self.rfile.readline(left)
            head += line
        return head

    def _holds_token(self, head: bytes) -> bool:
        """Return whether a word of the head is the token, compared in constant time; `_has_token` checks its place."""
        token = self.server.token.encode()
        return any([hmac.compare_digest(word, token) for word in WORD.findall(head)])

    def _answer(self) -> None:
        if refusal := self._refusal():
            self.send_error(*refusal)
            return
        target = urlsplit(self.path)
        try:
            asked = dict(parse_qsl(target.query, max_num_fields=MOST_PARAMETERS, strict_parsing=bool(target.query)))
        except ValueError:
            self.send_error(HTTPStatus.BAD_REQUEST)
            return
        if not self._has_token(asked):
            self.send_error(HTTPStatus.FORBIDDEN, WITHOUT_TOKEN)
            return
        if asked.pop("token", None) is not None:
            self._to_page()
            return
        try:
            answer = None if target.scheme or target.netloc else self.server.answers.answer(target.path, asked)
        except ViewsphereError as error:
            self.send_error(HTTPStatus.UNPROCESSABLE_ENTITY, without_folders(str(error)))
            return
        except Exception as error:
            self.server.complain(error)
            self.send_error(HTTPStatus.INTERNAL_SERVER_ERROR)
            return
        if answer is None:
            self.send_error(HTTPStatus.NOT_FOUND)
        else:
            self._send(HTTPStatus.OK, answer)

    def _refusal(self) -> tuple[HTTPStatus, str] | None:
        """Return the error of a request, independent of its path; None for a valid one."""
        hosts = self.headers.get_all("Host", [])
        if len(hosts) != 1:
            return HTTPStatus.BAD_REQUEST, "expected one Host"
        if not self.server.names(hosts[0]):
            return HTTPStatus.MISDIRECTED_REQUEST, "expected the address that viewsphere view printed"
        is_visit = self.headers.get("Sec-Fetch-Mode") == "navigate" and self.headers.get("Sec-Fetch-Dest") == "document"
        if self.headers.get("Sec-Fetch-Site", "none") not in OWN_SITES and not is_visit:
            return HTTPStatus.FORBIDDEN, "expected a request of this server's own page"
        if self.headers.get("Content-Length", "0") != "0" or "Transfer-Encoding" in self.headers:
            return HTTPStatus.BAD_REQUEST, "expected no body"
        return None

    def _has_token(self, asked: Mapping[str, str]) -> bool:
        """Return whether the token is in the address, the cookie or the header Authorization, compared in constant time."""
        try:
            cookie = SimpleCookie(self.headers.get("Cookie", "")).get(self.server.cookie)
        except CookieError:
            cookie = None
        bearer = self.headers.get("Authorization", "").removeprefix("Bearer ")
        given = (asked.get("token", ""), cookie.value if cookie else "", bearer)
        token = self.server.token.encode()
        return any([hmac.compare_digest(one.encode("utf-8", "replace"), token) for one in given])

    def _to_page(self) -> None:
        """Store the token in a cookie, so that no shown, stored or forwarded address contains it."""
        cookie = f"{self.server.cookie}={self.server.token}; Path=/; HttpOnly; SameSite=Strict"
        self._send(HTTPStatus.SEE_OTHER, Answer(b"", TEXT), {"Location": "/", "Set-Cookie": cookie})

    def _send(self, status: HTTPStatus, answer: Answer, extra: Mapping[str, str] | None = None) -> None:
        self.send_response(status)
        keep = f"private, max-age={answer.keep}, immutable" if answer.keep else "no-store"
        policy = "frame-ancestors 'none'" if answer.kind.startswith("text/html") else NOTHING
        own = {"Content-Type": answer.kind, "Content-Length": str(len(answer.body)), "Cache-Control": keep}
        own["Content-Security-Policy"] = policy
        for name, value in {**own, **GUARD, **(extra or {})}.items():
            self.send_header(name, value)
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(answer.body)
