"""Fifty observers at once: python -m benchmarks.experiment_load [--database URL].

Each observer is a thread with its own connection, who fetches the pictures as the page does, takes half a
second to one and a half to answer, and notes what the server acknowledged. Afterwards the notes are compared
with the database.
"""

from __future__ import annotations

import argparse
import http.client
import json
import random
import resource
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
from benchmarks.experiment_server import ServerProcess

import impasto
from impasto.capture.simulate import simulate
from impasto.psychophysics.experiment.administer import invite
from impasto.psychophysics.experiment.answers import answers_json
from impasto.psychophysics.experiment.database import database_url, open_database
from impasto.psychophysics.experiment.manifest import Presentation, read_experiment

OBSERVERS = 50
SECONDS = 120.0
THINKING_S = (0.5, 1.5)
BAR_P95_MS = 100.0
WINDOW = {"width": 1280, "height": 800, "device_pixel_ratio": 1, "full_screen": True, "input": "key"}


class Observer(threading.Thread):
    """Answers as long as there is time, and times each answer's way to the database and back."""

    def __init__(self, port: int, code: str, until: float, seed: int) -> None:
        super().__init__()
        self._connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        self._headers = {"Authorization": f"Bearer {code}", "Content-Type": "application/json"}
        self._until = until
        self._random = random.Random(seed)
        self._fetched: set[str] = set()
        self.round_trips_s: list[float] = []
        self.acknowledged: dict[int, str] = {}
        self.failures: list[str] = []

    def _ask(self, method: str, path: str, body: dict[str, object] | None = None) -> bytes:
        text = None if body is None else json.dumps(body)
        self._connection.request(method, f"/api/session{path}", text, self._headers)
        response = self._connection.getresponse()
        content = response.read()
        if response.status >= 300:
            self.failures.append(f"{path}: {response.status} {content[:200]!r}")
        return content

    def run(self) -> None:
        """Take part."""
        time.sleep(self._random.uniform(0, THINKING_S[1]))
        self._ask("POST", "/steps", {"name": "consent", "agreed": True})
        trial = json.loads(self._ask("POST", "/next"))["trial"]
        while trial and time.monotonic() < self._until and not self.failures:
            for digest in dict.fromkeys((trial["reference"], trial["left"], trial["right"], *trial["ahead"])):
                if digest not in self._fetched:
                    self._ask("GET", f"/pictures/{digest}")
                    self._fetched.add(digest)
            thinking = self._random.uniform(*THINKING_S)
            time.sleep(thinking)
            choice = self._random.choice(["left", "right"])
            answer = {"token": trial["token"], "choice": choice, "response_s": thinking, "window": WINDOW}
            started = time.perf_counter()
            reply = json.loads(self._ask("POST", "/answers", answer))
            self.round_trips_s.append(time.perf_counter() - started)
            if not self.failures:
                self.acknowledged[trial["number"]] = choice
                trial = reply["trial"]


def make_experiment(folder: Path) -> Path:
    """Make an experiment of 111 comparisons: three models under 37 angles."""
    photos, store = folder / "photos", folder / "sample.zarr"
    simulate(photos, sample="e", arm=True, size=(200, 200), calibration=False, show_progress=False)
    impasto.stack(photos, store, show_progress=False)
    models = ["torrance-sparrow", "phong", "ward"]
    impasto.fit(store, models=models, show_progress=False)
    out = folder / "experiment"
    presentation = Presentation(minimum_view_s=0.2, practice=0)
    impasto.experiment.create(
        [store], out=out, models=models, angles=37, presentation=presentation, show_progress=False
    )
    return out


def measure(folder: Path, database: str, observers: int, seconds: float) -> dict[str, float]:
    """Return how many answers were given, lost and doubled, and how long their round trips took."""
    experiment = make_experiment(folder)
    codes = [
        entry.code for entry in invite(experiment, observers=observers, simulated=True, database=database)
    ]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with ServerProcess(experiment, database) as server:
        until = time.monotonic() + seconds
        group = [Observer(server.port, code, until, seed) for seed, code in enumerate(codes)]
        for observer in group:
            observer.start()
        for observer in group:
            observer.join()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    server_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    described = read_experiment(experiment)
    engine = open_database(database_url(database, experiment), described)
    stored = {
        entry["number"]: {answer["place"]: answer for answer in entry["answers"]}
        for entry in answers_json(engine, described)["sessions"]
    }
    engine.dispose()
    wrong = 0
    for number, observer in enumerate(group):
        kept = {
            place: "left" if (answer["choice"] == "A") == (answer["side"] == "left") else "right"
            for place, answer in stored[number].items()
        }
        wrong += len(kept.items() ^ observer.acknowledged.items())
    round_trips_ms = 1000 * np.concatenate([observer.round_trips_s for observer in group])
    return {
        "observers": observers,
        "seconds": seconds,
        "answers": len(round_trips_ms),
        "answers per second": len(round_trips_ms) / seconds,
        "server, CPU ms per answer": 1000 * server_s / len(round_trips_ms),
        "lost, doubled or changed": wrong,
        "failed requests": sum(len(observer.failures) for observer in group),
        **{f"p{share} ms": float(np.percentile(round_trips_ms, share)) for share in (50, 95, 99)},
        "longest ms": float(round_trips_ms.max()),
    }


def main() -> int:
    """Measure, print, and return 1 if an answer was lost or the round trips are too long."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.experiment_load", description=__doc__)
    parser.add_argument("--database", help="of PostgreSQL; SQLite in a temporary folder by default")
    parser.add_argument("--observers", type=int, default=OBSERVERS)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        database = arguments.database or f"sqlite:///{name}/answers.sqlite"
        figures = measure(Path(name), database, arguments.observers, arguments.seconds)
    for title, value in figures.items():
        print(f"{title:26} {value:.6g}")
    bad = figures["lost, doubled or changed"] or figures["failed requests"]
    return int(bool(bad) or figures["p95 ms"] > BAR_P95_MS)


if __name__ == "__main__":
    raise SystemExit(main())
