"""What the server answers to strangers, byte by byte: nothing that lies beside the data set, nothing without its name."""

import errno
import json
import re
import shutil
import socket
import time
from contextlib import suppress
from socketserver import TCPServer

import pytest

from deadline import DEADLINE, until
from viewsphere.errors import UserError
from viewsphere.view import Address, Live, Server
from viewsphere.view import server as server_module

TOKEN = "a-token_of-32-letters-and-digits"
SECRET = "the-secret-of-another-folder"


def tell(server, request, host="127.0.0.1"):
    """All that a server says to these bytes, until it hangs up."""
    found = b""
    with socket.create_connection((host, server.port), DEADLINE) as line, suppress(ConnectionError):
        line.sendall(request if isinstance(request, bytes) else request.encode())
        with suppress(OSError):  # it may have hung up by now
            line.shutdown(socket.SHUT_WR)
        while block := line.recv(65536):
            found += block
    return found


def get(server, target, *, host=None, method="GET", with_token=True, **headers):
    """Status, headers in lower case, and body of an answer."""
    if with_token:
        headers = {"Authorization": f"Bearer {server.token}", **headers}
    lines = [f"{method} {target} HTTP/1.1", f"Host: {host or f'127.0.0.1:{server.port}'}"]
    lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
    return parted(tell(server, "\r\n".join([*lines, "Connection: close", "", ""])))


def parted(answer):
    head, _, body = answer.partition(b"\r\n\r\n")
    first, *lines = head.decode("latin-1").split("\r\n")
    headers = {name.lower(): value for name, _, value in (line.partition(": ") for line in lines)}
    return int(first.split()[1]), headers, body


@pytest.fixture
def server(serve, small_run):
    """A server of the small run that has read all its frames."""
    server = serve(small_run)
    assert until(lambda: json.loads(get(server, "/state")[2])["read"] == 12)
    return server


def test_rows_pictures_and_counts(server):
    status, headers, body = get(server, "/rows?first=2&count=3&order=frame")
    assert (status, headers["content-type"], headers["cache-control"]) == (200, "application/json", "no-store")
    answer = json.loads(body)
    assert answer["total"] == 12
    assert [row["index"] for row in answer["rows"]] == [2, 3, 4]
    layers = answer["rows"][0]["layers"]
    assert {"rgb", "rgbLarge", "depth", "normals", "parts", "coordinates"} <= layers.keys()
    for path in layers.values():
        status, headers, body = get(server, f"/{path}")
        assert (status, headers["content-type"], body[8:12]) == (200, "image/webp", b"WEBP")
    low, high = json.loads(get(server, "/range?frame=2&layer=depth")[2])
    assert 0 < low < high
    assert json.loads(get(server, "/range?frame=2&layer=rgb")[2]) is None
    assert json.loads(get(server, "/state")[2])["planned"] == 12
    assert json.loads(get(server, "/facts")[2])["folder"] == "out"
    key = answer["rows"][0]["objects"][0]["model"]
    assert json.loads(get(server, f"/model?key={key}")[2])["mesh"]


def test_a_page_of_rows_has_an_end(server):
    assert len(json.loads(get(server, "/rows?first=0&count=999999999999")[2])["rows"]) == 12
    assert json.loads(get(server, "/rows?first=99999999999999999&count=9")[2])["rows"] == []


@pytest.mark.parametrize(
    "target",
    [
        "/../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/..%2f..%2fetc/passwd",
        "/..\\..\\etc\\passwd",
        "//etc/passwd",
        "/etc/passwd",
        "/store/plan.json",
        "/store/../store/plan.json",
        "/state/",
        "/State",
        "/picture/",
        "http://127.0.0.1/state",
        "file:///etc/passwd",
        "*",
        "state",
        "/web/main.js",
        "/\x00state".replace("\x00", "%00"),
    ],
)
def test_no_path_is_a_file(server, target):
    status, _, body = get(server, target)
    assert status == 404
    assert b"root:" not in body


@pytest.mark.parametrize(
    "target",
    [
        "/picture?frame=../../etc/passwd&layer=rgb",
        "/picture?frame=0&layer=../../../../etc/passwd",
        "/picture?frame=0&layer=%2e%2e%2f%2e%2e%2fplan.json",
        "/picture?frame=99&layer=rgb",
        "/picture?frame=-1&layer=rgb",
        "/picture?frame=0",
        "/picture",
        "/model?key=../../../../etc/passwd",
        "/model?key=",
        "/rows",
        "/rows?first=0&count=-1",
        f"/rows?first={'9' * 5000}&count=1",
        "/rows?first=0&count=1&file=/etc",
        "/range?frame=0&layer=/etc/passwd",
    ],
)
def test_no_parameter_is_a_file(server, target):
    status, _, body = get(server, target)
    assert status == 422
    assert b"expected" in body or b"is unknown" in body
    assert b"root:" not in body


