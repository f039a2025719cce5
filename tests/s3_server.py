"""A server that speaks S3 on loopback, and a proxy before it that answers wrongly when it is told to."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

BUCKET = "pictures"
KEYS = {"AWS_ACCESS_KEY_ID": "known", "AWS_SECRET_ACCESS_KEY": "s3cr3t-word", "AWS_DEFAULT_REGION": "us-east-1"}

Fault = Callable[[str, str], str]
"""What to do with a request of this method and path: "" (nothing), "500", "503", "slow", "cut" or "drop"."""


@dataclass
class Faults:
    """What the proxy does; `asked` are all requests so far, `hit` those that were answered wrongly."""

    fault: Fault = lambda method, path: ""
    asked: list[tuple[str, str]] = field(default_factory=list)
    hit: list[tuple[str, str]] = field(default_factory=list)

    def first(self, kind: str, times: int, part: str = "", method: str = "") -> None:
        """Answer the first so many requests of each path that has this part, and this method, wrongly."""
        seen: dict[tuple[str, str], int] = {}

        def fault(asked: str, path: str) -> str:
            if part not in path or method not in asked:
                return ""
            seen[asked, path] = seen.get((asked, path), 0) + 1
            return kind if seen[asked, path] <= times else ""

        self.fault = fault

    def always(self, kind: str, part: str = "", method: str = "") -> None:
        """Answer all requests of such paths wrongly."""
        self.fault = lambda asked, path: kind if part in path and method in asked else ""

    def none(self) -> None:
        """Answer rightly."""
        self.fault = lambda method, path: ""


@contextmanager
def s3_server() -> Generator[tuple[str, Faults]]:
    """The proxy's URL, and what it does; the bucket is there, and is empty."""
    from moto.server import ThreadedMotoServer

    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    faults = Faults()
    host, port = server.get_host_and_port()
    proxy = ThreadingHTTPServer(("127.0.0.1", 0), _handler(host, port, faults))
    proxy.daemon_threads = True
    threading.Thread(target=proxy.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{proxy.server_port}", faults
    finally:
        proxy.shutdown()
        proxy.server_close()
        server.stop()


def _handler(host: str, port: int, faults: Faults) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def _pass_on(self) -> None:
            body = self._body()
            kind = faults.fault(self.command, self.path)
            faults.asked.append((self.command, self.path))
            if kind:
                faults.hit.append((self.command, self.path))
            if kind in {"500", "503"}:
                self._refuse(int(kind))
                return
            if kind == "drop":
                self.close_connection = True
                return
            if kind == "slow":
                time.sleep(0.05)
            upstream = HTTPConnection(host, port)
            upstream.request(self.command, self.path, body, dict(self.headers.items()))
            answer = upstream.getresponse()
            data = answer.read()
            self.send_response_only(answer.status)
            for name, value in answer.getheaders():
                if name.lower() not in {"transfer-encoding", "connection", "content-length"}:
                    self.send_header(name, value)
            length = answer.getheader("Content-Length") if self.command == "HEAD" else str(len(data))
            self.send_header("Content-Length", length or "0")
            self.end_headers()
            if kind == "cut" and len(data) > 1:
                data, self.close_connection = data[: len(data) // 2], True
            self.wfile.write(data)
            upstream.close()

        def _body(self) -> bytes:
            if self.headers.get("Transfer-Encoding", "").lower() == "chunked":
                data = b""
                while size := int(self.rfile.readline().split(b";")[0], 16):
                    data += self.rfile.read(size)
                    self.rfile.readline()
                self.rfile.readline()
                del self.headers["Transfer-Encoding"]
                return data
            return self.rfile.read(int(self.headers.get("Content-Length") or 0))

        def _refuse(self, status: int) -> None:
            code = "SlowDown" if status == 503 else "InternalError"
            data = f"<Error><Code>{code}</Code><Message>please wait</Message></Error>".encode()
            self.send_response_only(status)
            self.send_header("Content-Length", str(0 if self.command == "HEAD" else len(data)))
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(data)

        do_GET = do_PUT = do_POST = do_HEAD = do_DELETE = _pass_on

        def log_message(self, format: str, *args: object) -> None:
            pass

    return Handler


def make_bucket() -> None:
    """Make the bucket, empty, at the endpoint that the environment names."""
    import s3fs

    system = s3fs.S3FileSystem(endpoint_url=os.environ["AWS_ENDPOINT_URL"], skip_instance_cache=True)
    if system.exists(BUCKET):
        system.rm(BUCKET, recursive=True)
    system.mkdir(BUCKET)
