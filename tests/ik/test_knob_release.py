"""Letting go of the knob beyond the hold angle (Figs 5, 6), and what a margin to the singularity costs."""

import math

import numpy as np
import pytest

from tutorialbot.errors import InvalidValue, TutorialbotError
from tutorialbot.ik.base_sharing import tip_in_world
from tutorialbot.ik.full_workspace import full_workspace, largest_opening, needed_reach, volume_share
from tutorialbot.ik.knob_release import DISTANCE, OFF, WAYS, release, stance
from tutorialbot.ik.singularity_consistent import SphericalArm, elbow_peak_rate
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT
from tutorialbot.seeding import make_rng

ARM, DOOR = SphericalArm(), ClosingDoor(hold_angle=math.radians(75.0))


def test_the_hand_is_at_the_knob_and_the_arm_nearly_stretched():
    opening = math.radians(80.0)
    base, q = stance(ARM, DOOR, opening)
    ARM.checked(q)
    tip = tip_in_world(ARM, base, q)
    assert np.abs(tip.homogeneous - DOOR.knob_frame(opening).homogeneous).max() < 1e-12
    shoulder = np.array([*base[:2], ANCHOR_HEIGHT + ARM.base_offset])
    wrist = tip.translation - ARM.tip_offset * tip.rotation[:, 2]
    assert np.linalg.norm(wrist - shoulder) == pytest.approx(DISTANCE)
    assert ARM.distance_at(q[3]) == pytest.approx(DISTANCE)


@pytest.mark.parametrize("n", [2, 3])
def test_the_arm_alone_enters_the_region_with_bounded_rates_and_comes_back_flipped(n):
    found = release(n=n)
    assert found.held and found.entered and found.flipped
    assert np.abs(found.q[:, 3]).min() < math.radians(1.0) < found.epsilon
    assert found.sin_q4[0] > 0.0 > found.sin_q4[-1] and (np.diff(found.sin_q4) < 0.0).all()
    assert found.peak_rate < elbow_peak_rate(ARM, 0.1, n)
    assert found.off[-1] == pytest.approx(0.0, abs=1e-3) and 0.01 < found.off.max() < 0.03
    assert found.error.max() < 1e-4


def test_the_pseudo_inverse_does_not_survive_it():
    found = release("pseudo-inverse")
    assert found.peak_rate > 100.0 and found.error.max() > 0.1


def test_with_the_base_inside_the_hand_lets_go_in_time():
    found = release("base inside")
    assert found.entered and not found.flipped
    assert found.off[-1] == pytest.approx(OFF, abs=1e-3) and found.times[-1] == pytest.approx(OFF / 0.1, abs=0.01)
    assert found.error.max() < 1e-4 and found.peak_rate < 2.5
    assert 0.01 < np.linalg.norm(found.base[-1, :2] - found.base[0, :2]) < OFF


def test_a_door_short_of_its_hold_angle_is_not_held():
    assert not release(opening_deg=70.0).held and release(opening_deg=75.0).held


@pytest.mark.parametrize(("call", "says"), [
    (lambda: release("force"), "way = 'force'"), (lambda: release(distance=0.8), "distance = 0.8"),
    (lambda: release(distance=0.1), "distance = 0.1"), (lambda: release(opening_deg=200.0), "opening_deg = 200.0"),
    (lambda: release(n=0), "n = 0"), (lambda: volume_share(ARM, 3.0), "margin = 3.0"),
    (lambda: needed_reach(ARM, DOOR, 0.5, "firm"), "grasp = 'firm'"),
    (lambda: largest_opening(ARM, DOOR, 1.5), "share = 1.5"),
    (lambda: largest_opening(ARM, DOOR, 0.5, margins=(2.6,)), "margin = 2.6"),
    (lambda: release("pseudo-inverse", n=0), "n = 0"), (lambda: stance(ARM, DOOR, 1.4, slant=math.nan), "slant = nan"),
    (lambda: stance(ARM, DOOR, math.inf), "opening = inf"),
    (lambda: release(speed=1e300), "speed = 1e+300"), (lambda: release(dt=1e300), "dt = 1e+300"),
    (lambda: release(speed=1e-300), "speed = 1e-300"), (lambda: release(dt=1e-300), "dt = 1e-300"),
])  # fmt: skip
def test_bad_input_is_named(call, says):
    with pytest.raises(InvalidValue) as raised:
        call()
    assert says in str(raised.value)


NO_ROWS = (None, 1, ("a",), (), (np.nan,), (-1.0,), (1e9,))


@pytest.mark.parametrize("argument", ["margins_deg", "shares"])
@pytest.mark.parametrize("value", NO_ROWS, ids=repr)
def test_rows_of_margins_and_shares_are_checked(argument, value):
    with pytest.raises(TutorialbotError, match=f"^{argument} = "):
        full_workspace(**{argument: value})


def test_more_of_the_full_workspace_is_named():
    for call, argument in (
        (lambda: full_workspace("left"), "arm"), (lambda: full_workspace(door=3), "door"),
        (lambda: largest_opening(ARM, DOOR, 0.5, margins=None), "margins"), (lambda: volume_share(3, 0.1), "arm"),
        (lambda: needed_reach(ARM, DOOR, 0.5, step_deg=1e-300), "step_deg"),
        (lambda: needed_reach(ARM, DOOR, np.nan), "share"),
    ):  # fmt: skip
        with pytest.raises(TutorialbotError, match=f"^{argument} = "):
            call()


def test_ways_of_letting_go_are_three():
    assert set(WAYS) == {"singularity-consistent", "pseudo-inverse", "base inside"}


def test_the_space_left_is_that_of_random_points():
    rng, margin = make_rng(41), math.radians(50.0)
    r = np.linalg.norm(rng.uniform(-0.7, 0.7, (200_000, 3)), axis=1)
    there = (r >= ARM.distance_at(ARM.limits[3])) & (r <= ARM.reach)
    assert volume_share(ARM, margin) == pytest.approx((r[there] <= ARM.distance_at(margin)).mean(), abs=0.005)
    assert volume_share(ARM, 0.0) == 1.0


def test_the_door_opens_as_far_as_the_distance_allows():
    angles, far = needed_reach(ARM, DOOR, 0.3)
    opening = float(largest_opening(ARM, DOOR, 0.3)[0])
    assert far[np.searchsorted(angles, opening - 1e-9)] <= ARM.reach < far[np.searchsorted(angles, opening - 1e-9) + 1]
    data = full_workspace(shares=(0.0, 0.3, 0.9))
    assert (np.diff(data.opening, axis=2) <= 0.0).all() and (np.diff(data.opening, axis=1) >= 0.0).all()
    assert (data.opening[1] >= data.opening[0]).all() and (np.diff(data.volume) < 0.0).all()
    assert math.degrees(data.opening[0, 0, 0]) == pytest.approx(51.0, abs=2.0)  # a fixed base, a rigid grasp
    assert math.degrees(data.opening[0, 2, 0]) == pytest.approx(90.0)