@pytest.mark.parametrize("inside", ["rgb", "frames.json", "shot.json", "manifest.json"])
@pytest.mark.slow
def test_links_that_lead_out_of_the_data_set_are_not_followed(serve, small_dataset, tmp_path, inside):
    folder = small_dataset.store.shot_folder(next(iter(sorted(small_dataset.store.finished()))))
    first = small_dataset.plan.find(folder.name).first
    file = folder / inside if "." in inside else folder / inside / f"{first:08d}.png"
    outside = tmp_path / f"outside{file.suffix}"
    shutil.move(file, outside)
    if inside == "frames.json":
        outside.write_text(outside.read_text().replace('"index"', f'"{SECRET}": 1, "index"'))
    file.symlink_to(outside)
    server = serve(small_dataset.root)
    for target in (f"/picture?frame={first}&layer=rgb", "/rows?first=0&count=12", "/state"):
        status, _, body = get(server, target)
        assert status in {200, 422}
        assert SECRET.encode() not in body
        assert body[8:12] != b"WEBP"


@pytest.mark.parametrize("file", ["skipped.json", "models/post_box_000/model.json"])
def test_what_is_told_of_models_is_no_link_out(serve, small_dataset, tmp_path, file):
    inside = small_dataset.store.folder / file
    outside = tmp_path / "outside.json"
    if inside.exists():
        shutil.move(inside, outside)
    outside.write_text(json.dumps({"post_box_000": SECRET}))
    inside.symlink_to(outside)
    server = serve(small_dataset.root)
    for target in ("/state", "/facts", "/summary", "/model?key=post_box_000", "/rows?first=0&count=12"):
        assert SECRET.encode() not in get(server, target)[2]


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Sec_Fetch_Site": "same-origin"}, 200),
        ({"Sec_Fetch_Site": "none"}, 200),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"Sec_Fetch_Site": "same-site"}, 403),
        ({"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "iframe"}, 403),
        ({"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "document"}, 200),
    ],
)
def test_a_page_of_another_site_may_link_here_and_no_more(server, headers, status):
    assert get(server, "/state", **headers)[0] == status


def test_no_other_site_reads_an_answer(server):
    headers = get(server, "/state", Origin="http://evil.example")[1]
    assert not [name for name in headers if name.startswith("access-control-")]
    assert get(server, "/state", method="OPTIONS", Origin="http://evil.example")[0] == 501


def test_only_the_page_s_own_scripts_run(server):
    _, headers, body = get(server, "/")
    assert headers["content-security-policy"] == "frame-ancestors 'none'"
    policy = re.search(rb'Content-Security-Policy" content="([^"]*)"', body)[1].decode()
    nonce = re.search(r"script-src 'nonce-([\w-]{16,})'(?:;|$)", policy)[1]
    assert body.count(b"<script") == body.count(f'<script nonce="{nonce}"'.encode()) + 1  # the data, which is no script
    assert nonce not in get(server, "/")[2].decode()
    assert get(server, "/state")[1]["content-security-policy"] == "default-src 'none'; frame-ancestors 'none'"


def test_the_folder_of_a_shot_may_not_lead_out(serve, small_dataset, tmp_path):
    folder = small_dataset.store.shot_folder(next(iter(sorted(small_dataset.store.finished()))))
    first = small_dataset.plan.find(folder.name).first
    shutil.move(folder, tmp_path / "outside")
    folder.symlink_to(tmp_path / "outside")
    server = serve(small_dataset.root)
    assert get(server, f"/picture?frame={first}&layer=rgb")[0] == 422

    def problems():
        return [row["problem"] for row in json.loads(get(server, "/rows?first=0&count=12")[2])["rows"] if row["index"] == first]

    assert until(problems) and "link" in problems()[0]


def test_a_model_may_not_lead_out(serve, small_dataset, tmp_path):
    folder = small_dataset.store.model_folder(small_dataset.plan.models[0])
    shutil.move(folder, tmp_path / "outside")
    folder.symlink_to(tmp_path / "outside")
    server = serve(small_dataset.root)
    status, _, body = get(server, f"/model?key={folder.name}")
    assert status == 422 or json.loads(body)["mesh"] is None


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "localhost.evil.example:{port}", ""]
)
def test_another_host_is_refused(server, host):
    """A stranger's name that was made to lead here (DNS rebinding) is not this server's."""
    status, _, body = get(server, "/state", host=host.format(port=server.port) or " ")
    assert status in {400, 421}
    assert b"planned" not in body


@pytest.mark.parametrize("host", ["127.0.0.1:{port}", "localhost:{port}", "LOCALHOST:{port}", "[::1]:{port}"])
def test_this_host_is_answered(server, host):
    assert get(server, "/state", host=host.format(port=server.port))[0] == 200


