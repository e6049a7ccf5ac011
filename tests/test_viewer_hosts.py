"""The page on hosts as they are: with and without ranges, with damage, refusing, and out to harm."""

import gzip
import json
import os
import shutil
import socket
import subprocess
from http.server import SimpleHTTPRequestHandler

import pytest
from tests.viewer_pages import complete, static_host

import impasto

VIEWER = "document.querySelector('impasto-viewer')"
MODEL = "torrance-sparrow"


@pytest.fixture(scope="module")
def folders(web, painting, tmp_path_factory):
    """Return folders published without and with shards."""
    out = tmp_path_factory.mktemp("hosts")
    impasto.publish(painting, out / "plain", models=[MODEL])
    impasto.publish(painting, out / "sharded", models=[MODEL], shards=True)
    return out


@pytest.fixture
def copy(folders, tmp_path):
    """Return a published folder to be damaged."""
    return shutil.copytree(folders / "plain", tmp_path / "site")


@pytest.fixture
def page(browser):
    """Return a page that fails the test if a script or an error of its own appears in it."""
    page = browser.new_page(viewport={"width": 500, "height": 400}, locale="en-GB")
    page.add_init_script("addEventListener('impasto-problem', e => (window.found ??= []).push(e.detail))")
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    page.close()
    assert errors == []


class Ranges(SimpleHTTPRequestHandler):
    """Serves ranges, as nginx and object stores do."""

    def log_message(self, format, *arguments):
        pass

    def do_GET(self):
        wanted = self.headers.get("Range")
        if wanted is None:
            super().do_GET()
            return
        with open(self.translate_path(self.path), "rb") as file:
            data = file.read()
        first, last = wanted.removeprefix("bytes=").split("-")
        start = int(first) if first else len(data) - int(last)
        stop = int(last) + 1 if first and last else len(data)
        self.send_response(206)
        self.send_header("Content-Range", f"bytes {start}-{stop - 1}/{len(data)}")
        self.send_header("Content-Length", str(stop - start))
        self.end_headers()
        self.wfile.write(data[start:stop])


class AnotherRange(Ranges):
    """Answers with the beginning of the file, whatever part is asked for."""

    def do_GET(self):
        wanted = self.headers.get("Range")
        if wanted:
            first, last = wanted.removeprefix("bytes=").split("-")
            length = int(last) - int(first) + 1 if first else int(last)
            self.headers.replace_header("Range", f"bytes=0-{length - 1}")
        super().do_GET()


def picture_of(page, url):
    page.goto(url)
    complete(page)
    return page.locator("canvas").screenshot()


def told(page, kind):
    """Wait for a problem of a kind and return it; its message stands in the page."""
    page.wait_for_timeout(200)
    found = page.evaluate("window.found ?? []")
    assert [problem["kind"] for problem in found][:1] == [kind]
    return found[0]


def test_shards_show_the_same_with_ranges_and_without(folders, page):
    with static_host(folders / "plain") as url:
        plain = picture_of(page, url)
    with static_host(folders / "sharded", Ranges) as url:
        assert picture_of(page, url) == plain
    # python -m http.server answers 200 with the whole file, which must not be taken for the part.
    with static_host(folders / "sharded") as url:
        assert picture_of(page, url) == plain


def test_another_range_than_asked_for_is_never_shown(folders, page):
    with static_host(folders / "sharded", AnotherRange) as url:
        page.goto(url)
        page.wait_for_timeout(1500)
        told(page, "damaged")
        assert not page.evaluate(f"{VIEWER}.complete")


NGINX = """
daemon off; pid {folder}/nginx.pid; error_log stderr;
events {{}}
http {{
  include /etc/nginx/mime.types; access_log off;
  client_body_temp_path {folder}/a; proxy_temp_path {folder}/b; fastcgi_temp_path {folder}/c;
  uwsgi_temp_path {folder}/d; scgi_temp_path {folder}/e;
  server {{ listen 127.0.0.1:{port}; root {root}; {ranges} }}
}}
"""


@pytest.mark.parametrize(("kind", "ranges"), [("plain", ""), ("sharded", ""), ("sharded", "max_ranges 0;")])
def test_nginx_serves_it(kind, ranges, folders, page, tmp_path, free_port):
    nginx = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin")
    if nginx is None:
        (pytest.fail if os.environ.get("CI") else pytest.skip)("nginx is not installed: make nginx")
    # Its workers run as another account, which may not enter pytest's folders.
    root = shutil.copytree(folders / kind, tmp_path / "root")
    settings = tmp_path / "nginx.conf"
    user = "user root;" if tmp_path.owner() == "root" else ""
    settings.write_text(user + NGINX.format(folder=tmp_path, port=free_port, root=root, ranges=ranges))
    server = subprocess.Popen([nginx, "-c", settings], stderr=subprocess.DEVNULL)
    try:
        page.wait_for_timeout(500)
        page.goto(f"http://127.0.0.1:{free_port}/")
        complete(page)
        assert page.evaluate(f"{VIEWER}.store.http.requests") > 1
    finally:
        server.terminate()
        server.wait()


