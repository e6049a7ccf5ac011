"""Arms that speak G-code, over a pseudo-terminal."""

import threading
import time

import numpy as np
import pytest
from grbl import Grbl, Marlin
from stands import ARM, quiet, stand_of, write_plan

import impasto
from impasto import stand
from impasto.stand.desk import Desk
from impasto.stand.drivers import DriverError, open_light
from impasto.store import open_stack

SETTINGS = 'port = "/dev/ttyUSB0"'


@pytest.fixture
def arm():
    controller = Grbl()
    yield controller
    controller.close()


def light_of(folder, arm, *replace, arm_deg=(-40, 0, 40)):
    pairs = [(SETTINGS, f'port = "{arm.port}"'), ("timeout_s = 60", "timeout_s = 2"), *replace]
    path = write_plan(folder, light="gcode", arm=arm_deg, times=(1,), replace=pairs)
    made = stand_of(path, Desk())
    return open_light(made), made.plan


def test_a_lamp_stands_where_it_was_sent_when_the_call_returns(arm, tmp_path):
    light, plan = light_of(tmp_path, arm, ('lamp_on = ""', 'lamp_on = "M3 S1000"'),
                           ('lamp_off = ""', 'lamp_off = "M5"'))  # fmt: skip
    for place in plan.file.place:
        light.show(place)
        assert (arm.position, arm.state, arm.spindle) == (place.arm_angle_deg, "Idle", True)
    light.off()
    assert not arm.spindle
    assert arm.lines[0] == "G90 G1 X-40.000 F1200"
    light.close()


def test_an_error_is_named_with_its_meaning(arm, tmp_path):
    light, plan = light_of(tmp_path, arm, ("G90 G1 X", "G7 X"))
    with pytest.raises(DriverError, match=r"refused: error:20 \(it does not know this command\)"):
        light.show(plan.file.place[0])
    light.close()


def test_an_alarm_is_named_and_the_arm_stays_locked_until_somebody_homed_it(arm, tmp_path):
    arm.travel = 30
    light, plan = light_of(tmp_path, arm)
    with pytest.raises(DriverError, match=r"ALARM:2 \(the target is beyond the arm's travel\)"):
        light.show(plan.file.place[0])
    with pytest.raises(DriverError, match="locked by an alarm"):
        light.show(plan.file.place[1])
    assert "$X" not in arm.lines
    light.close()


def test_an_arm_that_may_home_is_homed_after_an_alarm(arm, tmp_path):
    arm.travel = 30
    light, plan = light_of(tmp_path, arm, ("home = false", "home = true"))
    with pytest.raises(DriverError, match="ALARM:2"):
        light.show(plan.file.place[0])
    arm.travel = 90
    light.show(plan.file.place[0])
    assert arm.position == -40
    assert arm.lines.count("$H") == 2  # at the start and after the alarm
    light.close()


def test_a_held_arm_goes_on_only_when_somebody_tries_again(arm, tmp_path):
    arm.speed = 100
    light, plan = light_of(tmp_path, arm)
    hold = threading.Timer(0.1, lambda: arm._take(b"!"))
    hold.start()
    with pytest.raises(DriverError, match="the arm is held"):
        light.show(plan.file.place[0])
    stood = arm.position
    assert -40 < stood < 0
    time.sleep(0.1)
    assert arm.position == stood
    light.show(plan.file.place[0])
    assert arm.position == -40
    light.close()


def test_an_arm_that_lost_its_place_is_noticed(arm, tmp_path):
    """Its motor skips steps: it reports idle, and another position than it was sent to."""
    light, plan = light_of(tmp_path, arm)
    move = arm._move

    def skip(elapsed):
        move(elapsed)
        if arm.state == "Idle" and arm._target == -40:
            arm.position = -38.0

    arm._move = skip
    with pytest.raises(DriverError, match=r"axis X stands at -38 and was sent to -40"):
        light.show(plan.file.place[0])
    light.close()


def arm_plan(folder, port):
    folder.mkdir(exist_ok=True)
    return write_plan(
        folder, light="gcode", arm=(-40, -20, 0, 20, 40), times=(1,),
        calibration=(), replace=[(SETTINGS, f'port = "{port}"'), ("timeout_s = 60", "timeout_s = 2"),
                                 ("settle_s = 1", "settle_s = 0")],
    )  # fmt: skip


def radiance(photos, store):
    impasto.stack(photos, store)
    stack = open_stack(store)
    return stack.lights.names, stack.radiance(slice(0, stack.shape[1]), slice(0, stack.shape[2]))


def test_a_line_that_drops_is_named_and_the_capture_goes_on_when_it_is_back(arm, tmp_path):
    """The cable is pulled between two photographs, and plugged in again: another port of the same name."""
    port = tmp_path / "arm"
    arms = [Grbl()]
    port.symlink_to(arms[0].port)
    said = []

    def say(line):
        said.append(line)
        if line.startswith("arm-020: painting") and len(arms) == 1:
            arms[0].close()
        if "serial line is gone" in line and len(arms) == 1:
            arms.append(Grbl())
            port.unlink()
            port.symlink_to(arms[1].port)

    summary = stand.run(arm_plan(tmp_path / "dropped", port), tmp_path / "photos", say=say)
    assert summary.complete
    assert len(arms) == 2
    assert arms[1].position == 40
    arms[1].close()

    undisturbed = tmp_path / "undisturbed"
    assert stand.run(arm_plan(undisturbed, arm.port), undisturbed / "photos", say=quiet).complete
    names, made = radiance(tmp_path / "photos", tmp_path / "store.zarr")
    expected_names, expected = radiance(undisturbed / "photos", undisturbed / "store.zarr")
    assert names == expected_names
    assert np.abs(made - expected).max() < 0.02  # the sensor's noise


def test_nobody_at_the_port_is_named(tmp_path):
    path = write_plan(tmp_path, light="gcode", arm=(0, 10), replace=[(SETTINGS, 'port = "/dev/nothing"')])
    with pytest.raises(DriverError, match="serial line is gone"):
        open_light(stand_of(path, Desk()))


def test_marlin_waits_for_the_end_of_the_move(tmp_path):
    arm = Marlin()
    light, plan = light_of(tmp_path, arm, ('"grbl"', '"marlin"'))
    for place in plan.file.place:
        light.show(place)
        assert arm.position == place.arm_angle_deg
    light.close()
    arm.close()


def test_a_capture_with_an_arm_sees_where_the_lamp_is(arm, tmp_path):
    plan = write_plan(
        tmp_path, light="gcode", times=(1,), calibration=(),
        replace=[(SETTINGS, f'port = "{arm.port}"'), ("settle_s = 1", "settle_s = 0")],
    )  # fmt: skip
    assert stand.run(plan, tmp_path / "photos", say=quiet).complete
    moves = [line for line in arm.lines if line.startswith("G90")]
    assert moves == [f"G90 G1 X{angle:.3f} F1200" for angle in ARM]
