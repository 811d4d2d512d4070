"""The passage through the door: what it promises, looked at with other means than those that made it."""

from dataclasses import replace

import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.ik import passage_guards as guards
from tutorialbot.ik.base_sharing import Shares, base_centre_velocity, tip_in_world, tip_velocity_by_base
from tutorialbot.ik.passage import Passage, run_passage, run_plan, run_with
from tutorialbot.ik.passage_follow import follow
from tutorialbot.ik.passage_legs import hand_pose
from tutorialbot.ik.passage_plan import DEG, WayPoints
from tutorialbot.ik.passage_search import PHASES, fitted, search
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import BASE_RADIUS, PAD_BEHIND, PAD_RADIUS

ARM, DOOR = SphericalArm(), ClosingDoor()


@pytest.fixture(scope="module")
def passage() -> Passage:
    return run_passage()


@pytest.fixture(scope="module")
def plan():
    return search(ARM, DOOR, 70 * DEG)


def during(passage: Passage, letters: str) -> np.ndarray:
    """Numbers of the samples in the phases that begin with one of `letters`, but for their last two."""
    inside = np.array([passage.phases[number][0] in letters for number in passage.phase])
    inside[:-2] &= (passage.phase[:-2] == passage.phase[1:-1]) & (passage.phase[1:-1] == passage.phase[2:])
    return np.flatnonzero(inside)


def test_the_usual_door_is_passed(passage):
    assert passage.passed and passage.failure is None
    assert passage.phases == PHASES
    assert passage.door_angle.max() == pytest.approx(70 * DEG, abs=1e-6)
    assert passage.door_angle[-1] == pytest.approx(0.0, abs=1e-3)
    assert passage.base[0, 1] < -BASE_RADIUS and passage.base[-1, 1] > DOOR.wall[1] + BASE_RADIUS


def test_it_keeps_what_the_paper_needs(passage):
    assert np.abs(passage.joint_rates).max() <= 2.5
    assert passage.min_clearance >= 0.04
    assert passage.max_tip_error <= 1e-4
    assert (np.abs(passage.q) <= np.array(ARM.limits)).all()
    assert all(min(report.margins.values()) >= 0.0 for report in passage.reports)


def test_times_grow_and_nothing_jumps(passage):
    step = np.diff(passage.times)
    assert step.min() > 1e-3 and step.max() < 0.03
    assert np.abs(np.diff(passage.q, axis=0) / step[:, None]).max() < 2.6
    assert np.abs(np.diff(passage.base, axis=0) / step[:, None]).max() < 0.7


def test_joint_rates_are_those_of_the_joints(passage):
    moved = np.diff(passage.q, axis=0)
    mean = 0.5 * (passage.joint_rates[1:] + passage.joint_rates[:-1]) * np.diff(passage.times)[:, None]
    assert np.abs(moved - mean).max() < 2e-3


def test_the_hand_is_at_the_knob_while_it_holds_it(passage):
    held = np.flatnonzero(passage.grasped)
    assert len(held) > 300
    for i in held[::7]:
        tip = tip_in_world(ARM, passage.base[i], passage.q[i])
        assert np.abs(tip.translation - DOOR.knob(passage.door_angle[i])).max() < 1e-4
        assert abs(abs(tip.rotation[2, 0]) - 1.0) < 1e-6  # its x axis is along the knob's upright bar


def test_the_pad_is_at_the_panel_while_the_arm_holds_the_door(passage):
    for i in during(passage, "gh")[::7]:
        tip = tip_in_world(ARM, passage.base[i], passage.q[i])
        ball = tip.translation - PAD_BEHIND * tip.rotation[:, 2]
        assert DOOR.to_panel(passage.door_angle[i], ball)[1] - DOOR.thickness / 2 == pytest.approx(PAD_RADIUS, abs=1e-4)


def test_between_knob_and_pad_the_base_leans_on_the_door(passage):
    angle = passage.door_angle
    let_go, holds = np.flatnonzero(passage.grasped)[-1], during(passage, "g")[0]
    assert holds - let_go > 100
    for i in range(let_go + 1, holds):
        corner = DOOR.panel_corners(angle[i])[2]
        assert np.linalg.norm(passage.base[i, :2] - corner) == pytest.approx(BASE_RADIUS, abs=5e-4)


