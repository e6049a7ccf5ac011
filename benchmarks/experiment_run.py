"""Eighteen simulated observers in a real browser: python -m benchmarks.experiment_run [--folder FOLDER].

The paper's first design over the eight virtual samples: two models, seven angles. Each observer is
Thurstone's: the distance of each candidate from the photograph is measured on the pixels that the
browser shows, noise is added, and the closer one is chosen; some answers are given blindly. Their names
say that they are simulated, and what they answer says nothing about people. The run shows that sessions,
server, database and export work from one end to the other.
"""

from __future__ import annotations

import argparse
import random
import shutil
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks.experiment_server import Observer, ServerProcess

import impasto
from impasto.capture.simulate import simulate
from impasto.psychophysics.experiment.administer import export, invite
from impasto.psychophysics.experiment.answers import answer_rows, session_states
from impasto.psychophysics.experiment.database import database_url, open_database
from impasto.psychophysics.experiment.manifest import Presentation, read_experiment, session_trials

SAMPLES = "abcdefgh"
OBSERVERS = 18
SIZE = (320, 320)
AT_ONCE = 3
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]

GAIN = 60.0  # standard deviations of the noise per unit of the difference
LAPSES = 0.02
# Root mean square difference of each candidate from the photograph, in encoded values from 0 to 1.
DIFFERENCES = """() => {
  const pixels = (where) => {
    const image = document.querySelector(`.picture.${where}`);
    const canvas = document.createElement("canvas");
    canvas.width = image.naturalWidth;
    canvas.height = image.naturalHeight;
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, canvas.width, canvas.height).data;
  };
  const reference = pixels("reference");
  return ["left", "right"].map((where) => {
    const candidate = pixels(where);
    let sum = 0;
    for (let index = 0; index < reference.length; index++) {
      if (index % 4 !== 3) sum += ((candidate[index] - reference[index]) / 255) ** 2;
    }
    return Math.sqrt(sum / (0.75 * reference.length));
  });
}"""


def make_experiment(folder: Path) -> Path:
    """Simulate, stack and fit the samples that are not there yet, and make the experiment."""
    stores = []
    for sample in SAMPLES:
        photos, store = folder / f"photos-{sample}", folder / f"{sample}.zarr"
        if not store.is_dir():
            simulate(photos, sample=sample, arm=True, size=SIZE, calibration=False, show_progress=False)
            impasto.stack(photos, store, show_progress=False)
        impasto.fit(store, show_progress=False)
        stores.append(store)
    presentation = Presentation(minimum_view_s=0.2, adaptation_s=1, display_check=False)
    impasto.experiment.create(
        stores, out=folder / "experiment", presentation=presentation, show_progress=False
    )
    return folder / "experiment"


def take_part(address: str, code: str, seed: int) -> tuple[list[str], list[str]]:
    """Go through a session, and return what was asked for elsewhere and the faults of the page."""
    from playwright.sync_api import sync_playwright

    judge = random.Random(seed)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        observer = Observer(browser.new_page(viewport={"width": 1280, "height": 800}), address)
        observer.open(code)
        observer.reach_the_trials()
        while observer.wait_until_asked():
            left, right = observer.page.evaluate(DIFFERENCES)
            seen = GAIN * (right - left) + judge.gauss(0, 1)
            blind = judge.random() < LAPSES
            side = judge.choice(["left", "right"]) if blind else "left" if seen > 0 else "right"
            observer.answer(side, key=judge.random() < 0.5)
            observer.wait_for_the_next()
        browser.close()
    return observer.elsewhere, observer.faults


def main() -> int:
    """Run the experiment, print what came out, and return 1 if an answer is missing or a page failed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.experiment_run", description=__doc__)
    parser.add_argument("--folder", type=Path, help="where to keep the samples and the answers")
    parser.add_argument("--database", help="of PostgreSQL; SQLite in the folder by default")
    parser.add_argument("--observers", type=int, default=OBSERVERS)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = arguments.folder or Path(name)
        experiment = make_experiment(folder)
        database = arguments.database or f"sqlite:///{folder}/answers.sqlite"
        invited = invite(experiment, observers=arguments.observers, simulated=True, database=database)
        with ServerProcess(experiment, database) as server, ThreadPoolExecutor(AT_ONCE) as pool:
            seeds = range(len(invited))
            codes = [entry.code for entry in invited]
            ended = list(pool.map(take_part, [server.address] * len(codes), codes, seeds))
        export(experiment, folder / "trials.csv", database=database)
        described = read_experiment(experiment)
        engine = open_database(database_url(database, folder), described)
        states = {state.observer: state for state in session_states(engine)}
        rows = answer_rows(engine, kinds=["test"])
        engine.dispose()
    mine = [states[entry.observer] for entry in invited]
    rows = [row for row in rows if row["observer"] in states]
    complete = sum(state.answered == state.total == len(session_trials(described, 0)) for state in mine)
    left = sum((row["choice"] == "A") == (row["side"] == "left") for row in rows)
    print(f"simulated observers            {len(mine)}, {complete} sessions complete")
    print(
        f"answers                        {sum(state.answered for state in mine)}, {len(rows)} of them tests"
    )
    print(f"catch trials right             {sum(s.caught for s in mine)} of {sum(s.catches for s in mine)}")
    print(f"repeats answered alike         {sum(s.repeated for s in mine)} of {sum(s.repeats for s in mine)}")
    print(f"left chosen                    {left} of {len(rows)}")
    first = rows[0]["condition_A"]
    for sample in SAMPLES:
        own = [row["choice"] == "A" for row in rows if row["sample"] == sample]
        print(f"sample {sample}: {first} chosen   {sum(own)} of {len(own)}")
    faults = [fault for pair in ended for group in pair for fault in group]
    print(f"requests elsewhere and faults  {len(faults)} {faults[:3]}")
    return int(complete != len(mine) or bool(faults))


if __name__ == "__main__":
    raise SystemExit(main())
