"""Pages of the viewer in a browser, for its tests."""

import base64
import functools
import io
import threading
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

from PIL import Image

READY = """
seconds => new Promise((resolve, reject) => {
  const viewer = document.querySelector("impasto-viewer");
  const look = () => viewer.complete ? resolve() : setTimeout(look, 20);
  setTimeout(() => reject(new Error("the picture is not complete")), 1000 * seconds);
  look();
})
"""


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format, *arguments):
        pass


@contextmanager
def static_host(folder, handler=_Quiet):
    """Serve a folder as python -m http.server does, and give its address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(handler, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}/"
    finally:
        server.shutdown()
        server.server_close()


def complete(page, seconds=60):
    """Wait until all tiles of the present view are drawn."""
    page.evaluate(READY, seconds)


_PICTURES = """
async (states) => {
  const viewer = document.querySelector("impasto-viewer");
  const pictures = [];
  for (const state of states) {
    viewer.state = { ...viewer.state, ...state };
    const bytes = new Uint8Array(await (await viewer.snapshot()).arrayBuffer());
    let text = "";
    for (let i = 0; i < bytes.length; i += 32768) {
      text += String.fromCharCode(...bytes.subarray(i, i + 32768));
    }
    pictures.push(btoa(text));
  }
  return pictures;
}
"""


def pictures(page, states):
    """Return what the viewer saves in each of these states, whose tiles are there: PIL images."""
    saved = page.evaluate(_PICTURES, states)
    return [Image.open(io.BytesIO(base64.b64decode(data))) for data in saved]