@pytest.fixture
def free_port():
    """Return a port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def chunk_of(site):
    return site / "painting.zarr" / "models" / MODEL / "0" / "parameters" / "c" / "0" / "0" / "0"


@pytest.mark.parametrize("harm", ["missing", "damaged", "cut off", "too short"])
def test_a_bad_chunk_is_told_and_the_rest_works(harm, copy, page):
    chunk = chunk_of(copy)
    data = bytearray(chunk.read_bytes())
    if harm == "missing":
        chunk.unlink()
    elif harm == "damaged":
        data[len(data) // 2] ^= 0x10
        chunk.write_bytes(data)
    elif harm == "cut off":
        chunk.write_bytes(data[: len(data) // 2])
    else:
        chunk.write_bytes(gzip.compress(gzip.decompress(data)[:-200]))
    with static_host(copy) as url:
        page.goto(url)
        page.wait_for_timeout(800)
        problem = told(page, "missing" if harm == "missing" else "damaged")
        assert problem["where"].endswith(f"models/{MODEL}/0/parameters/c/0/0/0")
        page.get_by_text(problem["where"]).wait_for()
        # The photographs' and the residuals' pixels are in other chunks.
        page.evaluate(f"{VIEWER}.hash = 'show=quality:residual_rms:0'")
        complete(page)


def test_wrong_addresses_and_other_stores_are_told(copy, page):
    with static_host(copy) as url:
        for path, words in (
            ("?src=nowhere.zarr", "nowhere.zarr/zarr.json is not there (404)"),
            ("?src=assets", "assets/zarr.json is not there (404)"),
            ("?src=http://127.0.0.1:9/a.zarr", "No answer from http://127.0.0.1:9/a.zarr/zarr.json"),
        ):
            page.goto(f"{url}{path}")
            page.get_by_text(words).wait_for()
            assert page.get_by_role("button", name="Try again").is_visible()
        root = copy / "painting.zarr" / "zarr.json"
        document = json.loads(root.read_text())
        document["attributes"]["impasto_published"] = 2
        root.write_text(json.dumps(document))
        page.goto(url)
        page.get_by_text("a newer version of impasto").wait_for()
        root.write_text('{"zarr_format": 3, "node_type": "group", "attributes": {}}')
        os.utime(root, (2e9, 2e9))  # the host's dates have no fractions of a second
        page.reload()
        page.get_by_text("is not a painting published by impasto").wait_for()


class OtherPagesMayRead(Ranges):
    def end_headers(self):
        self.send_header("Access-Control-Allow-Origin", "*")
        super().end_headers()


def test_another_host_is_read_if_it_allows_that(folders, copy, page):
    with static_host(folders / "plain") as url:
        with static_host(copy, OtherPagesMayRead) as other:
            page.goto(f"{url}?src={other}painting.zarr")
            complete(page)
        with static_host(copy) as other:
            page.goto(f"{url}?src={other}painting.zarr")
            page.get_by_text("does its host allow other pages to read it (CORS)").wait_for()


def test_a_store_from_elsewhere_cannot_run_code(copy, page):
    """Every text of a store that could be taken for markup, an address or a part of a shader."""
    root = copy / "painting.zarr" / "zarr.json"
    document = json.loads(root.read_text())
    evil = "</script><img src=x onerror='window.harmed=1'><script>window.harmed=1</script>"
    attributes = document["attributes"]
    attributes["title"] = evil
    model = attributes["models"][0]
    model["title"] = model["procedure"] = evil
    model["status_meaning"] = dict.fromkeys(model["status_meaning"], evil)
    for column in (*model["parameters"], *model["quality"]):
        column["units"] = column["long_name"] = evil
    model["quality"][0]["name"] = "}\n#error injected\nvoid main() {"
    attributes["models"].append({**model, "name": "other", "base": "void main() {}"})
    root.write_text(json.dumps(document))
    with static_host(copy) as url:
        page.goto(url)
        complete(page)
        assert page.locator("h2").text_content() == evil
        page.evaluate(f"{VIEWER}.inspect(10, 10)")
        page.locator(".details table").first.wait_for()
        assert page.evaluate("window.harmed") is None
        assert page.locator("img, .details script").count() == 0
        assert page.evaluate(f"{VIEWER}.store.attributes.models.length") == 1
        # What the element lets through, the page's policy stops.
        page.evaluate(
            "document.body.append(document.createRange().createContextualFragment("
            "'<img src=x onerror=\"window.harmed=1\"><script>window.harmed=1</script>'))"
        )
        page.wait_for_timeout(200)
        assert page.evaluate("window.harmed") is None
