"""Plans of small simulated stands, and drivers that go wrong when they are told to."""

from impasto import stand
from impasto.stand.drivers import Stand
from impasto.stand.drivers import open_camera as plan_camera
from impasto.stand.drivers import open_light as plan_light
from impasto.stand.plan_file import read_plan

ARM = range(-40, 41, 10)
"""Nine angles, one more than an exchange of lamps is looked for in."""


def write_plan(folder, *, sample="b", size=(96, 64), arm=ARM, times=(2, 0.125), replace=(), **options):
    """Write a plan of a simulated stand and return its path; `replace` holds pairs of texts."""
    path = folder / "plan.toml"
    drivers = {"camera": "simulated", "light": "simulated", "calibration": ("dark", "ambient")}
    stand.plan(path, arm_deg=arm, times_s=times, **drivers | options)
    text = path.read_text()
    pairs = [
        ("size = [192, 128]", f'size = {list(size)}\nsample = "{sample}"'),
        ("view = [0, 0, 1]", "view = { phi_deg = 5 }"),
        *replace,
    ]
    for old, new in pairs:
        assert old in text or old == "size = [192, 128]", old
        text = text.replace(old, new)
    path.write_text(text)
    return path


def quiet(line):
    """Say nothing."""


def stand_of(path, desk):
    """Return the stand of a plan, without devices."""
    return Stand(read_plan(path), desk)


class Faulty:
    """A camera that hands each photograph to a function before it gives it away.

    Parameters
    ----------
    camera : Camera
    fault : callable
        Called with shot, path and how often this shot was taken before; returns the path or raises.
    """

    def __init__(self, camera, fault):
        self._camera, self._fault, self._taken = camera, fault, {}

    def take(self, shot, folder):
        times = self._taken.get(shot.name, 0)
        self._taken[shot.name] = times + 1
        return self._fault(shot, self._camera.take(shot, folder), times)

    def close(self):
        self._camera.close()


def faulty_camera(fault):
    """Return what opens a camera that goes wrong, with one memory however often it is opened."""
    opened = []

    def open_camera(stand):
        if not opened:
            opened.append(Faulty(plan_camera(stand), fault))
        opened[0]._camera._stand = stand
        return opened[0]

    return open_camera


class FaultyLight:
    """A light that shows what a function says instead of what it is told."""

    def __init__(self, light, fault):
        self._light, self._fault, self._shown = light, fault, {}

    @property
    def lit(self):
        return self._light.lit

    def show(self, place):
        times = self._shown.get(place.name, 0)
        self._shown[place.name] = times + 1
        self._light.lit = self._fault(place.name, times)

    def off(self):
        self._light.off()

    def close(self):
        self._light.close()


def faulty_light(fault):
    """Return what opens a light that goes wrong, with one memory however often it is opened."""
    opened = []

    def open_light(stand):
        if not opened:
            opened.append(FaultyLight(plan_light(stand), fault))
        return opened[0]

    return open_light