def test_the_tip_stands_still_while_the_base_moves(passage):
    """Phases (d) and (g), nu_ref = 0: by the joint rates of the result and the base's way, not by the reference."""
    for letter, turns in (("d", True), ("g", False)):
        for i in during(passage, letter)[2:-2:9]:
            base_rate = (passage.base[i + 1] - passage.base[i - 1]) / (passage.times[i + 1] - passage.times[i - 1])
            pose = tip_in_world(ARM, passage.base[i], passage.q[i])
            c, s = np.cos(passage.base[i, 2]), np.sin(passage.base[i, 2])
            world = np.kron(np.eye(2), [[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ ARM.jacobian(passage.q[i])
            twist = world @ passage.joint_rates[i] + tip_velocity_by_base(base_rate, pose.translation, passage.base[i])
            assert np.abs(twist[:3]).max() < 5e-4
            assert np.abs(twist[3:5]).max() < 5e-4
            assert turns or abs(twist[5]) < 2e-3


def test_base_shares_the_motion_of_the_tip_while_the_door_opens_a_little(passage):
    """Phase (b), eq (4): nu_mb = K nu_ref with K of `Shares`, from the result's base and door."""
    inside = during(passage, "b")[3:-3]
    for i in inside[::5]:
        span = passage.times[i + 1] - passage.times[i - 1]
        rate = (passage.base[i + 1] - passage.base[i - 1]) / span
        before, after = (tip_in_world(ARM, passage.base[k], passage.q[k]) for k in (i - 1, i + 1))
        v = (after.translation - before.translation) / span
        turned = before.rotation.T @ after.rotation
        omega = np.arctan2(turned[2, 1] - turned[1, 2], turned[1, 1] + turned[2, 2]) / span  # about x, which is upright
        omega *= np.sign(before.rotation[2, 0])
        tip = tip_in_world(ARM, passage.base[i], passage.q[i]).translation
        nu_mb = Shares().matrix @ [*v, 0.0, 0.0, omega]
        assert np.abs(base_centre_velocity(nu_mb, tip, passage.base[i]) - rate).max() < 2e-3


def test_the_same_seed_gives_the_same_passage(passage):
    again = run_passage(seed=0)
    assert np.array_equal(again.q, passage.q) and np.array_equal(again.base, passage.base)


def test_a_door_that_stays_open_is_not_held():
    passage = run_passage(ClosingDoor(hold_angle=75 * DEG), opening_deg=80)
    assert passage.passed
    assert passage.phases == (*PHASES[:3], *guards.STAYING)
    assert passage.door_angle[-1] == pytest.approx(80 * DEG, abs=1e-6)
    assert passage.base[-1, 1] > DOOR.wall[1] + BASE_RADIUS
    assert passage.min_clearance >= 0.04 and np.abs(passage.joint_rates).max() <= 2.5
    assert "d turn about the knob" in run_passage(ClosingDoor(hold_angle=81 * DEG), opening_deg=80).phases


def altered(plan, number: int, **changes):
    """The plan with the first leg of a phase changed."""
    phase = plan.phases[number]
    legs = (replace(phase.legs[0], **changes), *phase.legs[1:])
    return replace(plan, phases=(*plan.phases[:number], replace(phase, legs=legs), *plan.phases[number + 1 :]))


def test_a_phase_that_is_too_fast_is_done_again_slower(plan):
    fast = altered(plan, 3, duration=0.4)
    passage = run_plan(ARM, DOOR, 70 * DEG, fast)
    assert passage.passed
    assert "slower" in passage.reports[3].recoveries
    assert passage.reports[3].joint_rate <= 2.5


def test_an_arm_that_is_stretched_has_the_base_come_closer(plan):
    passage = run_plan(ARM, DOOR, 70 * DEG, altered(plan, 2, path=farther(plan, 2, 0.3).path))
    assert "base closer" in passage.reports[2].recoveries
    assert passage.passed and passage.min_clearance >= 0.04
    assert passage.q[during(passage, "c"), 3].min() > guards.least_elbow(ARM) - 0.05


def farther(plan, number: int, by: float):
    """The first leg of a phase, its base led away from the hand by up to `by` [m]."""
    leg = plan.phases[number].legs[0]
    hand, path = hand_pose(leg.path, leg.grip, leg.roll)[1][:, :2], leg.path.copy()
    away = path[:, :2] - hand
    path[:, :2] += np.linspace(0.0, by, len(path))[:, None] * away / np.linalg.norm(away, axis=1)[:, None]
    return replace(leg, path=path)


def begun(plan, number: int) -> np.ndarray:
    """Joints at the beginning of a phase in which all before is done by hand legs."""
    q = plan.q
    for leg in (leg for phase in plan.phases[:number] for leg in phase.legs):
        q = follow(ARM, leg, q).q[-1]
    return q


def test_in_the_singular_region_base_door_and_arm_keep_one_pace(plan):
    """The base leaves the hand until the arm is stretched out: the tip stays on its path, all runs back together."""
    leg, q = farther(plan, 2, 0.3), begun(plan, 2)
    piece = follow(ARM, leg, q)
    assert piece.stop == "branch" and piece.s < 1e-6 and piece.q[-1, 3] < 0.0 < piece.q[0, 3]
    assert piece.scale.min() == -1.0 and piece.tip_error.max() < 1e-4
    turn = int(piece.theta.argmax())
    assert 0 < turn < len(piece.theta) - 1 and piece.theta[turn] < 69 * DEG
    assert abs(piece.scale[turn]) < 0.2
    assert np.abs(piece.base[-1] - piece.base[0]).max() < 1e-3 and abs(piece.theta[-1] - piece.theta[0]) < 1e-3


def test_a_watched_leg_stops_before_the_arm_is_stretched_out(plan):
    piece = follow(ARM, farther(plan, 2, 0.3), begun(plan, 2), nearest=guards.least_elbow(ARM))
    assert piece.stop == "stretch" and 0.3 < piece.s < 0.9
    assert guards.least_elbow(ARM) - 0.1 < piece.q[-1, 3] < guards.least_elbow(ARM)
    assert guards.stop_margin(ARM, piece) < 0.0


@pytest.mark.parametrize(
    ("number", "column", "off", "guard"),
    [
        (7, 0, 0.20, {"frame"}),  # (h) into the jamb
        (6, 0, -0.15, {"limits"}),  # (g) too near the hand
        (4, 1, 0.03, {"lean", "exit", "door"}),  # (e) the base does not come to lean, or leans into the door
    ],
)
def test_way_points_that_do_harm_are_found(plan, number, column, off, guard):
    leg = plan.phases[number].legs[0]
    path = leg.path.copy()
    path[:, column] += off * np.sin(np.linspace(0.0, np.pi / (2 if number == 4 else 1), len(path)))
    passage = run_plan(ARM, DOOR, 70 * DEG, altered(plan, number, path=path))
    assert not passage.passed
    assert passage.failure.phase == PHASES[number]
    assert passage.failure.guard in guard
    assert passage.failure.margin < 0.0
    assert passage.phases == PHASES[: number + 1]


def test_a_door_that_is_wider_than_it_was_planned_for_is_found(plan):
    wider = ClosingDoor(width=0.95, knob_from_edge=0.17)
    assert wider.knob_radius == pytest.approx(DOOR.knob_radius)
    passage = run_plan(ARM, wider, 70 * DEG, plan)
    assert not passage.passed
    assert passage.failure.phase in PHASES[2:5] and passage.failure.guard == "door" and passage.failure.margin < 0.0


def test_a_swivel_into_the_door_is_found(plan):
    turned = altered(plan, 3, swivel=plan.phases[3].legs[0].swivel + 2.4)
    passage = run_plan(ARM, DOOR, 70 * DEG, turned)
    assert not passage.passed and passage.failure.phase == PHASES[3]


def test_an_opening_too_small_for_the_robot_is_a_named_result():
    passage = run_passage(opening_deg=20)
    assert not passage.passed
    assert passage.phases == () and len(passage.times) == 0
    assert passage.failure.phase in PHASES and "footprint" in passage.failure.guard
    assert -1.0 < passage.failure.margin < 0.0


def test_given_way_points_are_taken_as_they_are():
    way = fitted(DOOR, 70 * DEG)
    assert run_with(way, DOOR).passed
    blocked = run_with(replace(way, inside=(0.75, 0.0)), DOOR)
    assert not blocked.passed and "footprint" in blocked.failure.guard and blocked.looked_at == 1


@pytest.mark.parametrize(
    ("arguments", "error", "named"),
    [
        ({"door": "front"}, InvalidType, "door"),
        ({"door": ClosingDoor(width=0.5, knob_from_edge=0.07)}, InvalidValue, "door"),
        ({"opening_deg": 5}, InvalidValue, "opening_deg"),
        ({"opening_deg": 170}, InvalidValue, "opening_deg"),
        ({"opening_deg": float("nan")}, InvalidValue, "opening_deg"),
        ({"opening_deg": "wide"}, InvalidType, "opening_deg"),
        ({"dynamics": 1}, InvalidType, "dynamics"),
        ({"seed": -1}, InvalidValue, "seed"),
        ({"seed": 0.5}, InvalidType, "seed"),
    ],
)
def test_bad_input_is_named(arguments, error, named):
    with pytest.raises(error, match=named):
        run_passage(**arguments)


def test_way_points_are_asked_for():
    with pytest.raises(InvalidType, match="way"):
        run_with({"start": (0.1, -0.6)})
    assert WayPoints() == WayPoints()


def test_a_base_that_leans_twice_in_a_phase_is_too_near(plan):
    """In (g) it leaves the door for good; coming back to it is no lean."""
    leg = plan.phases[6].legs[0]
    piece = follow(ARM, leg, begun_at(plan))
    there = guards.watch(ARM, DOOR, (leg,), [piece]).margins["door"]
    names = ("times", "base", "q", "rates", "theta", "tip_error", "scale")
    halves = {name: getattr(piece, name)[:150] for name in names}
    back = replace(piece, **{name: np.concatenate([half, half[::-1]]) for name, half in halves.items()})
    again = guards.watch(ARM, DOOR, (leg,), [back]).margins["door"]
    assert there >= 0.0 > again


def begun_at(plan) -> np.ndarray:
    """Joints at the beginning of (g)."""
    return run_plan(ARM, DOOR, 70 * DEG, replace(plan, phases=plan.phases[:6])).q[-1]
