"""The references of notebook 4's exercises agree with ways to compute the same that share no line with them."""

import itertools

import numpy as np
import pinocchio as pin
import pytest

from tests.exercises.sets import EXERCISES, SOLUTIONS
from tutorialbot.checks import passage_door, passage_elbow, passage_paths, passage_sharing, passage_swap
from tutorialbot.checks.counting import ByHand
from tutorialbot.checks.guard import Wrong
from tutorialbot.errors import InvalidValue
from tutorialbot.ik import role_swap
from tutorialbot.ik.singularity_consistent import SphericalArm, order_for_rate, time_scale
from tutorialbot.ik.stretch_paths import arc, classify
from tutorialbot.seeding import make_rng


def asked(name):
    """Return all inputs that the check of the exercise hands to its solution."""
    inputs = []

    def noted(*given):
        inputs.append(given)
        return SOLUTIONS[name](*given)

    assert EXERCISES[name].verdict(noted).outcome == "correct"
    return inputs


# --- by hand ----------------------------------------------------------------------------------------------------------
def test_it_is_seen_when_the_package_does_the_work():
    for call in (lambda: time_scale(0.1), lambda: SphericalArm().forward(np.zeros(7)), lambda: scene().seen()):
        with pytest.raises(Wrong) as caught:
            ByHand(call)()
        assert caught.value.check == "by hand" and "tutorialbot." in caught.value.reason


def test_what_is_no_work_of_the_package_is_allowed():
    for call in (lambda: np.sin(1.0), lambda: pin.exp3(np.ones(3)), lambda: passage_door.Closer(hold=60.0)):
        ByHand(call)()


# --- 1 to 3 -----------------------------------------------------------------------------------------------------------
def test_orders_are_those_of_the_package_where_the_period_limits_nothing():
    rng, few = make_rng(61), 0
    for upper, lower, speed, limit in rng.uniform((0.1, 0.1, 0.005, 1.0), (0.6, 0.6, 0.4, 8.0), (300, 4)):
        found = passage_elbow.greatest_order(upper, lower, speed, limit, 1e-9)
        try:
            expected = order_for_rate(SphericalArm(upper, lower), speed, limit)
        except InvalidValue:
            few, expected = few + 1, 0
        assert found == min(expected, 8)
    assert 10 < few < 200


def test_the_elbow_with_an_offset_is_pinocchios():
    for q4, upper, lower, offset in make_rng(62).uniform((-3, 0.2, 0.2, -0.1), (3, 0.5, 0.5, 0.1), (50, 4)):
        model = pin.Model()
        to_elbow = pin.SE3(np.eye(3), np.array([offset, 0.0, upper]))
        joint = model.addJoint(0, pin.JointModelRY(), to_elbow, "elbow")
        to_wrist = pin.SE3(np.eye(3), np.array([-offset, 0.0, lower]))
        frame, data = model.addFrame(pin.Frame("wrist", joint, to_wrist, pin.FrameType.OP_FRAME)), model.createData()
        pin.framesForwardKinematics(model, data, np.array([q4]))
        x, _, z = data.oMf[frame].translation
        jacobian = pin.computeFrameJacobian(model, data, np.array([q4]), frame, pin.LOCAL_WORLD_ALIGNED)
        r, slope, alpha, turn, longest = passage_elbow.virtual_joint(q4, upper, lower, offset)
        along = np.array([np.sin(alpha), np.cos(alpha)])
        assert (r * along).tolist() == pytest.approx([x, z])
        assert slope == pytest.approx(along @ jacobian[[0, 2]])
        assert turn * r == pytest.approx(along[::-1] * [1, -1] @ jacobian[[0, 2]])
        farthest = passage_elbow.virtual_joint(longest, upper, lower, offset)
        assert farthest[1] == pytest.approx(0.0, abs=1e-12) and farthest[0] >= r - 1e-12


@pytest.mark.parametrize(("scaling", "most"), [("sine", 1), ("quintic", 2)])
def test_the_packages_scales_have_as_many_derivatives_as_it_says(scaling, most):
    scale = passage_elbow.Scale(lambda q4, n: time_scale(q4, n, scaling), 2)
    coarse, fine = (scale.on_grid(step) for step in passage_elbow.GRIDS)
    for order in range(4):
        (wide, _), (leap, x) = passage_elbow.leaps(*coarse, order), passage_elbow.leaps(*fine, order)
        assert (leap < 0.6 * wide + 1e-4) == (order <= most)
        if order > most:
            assert abs(x) == pytest.approx(1.0, abs=0.02)


# --- 4, 5 -------------------------------------------------------------------------------------------------------------
def test_every_arc_begins_within_reach():
    few = dict.fromkeys(passage_paths.WORDS, 0)
    for hinge, radius, start, end, near, reach in asked("fate_on_arc"):
        assert near < passage_paths.distances(hinge, radius, np.array([start]))[0] < reach
        few[passage_paths.fate(hinge, radius, start, end, near, reach)[0]] += 1
    assert min(few.values()) >= 5


def test_fates_are_those_of_the_package():
    arm = SphericalArm()
    for margin in (0.02, 0.001, 0.0, -0.001, -0.02):
        path = arc(arm, margin)
        at = arm.reach - margin - path.radius  # the centre, on the line of the stretched arm
        ends = 0.25 / path.radius
        inputs = np.array([at, 0.0, 0.0]), path.radius, ends, -ends, 0.1, arm.reach
        assert passage_paths.fate(*inputs)[0] == classify(arm, path)


