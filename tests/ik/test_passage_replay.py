"""The whole passage in MuJoCo: the door goes as planned, and what would happen without a pad or with other doors."""

import numpy as np
import pytest

from tutorialbot.ik.passage import Passage, run_passage
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.passage_world import Replay, replay

AGREE = np.deg2rad(3.0)  # the bound


def play(passage: Passage, door: ClosingDoor | None = None, **options) -> Replay:
    return replay(door or passage.door, passage.times, passage.base, passage.q, passage.grasped, **options)


@pytest.fixture(scope="module")
def passage() -> Passage:
    return run_passage()


@pytest.fixture(scope="module")
def played(passage) -> Replay:
    return play(passage)


def released(passage: Passage) -> float:
    """When the hand lets go of the knob [s]."""
    return float(passage.times[np.flatnonzero(passage.grasped)[-1]])


def test_the_door_goes_as_planned_and_only_pads_touch_it(passage, played):
    assert passage.passed and played.outcome == "finished" and played.bumps == ()
    assert np.abs(played.door_angle - passage.door_angle).max() < AGREE
    assert {touch.robot for touch in played.touches} == {"base_rim", "hand_pad"}
    base, hand = sorted(played.touches, key=lambda touch: touch.robot)
    assert base.first < released(passage) < hand.first < base.last < hand.last  # someone always holds it
    assert abs(played.door_angle[-1]) < 1e-3  # shut behind the robot
    assert played.base[-1, 1] > passage.door.wall[1]  # which is through


def test_the_servos_are_strong_enough_and_do_not_lag(passage, played):
    np.testing.assert_allclose(played.q, passage.q, atol=np.deg2rad(2.0))
    assert np.abs(played.torques).max() < 60.0 and played.base_lag.max() < 0.01
    assert played.grasp_gap < 1e-3


def test_without_the_bases_hold_the_door_shuts(passage):
    gone = play(passage, hold_by_base=False)
    later = np.interp(released(passage) + 2.5, passage.times, gone.door_angle)
    before = np.interp(released(passage), passage.times, gone.door_angle)
    assert np.rad2deg(before) > 60.0 and abs(np.rad2deg(later)) < 1.0


def test_beyond_the_hold_angle_it_stays_without_the_base(passage):
    resting = ClosingDoor(hold_angle=np.deg2rad(65.0))
    left = play(passage, resting, hold_by_base=False)
    while_free = (passage.times > released(passage)) & (passage.times < released(passage) + 4.0)
    assert np.rad2deg(np.abs(left.door_angle - passage.door_angle)[while_free]).max() < 3.0


@pytest.mark.parametrize(("opening_deg", "held"), [(84, True), (85, True), (85.5, False)])
def test_about_the_hold_angle_the_door_is_let_go_only_where_it_surely_stays(opening_deg, held):
    passage = run_passage(opening_deg=opening_deg, dynamics=True)
    assert passage.passed and passage.angle_gap < AGREE
    assert ("d turn about the knob" in passage.phases) == held


def test_without_the_hand_the_door_does_not_wait(passage):
    gone = play(passage, hold_by_hand=False)
    through = passage.phases.index("h go through")
    assert np.abs(gone.door_angle - passage.door_angle)[passage.phase == through].max() > 5 * AGREE


@pytest.mark.parametrize("seed", range(1000, 1003))
def test_other_doors_answer_as_planned(seed):
    passage = run_passage(ClosingDoor.random(seed))
    played = play(passage)
    up_to_h = passage.phase < len(passage.phases) - 1
    assert passage.passed and played.outcome == "finished" and played.bumps == ()
    assert np.abs(played.door_angle - passage.door_angle)[up_to_h].max() < AGREE
