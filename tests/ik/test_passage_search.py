"""The search for way points, the free motions between postures, and the door that is let go."""

from dataclasses import replace

import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue, TutorialbotError
from tutorialbot.ik import passage_clearance as clearance
from tutorialbot.ik.passage import run_passage
from tutorialbot.ik.passage_closing import let_go, touching_angle
from tutorialbot.ik.passage_connect import connect, straight
from tutorialbot.ik.passage_doors import pass_random_doors
from tutorialbot.ik.passage_follow import Piece
from tutorialbot.ik.passage_guards import hand
from tutorialbot.ik.passage_legs import HandLeg, duration, hand_pose, least_jerk
from tutorialbot.ik.passage_plan import (
    DEG,
    KEEP,
    WayPoints,
    contact_point,
    footprint,
    opening_paths,
    options,
    spline_through,
    through_paths,
)
from tutorialbot.ik.passage_search import NoPlan, Plan, fitted, search, vary_opening, vary_through
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import BASE_RADIUS, PAD_BEHIND, PAD_RADIUS
from tutorialbot.seeding import make_rng

ARM, DOOR = SphericalArm(), ClosingDoor()
LOW, HIGH = np.full(7, -2.0), np.full(7, 2.0)


def free_but_for_a_wall(q: np.ndarray) -> np.ndarray:
    """A wall across joint 1 with a gap where joint 2 is above 1."""
    return (np.abs(q[:, 0]) > 0.2) | (q[:, 1] > 1.0)


def test_connect_goes_straight_where_it_can_and_round_where_it_must():
    a, b = np.r_[-1.0, np.zeros(6)], np.r_[1.0, np.zeros(6)]
    assert len(connect(lambda q: np.ones(len(q), bool), a, b, LOW, HIGH, make_rng(1000))) == 2
    path = connect(free_but_for_a_wall, a, b, LOW, HIGH, make_rng(1000))
    assert np.array_equal(path[0], a) and np.array_equal(path[-1], b) and len(path) > 2
    fine = np.vstack([p + np.linspace(0, 1, 200)[:, None] * (q - p) for p, q in zip(path[:-1], path[1:], strict=True)])
    assert free_but_for_a_wall(fine).mean() > 0.99  # the grain is 0.08 rad: a corner may be cut by less than that
    assert all(straight(free_but_for_a_wall, p, q) for p, q in zip(path[:-1], path[1:], strict=True))


def test_connect_gives_up():
    a, b = np.r_[-1.0, np.zeros(6)], np.r_[1.0, np.zeros(6)]

    def walled(q: np.ndarray) -> np.ndarray:
        return np.abs(q[:, 0]) > 0.2

    assert connect(walled, a, b, LOW, HIGH, make_rng(1000), tries=50) is None
    assert connect(walled, a, np.zeros(7), LOW, HIGH, make_rng(1000)) is None  # the end itself is not free


def test_least_jerk_begins_and_ends_at_rest():
    u = np.linspace(0.0, 1.0, 101)
    s, rate = least_jerk(u)
    assert s[0] == 0.0 and s[-1] == 1.0 and rate[0] == 0.0 and rate[-1] == 0.0
    assert np.abs(np.gradient(s, u)[1:-1] - rate[1:-1]).max() < 1e-2
    assert duration(np.full((5, 1), 2.0), np.array([1.0])) == pytest.approx(2.0 * 1.875, rel=1e-3)


def test_hands_are_where_the_door_says():
    way = WayPoints()
    paths = opening_paths(DOOR, way, 70 * DEG)
    for path in paths[1:5]:
        rotation, position = hand_pose(path, "knob", 0.0)
        for row, turned, tip in zip(path, rotation, position, strict=True):
            wanted = DOOR.knob_frame(row[3], row[4])
            assert np.abs(turned - wanted.rotation).max() < 1e-9 and np.abs(tip - wanted.translation).max() < 1e-9
    rotation, position = hand_pose(through_paths(DOOR, way, 70 * DEG)[1], "panel", 0.0)
    assert np.abs(np.cross(rotation[:, :, 0], rotation[:, :, 1]) - rotation[:, :, 2]).max() < 1e-12
    pad = DOOR.to_panel(70 * DEG, position[0] - PAD_BEHIND * rotation[0, :, 2])
    assert pad[1] == pytest.approx(DOOR.thickness / 2 + PAD_RADIUS, abs=1e-9)