def test_a_follower_comes_back_on_both_branches():
    """Simulated: the arm does b times the twist; the error falls, as fast as |b| lets it."""
    rng = make_rng(63)
    for b, onward in itertools.product((1.0, 0.3, -0.3, -1.0), (1.0, -1.0)):
        here, direction, s = pin.SE3.Random(), np.array([1.0, 0.0, 0.0]), 0.0
        turn, away = pin.exp3(rng.uniform(-0.2, 0.2, 3)), rng.uniform(-0.02, 0.02, 3)
        wanted = pin.SE3(turn @ here.rotation, here.translation + away)
        origin, errors = wanted.translation.copy(), []
        for _ in range(1000):
            wanted.translation = origin + s * direction
            *twist, rate = passage_paths.followed(wanted, here, direction, b, onward, 0.1, 10.0, 1.0)
            errors.append(np.linalg.norm(wanted.translation - here.translation))
            moved = b * np.array(twist) * 1e-3
            here = pin.SE3(pin.exp3(moved[3:]) @ here.rotation, here.translation + moved[:3])
            s += rate * 1e-3
        assert errors[-1] == pytest.approx(errors[0] * np.exp(-10.0 * abs(b)), rel=0.1)
        assert s == pytest.approx(onward * b * 0.1)


# --- 6, 7 -------------------------------------------------------------------------------------------------------------
def test_a_hair_less_than_the_smallest_share_is_too_little():
    positive = 0
    for inputs in asked("least_share"):
        share = passage_sharing.smallest(*inputs)
        if share is None:
            assert passage_sharing.worst(np.array(1.0), *inputs) > 0.0
            continue
        assert passage_sharing.worst(np.array(share), *inputs) <= 0.0
        if share > 0.0:
            positive += 1
            assert passage_sharing.worst(np.linspace(0.0, share - 1e-4, 300), *inputs).min() > 0.0
    assert positive > 20


def test_the_chain_and_its_swap_are_the_packages():
    arm, q = SphericalArm(), make_rng(64).uniform(-1.5, 1.5, 7)
    rotation, place = passage_swap.tip(q, *passage_swap._arm())
    there = arm.forward(q)
    assert rotation == pytest.approx(there.rotation) and place == pytest.approx(there.translation)
    assert role_swap.F.rotation == pytest.approx(passage_swap.F)
    assert passage_swap.off(np.ones(7), *passage_swap._arm(), q) < 1e-12


def test_arms_said_not_to_be_symmetric_are_so_by_no_signs():
    rng, none = make_rng(65), 0
    for axes, offsets in asked("swap_signs"):
        q = rng.uniform(-1.5, 1.5, len(axes))
        every = itertools.product((1.0, -1.0), repeat=len(axes))
        best = min(passage_swap.off(np.array(signs), axes, offsets, q) for signs in every)
        symmetric = SOLUTIONS["swap_signs"](axes, offsets) is not None
        assert symmetric == (best < passage_swap.NEAR) and (symmetric or best > 1e-4)
        none += not symmetric
    assert none > 15


# --- 8 ----------------------------------------------------------------------------------------------------------------
def scene(seed=66, **door):
    return passage_door.Scene(passage_door.Closer(**door), make_rng(seed))


def acts(found, *actions):
    for action in actions:
        found.act(action)
    return found


def test_a_door_that_nobody_holds_shuts_and_beyond_its_hold_angle_stays():
    found = acts(scene(hold=200.0), "grasp", *["open"] * 7, "release")
    before = found.angle
    assert 30.0 < before < passage_door.ARM and found.hand == "free"
    assert acts(found, "wait").angle == pytest.approx(before - passage_door.FALL)
    found = acts(scene(hold=50.0), "grasp", *["open"] * 7, "release", "wait", "wait")
    assert found.angle >= 50.0 and np.isnan(found.seen().pull)


def test_the_pull_is_felt_where_the_robot_touches_and_ends_at_the_hold_angle():
    found = acts(scene(hold=40.0, torque=8.0), "grasp", "open")
    assert found.seen().pull == pytest.approx(8.0 + 6.0 * np.deg2rad(found.angle), abs=1.0)
    acts(found, *["open"] * 4)
    assert found.stays and abs(found.seen().pull) <= 1.0


def test_the_base_holds_the_door_and_refused_actions_change_nothing_but_time():
    found = acts(scene(hold=200.0), "grasp", "lean")
    assert (found.last, found.base) == ("refused", "before")
    acts(found, *["open"] * 7, "lean", "release", "wait", "wait", "wait")
    assert found.base == "leaning" and found.angle >= passage_door.ROOM
    assert acts(found, "release").last == "refused"


def test_a_hand_slips_never_twice_in_a_row_and_no_reading_is_lost_twice():
    found, slipped, lost = scene(slips=1.0, lost=1.0, hold=200.0), [], []
    for _ in range(20):
        found.act("grasp")
        slipped.append(found.last == "slipped")
        lost.append(found.seen().pull < 2.0)
        if found.hand == "knob":
            found.act("release")
    assert any(slipped) and not any(a and b for a, b in itertools.pairwise(slipped))
    assert not any(a and b for a, b in itertools.pairwise(lost))


def test_the_doors_are_all_kinds_of_doors_and_a_design_that_holds_passes_other_ones_too():
    rng = make_rng(67)
    for _, _, ranges in passage_door.TRIALS:
        for _ in range(50):
            door = passage_door.Closer(**{key: float(rng.uniform(*ends)) for key, ends in ranges.items()})
            found = passage_door.pass_door(SOLUTIONS["next_action"], door, rng)
            assert found.over and len(found.done) < passage_door.BUDGET