def test_requests_that_are_none(server):
    host = f"Host: 127.0.0.1:{server.port}\r\nAuthorization: Bearer {server.token}"
    for request in (
        "GET /state HTTP/1.1\r\n\r\n",
        f"GET /state HTTP/1.1\r\n{host}\r\n{host}\r\n\r\n",
        f"GET /state HTTP/1.1\r\n{host}\r\nContent-Length: 5\r\n\r\nhello",
        f"GET /state HTTP/1.1\r\n{host}\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        f"POST /state HTTP/1.1\r\n{host}\r\n\r\n",
        f"PUT /state HTTP/1.1\r\n{host}\r\nContent-Length: 0\r\n\r\n",
        f"GET /state?{'&'.join('a=1' for _ in range(100))} HTTP/1.1\r\n{host}\r\n\r\n",
        f"GET /state extra HTTP/1.1\r\n{host}\r\n\r\n",
    ):
        answer = tell(server, request)
        assert 400 <= parted(answer)[0] < 600, request[:60]
        assert b"planned" not in answer
        assert answer.count(b"HTTP/1.1 ") == 1  # what came behind was not taken for another request
    endless = f"GET /state?a={'a' * 100_000} HTTP/1.1\r\n{host}\r\n\r\n".encode()  # hung up on before it is read
    for silence in (endless, b"GET /state HTTP/9.9\r\n\r\n", b"", b"\x00\x01\x02\r\n\r\n", b"GET /state\r\n\r\n"):
        assert b"planned" not in tell(server, silence)
    assert get(server, "/state")[0] == 200


def test_every_answer_guards_the_browser(server):
    for target in ("/", "/state", "/nothing", "/picture?frame=0&layer=rgb", "/picture?frame=x"):
        headers = get(server, target)[1]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert headers["referrer-policy"] == "no-referrer"
        assert "python" not in headers["server"].lower()


def test_head_says_how_long_the_answer_would_be(server):
    _, headers, body = get(server, "/facts", method="HEAD")
    assert int(headers["content-length"]) > 100
    assert body == b""


@pytest.fixture
def guarded(serve, small_run):
    return serve(small_run, token=TOKEN)


@pytest.mark.parametrize(
    ("target", "headers"),
    [
        ("/", {}),
        ("/state", {}),
        ("/nothing", {}),
        ("/picture?frame=0&layer=rgb", {}),
        ("/state?token=", {}),
        ("/state?token=wrong", {}),
        (f"/state?token={TOKEN[:-1]}", {}),
        (f"/state?token={TOKEN}x", {}),
        ("/state?token=%ff%fe", {}),
        (f"/state?token={TOKEN}&token=wrong", {}),
        ("/state", {"Authorization": "Bearer wrong"}),
        ("/state", {"Cookie": "viewsphere-{port}=wrong"}),
        ("/state", {"Cookie": f"viewsphere-1={TOKEN}"}),
        ("/state", {"Cookie": ';;;=\x7f"' + "{port}"}),
    ],
)
def test_without_the_token_nothing_is_told(guarded, target, headers):
    told = {name: value.format(port=guarded.port) for name, value in headers.items()}
    status, _, body = get(guarded, target, with_token=False, **told)
    assert status == 403
    assert body == b"expected the address that viewsphere view printed, with its token\n"


def test_the_token_becomes_a_cookie(guarded):
    status, headers, body = get(guarded, f"/?token={TOKEN}")
    assert (status, headers["location"], body) == (303, "/", b"")
    assert headers["set-cookie"] == f"viewsphere-{guarded.port}={TOKEN}; Path=/; HttpOnly; SameSite=Strict"
    assert get(guarded, "/state", Cookie=f"viewsphere-{guarded.port}={TOKEN}", with_token=False)[0] == 200
    assert get(guarded, "/state", Authorization=f"Bearer {TOKEN}")[0] == 200
    assert get(guarded, "/state", Authorization=f"Bearer {TOKEN}", host="evil.example")[0] == 421


def test_beyond_this_machine_a_token_is_needed(serve, small_run):
    server = serve(small_run, host="0.0.0.0", token=TOKEN)
    own = f"{socket.gethostname()}:{server.port}"
    for host in (f"127.0.0.1:{server.port}", f"192.0.2.7:{server.port}", own):
        assert get(server, "/state", host=host, with_token=False)[0] == 403
        assert get(server, "/state", host=host, Authorization=f"Bearer {TOKEN}")[0] == 200
    assert get(server, "/state", host=f"evil.example:{server.port}", Authorization=f"Bearer {TOKEN}")[0] == 421
    assert server.url == f"http://{own}/?token={TOKEN}"


