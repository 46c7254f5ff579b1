"""Nobody but this computer's browser with the token is answered, and nothing outside the folder is read."""

import http.client
import shutil
from itertools import product
from urllib.parse import quote, urlsplit

import nicegui
import numpy as np
import pytest
from fastapi import FastAPI
from nicegui.dependencies import esm_modules, libraries

from airborne.studio import server  # noqa: F401 its pages bring their own addresses
from airborne.studio.calibrating import REPORT
from airborne.studio.routes import add_routes
from airborne.studio.starts import FOUND, FOUND_PICTURE
from tests.support.places import THROWN_CROSS
from tests.support.studio import fork_studio

SECRET = "only its owner may read this"
N_CRAFTED = 12  # for each address that the studio answers
CLIMBS = ("../", "..%2f", "%2e%2e/", "%2e%2e%2f", "..\\", "..%5c", "....//", "..;/", "%252e%252e%252f", "..%c0%af", "/")
TARGETS = ("secret.txt", "secret.mp4", "etc/passwd", "proc/self/environ", "root/.ssh/id_rsa", "link/secret.txt")
GIVEN = {"run": "results", "camera": "0", "order": "top-first"}  # what stands before a path's last part


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    """A studio's address, of a folder beside a secret."""
    outside = tmp_path_factory.mktemp("outside")
    folder = shutil.copytree(THROWN_CROSS, outside / "cross")
    (outside / "secret.txt").write_text(SECRET)
    shutil.copyfile(folder / "cam1.mp4", outside / "secret.mp4")
    (folder / "results").mkdir()
    (folder / "results" / "motion.csv").write_text("nothing\n")
    (folder / "results" / "report.html").write_text("<script>alert(1)</script>")
    (folder / "results" / "tables").mkdir()
    (folder / "results" / "tables" / "report.html").write_text("<script>alert(1)</script>")
    shutil.copytree(folder / "results", folder / "linked")
    (folder / "linked" / "link").symlink_to(outside)
    (folder / "escape").symlink_to(outside)
    (folder / "link.mp4").symlink_to(outside / "secret.mp4")
    (folder / REPORT).mkdir()
    (outside / "secret.png").write_text(SECRET)
    (folder / REPORT / "residuals_cam1.png").symlink_to(outside / "secret.png")
    with fork_studio(folder) as address:
        (folder / FOUND).mkdir()  # with a link there from the beginning the studio does not open
        (folder / FOUND_PICTURE).symlink_to(outside / "secret.png")
        yield urlsplit(address)


def places():
    """Return what every address of the studio begins with, up to the part that may be anything."""
    own = FastAPI()
    add_routes(own, None)
    for route in (*nicegui.app.routes, *own.routes):
        head, brace, _ = route.path.rpartition("{")
        keys = esm_modules if "/esm/" in head else {"none": None}
        yield head.format(**GIVEN, key=next(iter(keys))) if brace else f"{route.path}/"
    yield "/"


def ask(studio, path, **headers):
    """Return status, headers and body of one answer; the token goes along unless a cookie is given."""
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=20)
    token = studio.query.removeprefix("token=")
    sent = {"host": f"127.0.0.1:{studio.port}", "cookie": f"airborne-{studio.port}={token}", **headers}
    try:
        connection.putrequest("GET", path, skip_host=True, skip_accept_encoding=True)
        for name, value in sent.items():
            connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
    finally:
        connection.close()


def test_without_the_token_nothing_is_answered(studio):
    for path in (
        "/",
        "/image/0/0",
        "/thumbnail/cam1.mp4",
        "/_nicegui/3.18.0/static/vue.js",
        "/_nicegui_ws/socket.io/",
    ):
        for cookie in ("", f"airborne-{studio.port}=", f"airborne-{studio.port}=wrong", "airborne-1=x"):
            assert ask(studio, path, cookie=cookie)[0] == 403
    assert ask(studio, "/?token=wrong", cookie="")[0] == 403


def test_the_token_becomes_a_cookie_and_leaves_the_address(studio):
    status, headers, _ = ask(studio, f"/cameras?{studio.query}", cookie="")
    assert (status, headers["location"]) == (303, "/cameras")
    assert {"HttpOnly", "SameSite=Strict"} <= set(headers["set-cookie"].split("; "))


