"""Pages of the viewer in a browser, for its tests."""

import base64
import functools
import threading
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import numpy as np

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
  const canvas = viewer.shadowRoot.querySelector("canvas");
  const gl = canvas.getContext("webgl2");
  const pixels = new Uint8Array(4 * canvas.width * canvas.height);
  // What a snapshot would put into its file, read before that is written, which takes most of the time.
  canvas.toBlob = (done) => {
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    done(null);
  };
  const pictures = [];
  for (const state of states) {
    viewer.state = { ...viewer.state, ...state };
    await viewer.snapshot().catch(() => undefined);
    let text = "";
    for (let i = 0; i < pixels.length; i += 32768) {
      text += String.fromCharCode(...pixels.subarray(i, i + 32768));
    }
    pictures.push(btoa(text));
  }
  delete canvas.toBlob;
  return [canvas.height, canvas.width, pictures];
}
"""


def pictures(page, states):
    """Yield what the viewer draws in each state, whose tiles are there: (height, width, RGB), uint8."""
    height, width, drawn = page.evaluate(_PICTURES, states)
    for data in drawn:
        from_below = np.frombuffer(base64.b64decode(data), np.uint8).reshape(height, width, 4)
        yield from_below[::-1, :, :3]