def test_the_legs_of_the_opening_hang_together():
    paths = opening_paths(DOOR, WayPoints(), 70 * DEG)
    for before, after in zip(paths[:-1], paths[1:], strict=True):
        assert np.abs(before[-1] - after[0]).max() < 1e-9
    assert np.abs(paths[4][-1, :2] - through_paths(DOOR, WayPoints(), 70 * DEG)[1][0, :2]).max() < 1e-9
    corner = np.array([DOOR.width, DOOR.thickness / 2])
    assert np.linalg.norm(contact_point(DOOR, WayPoints()) - corner) == pytest.approx(BASE_RADIUS)


def test_footprint_sees_the_jamb_the_panel_and_a_second_lean():
    paths = through_paths(DOOR, WayPoints(), 70 * DEG)
    assert footprint(DOOR, paths) > 0.0
    moved = [path + np.r_[0.2, np.zeros(7)] for path in paths[1:]]
    assert footprint(DOOR, moved) < 0.0
    again = [*paths, paths[1][::-1]]  # leans at both ends
    assert footprint(DOOR, again) < 0.0
    away = opening_paths(DOOR, WayPoints(), 70 * DEG)[1:3]
    panel, frame = (clearance.base_alone(DOOR, path[:, 3], path[:, :2]) for path in away)
    assert footprint(DOOR, away) == pytest.approx(min(*map(min, panel), *map(min, frame)) - KEEP)


def test_options_keep_their_swivel_and_all_reach_the_hand():
    paths = opening_paths(DOOR, WayPoints(), 70 * DEG)
    found, _, _ = options(ARM, DOOR, paths, "knob")
    assert len(found) > 5
    assert [option.effort for option in found] == sorted(option.effort for option in found)
    for option in found[:4]:
        for path, q in zip(paths, option.joints, strict=True):
            tip, _ = hand(ARM, path[:, :3], q)
            assert np.abs(tip - hand_pose(path, "knob", option.roll)[1]).max() < 1e-9


def test_what_is_out_of_reach_says_so():
    far = [path + np.r_[-0.6, np.zeros(7)] for path in opening_paths(DOOR, WayPoints(), 70 * DEG)[2:4]]
    found, guard, margin = options(ARM, DOOR, far, "knob")
    assert found == [] and guard == "reach" and margin < 0.0


def test_the_search_finds_what_the_usual_way_points_do_not_do():
    """Another opening than that which they were made for; the door and the seed are not those of the benchmark."""
    door = ClosingDoor.random(1003)
    first = search(ARM, door, 55 * DEG, seed=1003, draws=1)
    assert isinstance(first, NoPlan) and first.margin < 0.0
    found = search(ARM, door, 55 * DEG, seed=1003)
    assert isinstance(found, Plan) and found.tried > 2
    passage = run_passage(door, opening_deg=55, seed=1003)
    assert passage.passed and passage.way == found.way and passage.looked_at == found.tried


def test_draws_are_the_seeds_own():
    way = fitted(DOOR, 70 * DEG)
    one, two, other = (vary_through(DOOR, vary_opening(way, make_rng(s), 50), make_rng(s)) for s in (1000, 1000, 1001))
    assert one == two != other


def test_a_small_opening_begins_with_less():
    assert fitted(DOOR, 30 * DEG).little == pytest.approx(15 * DEG)
    wide = fitted(ClosingDoor(width=1.0), 70 * DEG)
    assert wide.inside[0] > WayPoints().inside[0] and wide.inside[1] == WayPoints().inside[1]


@pytest.fixture(scope="module")
def last_leg():
    """The last phase of the usual passage, and its joints."""
    passage = run_passage()
    rows = passage.phase == len(passage.phases) - 1
    return passage.times[rows], passage.base[rows], passage.q[rows], passage.door_angle[rows]


def test_the_door_shuts_and_never_goes_into_the_hand(last_leg):
    _, base, q, theta = last_leg
    assert theta[0] > 25 * DEG and theta[-1] == pytest.approx(0.0, abs=1e-6)
    assert (theta - touching_angle(ARM, DOOR, base, q) > -1e-9).all()
    tip, axis = hand(ARM, base, q)
    pads = tip - PAD_BEHIND * axis
    inside = [DOOR.to_panel(angle, pad)[1] for angle, pad in zip(theta, pads, strict=True)]
    assert min(inside) > DOOR.thickness / 2 + PAD_RADIUS - 1e-6