def test_an_address_that_is_none_leads_back_to_the_steps(studio):
    status, headers, body = ask(studio, "/no%3Cb%3E", accept="text/html,*/*")
    assert (status, headers["content-type"]) == (404, "text/html; charset=utf-8")
    assert "There is no page /no&lt;b&gt;" in (page := body.decode())
    assert 'href="/review"' in page
    assert ask(studio, "/nothing", accept="image/*")[2] == b"not found"


def test_other_hosts_and_origins_are_refused(studio):
    assert ask(studio, "/")[0] == 200
    for host in (
        "evil.example",
        f"evil.example:{studio.port}",
        "127.0.0.1",
        f"127.0.0.1.evil.example:{studio.port}",
        "",
    ):
        assert ask(studio, "/", host=host)[0] == 403
    for origin in ("http://evil.example", "null", "https://127.0.0.1", f"http://127.0.0.1:{studio.port + 1}"):
        assert ask(studio, "/", origin=origin)[0] == 403
    upgrade = {"upgrade": "websocket", "connection": "Upgrade", "sec-websocket-version": "13"}
    key = {"sec-websocket-key": "dGhlIHNhbXBsZSBub25jZQ=="}
    path = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    assert ask(studio, path, **upgrade, **key, origin="http://evil.example")[0] == 403
    assert ask(studio, path, **upgrade, **key, cookie="")[0] == 403


def test_pages_ask_only_this_server_and_run_only_their_own_scripts(studio):
    policies = [ask(studio, "/")[1]["content-security-policy"] for _ in range(2)]
    assert "default-src 'self'" in policies[0]
    assert "'unsafe-inline'" not in policies[0].split("script-src")[1].split(";")[0]
    assert policies[0] != policies[1], "each page has a nonce of its own"
    status, headers, body = ask(studio, "/file/results/report.html")
    assert (status, body) == (200, b"<script>alert(1)</script>")
    rules = headers["content-security-policy"].split("; ")
    assert {"sandbox allow-scripts allow-downloads", "default-src 'none'", "img-src data: blob:"} <= set(rules)
    assert not [rule for rule in rules if "'self'" in rule or "connect-src" in rule or "same-origin" in rule]
    assert ask(studio, "/file/results/tables/report.html")[1]["content-security-policy"].startswith("sandbox; ")


def test_the_crafted_addresses_begin_as_those_that_are_answered(studio):
    known = set(places())
    static = next(place for place in known if place.endswith("/static/"))
    esm = next(place for place in known if "/esm/" in place)
    modules = esm_modules[esm.split("/")[-2]].path
    library = next(iter(libraries))
    for begin, rest in (
        (static, "nicegui.css"),
        (esm, next(path.name for path in modules.iterdir() if path.suffix == ".js")),
        (next(place for place in known if place.endswith("/libraries/")), library),
        ("/example/", "cameras.jpg"),
        ("/parts/", "curves.js"),
        ("/file/results/", "motion.csv"),
        ("/thumbnail/", "cam1.mp4"),
        ("/fields/top-first/", "cam1.mp4"),
        ("/body/mesh/", "0"),
        ("/image/0/", "0"),
        ("/picture/0/", "0"),
    ):
        assert begin in known and ask(studio, f"{begin}{rest}")[0] == 200, begin
    assert {"/overlay/results/", "/curves/", "/mesh/results/", "/calibration/", "/candidates/"} <= known


def test_nothing_outside_the_folder_is_read(studio):
    rng = np.random.default_rng(0)
    ways = list(product(CLIMBS, TARGETS))
    crafted = [
        f"{place}{ways[k][0] * int(rng.integers(1, 12))}{ways[k][1]}"
        for place in places()
        for k in rng.permutation(len(ways))[:N_CRAFTED]
    ]
    assert len(crafted) > 200
    crafted += [f"/thumbnail/{quote(name)}" for name in ("link.mp4", "../secret.mp4", "/etc/passwd")]
    crafted += [
        "/file/escape/secret.txt",
        "/file/linked/link/secret.txt",
        "/file/linked/motion.csv",
        "/curves/linked",
        "/curves/results?beside=linked",
        "/mesh/linked/0",
        "/calibration/residuals_cam1.png",
        "/candidates",
        "/file/.airborne/find.log",
        "/file/../x",
    ]
    for path in crafted:
        status, headers, body = ask(studio, path)
        assert SECRET.encode() not in body, path
        assert b"root:" not in body, path
        assert "image" not in headers.get("content-type", ""), path
        assert status in (307, 400, 403, 404, 405, 422), (path, status)
