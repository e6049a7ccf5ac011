"""Lamps that the operator moves, and lamps that a command of the user's switches."""

import json
import sys

import pytest
from stands import quiet, stand_of, write_plan

from impasto import stand
from impasto.stand.desk import Desk
from impasto.stand.drivers import DriverError, open_light
from impasto.stand.lights.hand import where
from impasto.stand.plan_file import PlacePlan


def command_light(folder, show, *replace, arm=(-10, 10)):
    pairs = [('show = "impasto-lamp {name}"', f"show = {json.dumps(show)}"), *replace]
    made = stand_of(write_plan(folder, light="command", arm=arm, times=(1,), replace=pairs), Desk())
    return open_light(made), made.plan.file.place


def test_a_command_gets_the_place_as_one_argument_each(tmp_path):
    program = tmp_path / "my lamp.py"
    program.write_text(f"import sys; open({str(tmp_path / 'said')!r}, 'a').write(repr(sys.argv[1:]))")
    show = f"{sys.executable} '{program}' {{name}} 'angle {{arm_angle_deg:.1f}}' {{zenith_deg:.0f}}"
    light, places = command_light(tmp_path, show)
    light.show(places[0])
    assert (tmp_path / "said").read_text() == "['arm-010', 'angle -10.0', '10']"
    light.close()


def test_a_command_that_fails_or_hangs_is_named_with_what_it_said(tmp_path):
    fail = f"{sys.executable} -c 'import sys; sys.exit(\"no lamp {{name}}\")'"
    light, places = command_light(tmp_path, fail)
    with pytest.raises(DriverError, match=r"ended with code 1: no lamp arm-010"):
        light.show(places[0])
    hang = f"{sys.executable} -c 'import time; time.sleep(9)'"
    (tmp_path / "plan.toml").unlink()
    light, places = command_light(tmp_path, hang, ("timeout_s = 60", "timeout_s = 0.3"))
    with pytest.raises(DriverError, match=r"has not ended after 0\.3 s"):
        light.show(places[0])


def test_a_command_that_does_not_exist_and_a_placeholder_that_does_not_are_named(tmp_path):
    light, places = command_light(tmp_path, "/no/such/lamp {name}")
    with pytest.raises(DriverError, match="cannot be run"):
        light.show(places[0])
    (tmp_path / "plan.toml").unlink()
    with pytest.raises(DriverError, match=r"cannot be filled in for arm-010: 'angle'"):
        command_light(tmp_path, "lamp {angle}")


def test_the_operator_is_told_each_place_once_and_darkness_once(tmp_path):
    asked = []

    def answer(question):
        asked.append(question.text)
        return next(iter(question.choices))

    plan = write_plan(tmp_path, light="hand", arm=(-10, 10), replace=[("settle_s = 1", "settle_s = 0")])
    assert stand.run(plan, tmp_path / "photos", desk=Desk(answer), say=quiet).complete
    assert asked == [
        "Now the cap on the lens",
        "All lamps off",
        "Now the painting, with every lamp of the stand off",
        "Lamp to -10° on the arm (arm-010)",
        "Lamp to +10° on the arm (arm+010)",
        "All lamps off",
    ]


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ({"zenith_deg": 30, "azimuth_deg": 350}, "30° from the normal, 350° around (a)"),
        ({"direction": [0.0, -1.0, 1.0]}, "45° from the normal, 270° around (a)"),
        ({"position_mm": [-800.0, 0.0, 600.0]}, "x -800, y 0, z 600 mm (a)"),
    ],
)
def test_places_are_said_as_scales_have_them(place, words):
    assert where(PlacePlan(name="a", **place)) == words