def test_a_free_door_shuts_as_its_closer_says(last_leg):
    """Nothing in the way: compare with a fine integration of the same equation."""
    n = 120
    base, far = np.tile([0.5, 5.0, 0.0], (n, 1)), np.zeros((n, 7))
    piece = Piece(0.025 * np.arange(n), base, far, far, np.full(n, 0.5), np.zeros(n), np.ones(n))
    found = let_go(ARM, DOOR, piece).theta
    angle, rate, fine, step = 0.5, 0.0, [0.5], 1e-4
    for k in range(1, n * 250):
        torque = DOOR.closer(angle) + DOOR.hinge_damping * rate + np.sign(rate) * DOOR.hinge_friction
        rate -= step * torque / (DOOR.mass * DOOR.width**2 / 3.0)
        angle = max(0.0, angle + step * rate)
        if k % 250 == 0:
            fine.append(angle)
    assert found[-1] == 0.0
    assert np.abs(found[: len(fine)] - fine).max() < 0.01


def test_a_door_beyond_its_hold_angle_stays():
    open_door = ClosingDoor(hold_angle=30 * DEG)
    n = 10
    base, q = np.tile([0.5, 5.0, 0.0], (n, 1)), np.zeros((n, 7))
    piece = Piece(0.025 * np.arange(n), base, q, q, np.full(n, 0.8), np.zeros(n), np.ones(n))
    assert let_go(ARM, open_door, piece).theta[-1] == 0.8


def test_random_doors_are_passed_one_by_one():
    """Seeds that the way points were looked at with; those of the benchmark come in the heavy test."""
    results = list(pass_random_doors(range(1000, 1004)))
    assert [result.seed for result in results] == [1000, 1001, 1002, 1003]
    for result in results:
        assert result.passed and result.failure is None
        assert result.door == ClosingDoor.random(result.seed)
        assert result.min_clearance >= 0.04 and result.max_joint_rate <= 2.5 and result.max_tip_error <= 1e-4
    with pytest.raises(InvalidType, match="searched"):
        next(pass_random_doors([1000], searched="no"))


@pytest.mark.parametrize(("value", "named"), [
    (None, "seeds"), (1000, "seeds"), ("1000", "seeds"), ([1000, None], r"seeds\[1\]"), ([-1], r"seeds\[0\]"),
    ([0.5], r"seeds\[0\]"),
])  # fmt: skip
def test_seeds_of_doors_are_checked_before_the_first(value, named):
    with pytest.raises(TutorialbotError, match=f"^{named} = "):
        next(pass_random_doors(value))


@pytest.mark.full
def test_at_least_90_of_100_random_doors_are_passed():
    results = list(pass_random_doors(range(100)))
    assert sum(result.passed for result in results) >= 90
    assert all(result.min_clearance >= 0.04 for result in results if result.passed)


def test_hand_legs_hold_the_knob_only_where_they_should():
    plan = search(ARM, DOOR, 70 * DEG)
    held = [[leg.grasped for leg in phase.legs] for phase in plan.phases]
    assert held[:5] == [[False], [True], [True], [True], [True, False]]
    assert not any(sum(held[5:], []))
    assert all(isinstance(leg, HandLeg) for phase in plan.phases[:5] for leg in phase.legs)


TWICE = (0.47, -0.25)
BAD_WAYS = {
    "inside": [WayPoints().aside, (1e300, 0.0), (np.nan, 0.0)],
    "around": [(TWICE, TWICE, (0.25, 0.28)), (WayPoints().wide, TWICE, (0.25, 0.28)), ((1e300, 0.0),) * 3],
    "wide": [(1e200, 0.0), None], "little": [1e300, "x"], "pivots": [(1e300,) * 6], "hold": [(0.0, 0.0, 1e300)],
}  # fmt: skip


@pytest.mark.parametrize("argument", BAD_WAYS)
def test_way_points_that_make_no_path_are_named(argument):
    for value in BAD_WAYS[argument]:
        with pytest.raises(TutorialbotError, match=f"^{argument} = "):
            replace(WayPoints(), **{argument: value})
    with pytest.raises(InvalidValue, match="^points = "):
        spline_through(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]), 5)