def test_every_server_has_a_token(serve, small_run):
    one, other = serve(small_run), serve(small_run)
    assert one.token != other.token
    assert one.url.endswith(f"?token={one.token}")
    assert get(one, "/", with_token=False)[0] == 403
    assert get(one, "/", Authorization=f"Bearer {other.token}")[0] == 403


@pytest.mark.parametrize("token", ["short", "with spaces in it, and more", "x" * 300, "line\r\nSet-Cookie: a=b-------"])
def test_tokens_that_no_cookie_holds(small_run, token):
    with pytest.raises(UserError, match="--token"):
        Server(Live(small_run), Address(port=0, token=token))


@pytest.mark.parametrize(
    ("address", "word"),
    [
        ({"host": "192.0.2.1", "token": TOKEN}, "expected an address of this machine"),
        ({"host": "no such host", "token": TOKEN}, "expected an address of this machine"),
    ],
)
def test_addresses_one_cannot_listen_at(small_run, address, word):
    with pytest.raises(UserError, match=word):
        Server(Live(small_run), Address(port=0, **address))


def test_a_port_in_use(server, small_run):
    with pytest.raises(UserError, match=f"--port {server.port}: expected a free port"):
        Server(Live(small_run), Address(port=server.port))


def test_a_mistake_of_ours_is_one_line(server, capfd, monkeypatch):
    def broken(*_):
        raise KeyError("mistake")

    monkeypatch.setattr(server.answers, "answer", broken)
    assert get(server, "/state")[0] == 500
    assert capfd.readouterr().err == "viewsphere: view: KeyError: 'mistake'\n"


def dripping(server, count):
    """So many connections that have begun a request, and that close when the test ends."""
    lines = [socket.create_connection(("127.0.0.1", server.port), DEADLINE) for _ in range(count)]
    for line in lines:
        line.sendall(b"GET /state HTTP/1.1\r\nX-a: ")
    return lines


def drip(lines):
    """Send a byte more on each connection; returns how many are open."""
    return sum(drips(line) for line in lines)


def drips(line):
    try:
        line.sendall(b"b")
        line.setblocking(False)
        return line.recv(1) != b""
    except BlockingIOError:
        return True
    except OSError:
        return False


@pytest.mark.parametrize(
    ("count", "most"), [(60, 16), pytest.param(900, server_module.MOST_CONNECTIONS, marks=pytest.mark.slow)]
)
def test_dripping_clients_keep_nobody_waiting(serve, small_run, monkeypatch, count, most):
    monkeypatch.setattr(server_module, "MOST_CONNECTIONS", most)
    allow_files(2 * count + 200)
    server = serve(small_run)
    lines = dripping(server, count)
    try:
        longest = 0.0
        for _ in range(10):
            drip(lines)
            begun = time.monotonic()
            assert get(server, "/state")[0] == 200
            longest = max(longest, time.monotonic() - begun)
        assert longest < 2.0
        assert until(lambda: drip(lines) <= most)
    finally:
        for line in lines:
            line.close()


def allow_files(count):
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < count:
        pytest.skip("the system allows too few open files")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, count), hard))


def test_a_request_has_a_deadline(serve, small_run, monkeypatch):
    monkeypatch.setattr(server_module, "QUIET", 0.3)
    (line,) = dripping(serve(small_run), 1)
    with line:
        assert until(lambda: not drip([line]))


def test_a_system_without_more_connections_does_not_make_it_spin(server, monkeypatch):
    calls = []

    def none_left(self):
        calls.append(time.monotonic())
        raise OSError(errno.EMFILE, "Too many open files")

    with monkeypatch.context() as patched, socket.create_connection(("127.0.0.1", server.port), DEADLINE):
        patched.setattr(TCPServer, "get_request", none_left)
        time.sleep(0.4)
    assert len(calls) < 12
    assert get(server, "/state")[0] == 200


def test_long_heads_are_refused(server):
    head = "".join(f"X-{i}: {'a' * 1000}\r\n" for i in range(60))
    answer = tell(server, f"GET /state HTTP/1.1\r\nAuthorization: Bearer {server.token}\r\n{head}\r\n")
    assert b"planned" not in answer


def test_headers_are_parsed_only_behind_the_token(server, monkeypatch):
    def parse(*_, **__):
        raise AssertionError("headers were parsed")

    monkeypatch.setattr("http.client.parse_headers", parse)
    assert get(server, "/state", with_token=False)[0] == 403


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("within", ["1e308,", ",1e308", "-1e308,1e308", "1e308,-1e308", "inf,", "-10,20"])
@pytest.mark.parametrize("measure", ["azimuth", "distance", "visibility", "camera_azimuth"])
@pytest.mark.slow
def test_large_bounds_warn_of_nothing(server, within, measure, capfd):
    assert get(server, f"/rows?first=0&count=1&{measure}={within}")[0] == 200
    assert capfd.readouterr().err == ""
