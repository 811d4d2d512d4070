"""Base and tip exchange: the identity, nothing moves at the swap, and a step from the mobile base to the wall."""

import numpy as np
import pinocchio as pin
import pytest

from tutorialbot.errors import InvalidType, InvalidValue, TutorialbotError
from tutorialbot.ik.role_swap import (
    F,
    Stance,
    body_poses,
    free_end_velocity,
    is_at,
    move,
    step_over,
    step_to_wall,
    swap,
)
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.seeding import make_rng

ARM = SphericalArm()
Q = np.array([0.3, 1.2, -0.4, 1.1, 0.5, 0.9, 0.1])


def drawn(count, seed):
    rng, limits = make_rng(seed), np.array(ARM.limits)
    for _ in range(count):
        yield Stance(ARM, pin.exp6(rng.normal(size=6)), rng.uniform(-limits, limits))


def apart(a, b):
    return np.abs(a.homogeneous - b.homogeneous).max()


def test_the_identity_behind_it():
    for stance in drawn(300, 31):
        seen = F * ARM.forward(stance.q[::-1].copy()) * F
        assert apart(ARM.forward(stance.q).inverse(), seen) < 1e-12


def test_no_body_moves_at_the_swap_and_twice_is_nothing():
    for stance in drawn(300, 32):
        after = swap(stance)
        assert after.anchor == "tip" and (after.built_q == stance.q).all()
        moved = [apart(a, b) for a, b in zip(body_poses(stance), body_poses(after), strict=True)]
        assert len(moved) == 8 and max(moved) < 1e-12
        assert apart(after.free_end, stance.fixture * F) < 1e-12
        again = swap(after)
        assert apart(again.fixture, stance.fixture) < 1e-12 and (again.q == stance.q).all() and again.anchor == "base"


def test_bodies_stand_where_pinocchio_has_them():
    stance = Stance(ARM, pin.SE3.Identity(), Q)
    pin.forwardKinematics(ARM.model, ARM.data, Q)
    assert apart(body_poses(stance)[0], pin.SE3.Identity()) == 0.0
    assert all(apart(body_poses(stance)[i], ARM.data.oMi[i]) == 0.0 for i in range(1, 8))


def test_a_swapped_arm_moves_its_free_end_by_the_same_inverse_kinematics():
    stance = swap(Stance(ARM, pin.exp6(np.array([0.1, 0.2, 0.3, 0.5, -0.2, 0.4])), Q))
    twist, h = np.array([0.1, -0.2, 0.05, 0.2, 0.1, -0.3]), 1e-6
    qdot = free_end_velocity(stance, twist).qdot
    before, after = (Stance(ARM, stance.fixture, stance.q + d * qdot, "tip").free_end for d in (-h, h))
    turn = pin.log3(after.rotation @ before.rotation.T)
    moved = np.concatenate([after.translation - before.translation, turn]) / (2 * h)
    np.testing.assert_allclose(moved, twist, atol=1e-7)


def test_it_steps_from_the_mobile_base_to_the_wall():
    way = list(step_to_wall())
    anchors = [stance.anchor for stance in way]
    swapped = anchors.index("tip")
    assert set(anchors[:swapped]) == {"base"} and set(anchors[swapped:]) == {"tip"}
    base, wall = way[0].fixture, way[-1].fixture
    assert all(apart(stance.fixture, base) == 0.0 for stance in way[:swapped])
    assert wall.translation == pytest.approx([0.75, 0.2, 1.1], abs=2e-4) and wall.rotation[0, 2] == pytest.approx(-1.0)
    assert way[-1].free_end.translation == pytest.approx([0.3, 0.35, 0.9], abs=2e-4)
    jumps = [max(apart(a, b) for a, b in zip(body_poses(one), body_poses(two), strict=True))
             for one, two in zip(way, way[1:], strict=False)]  # fmt: skip
    assert jumps[swapped - 1] < 1e-12 < max(jumps) < 0.05


def test_a_target_out_of_reach_ends_short_of_it_and_base_and_tip_keep_their_roles():
    stance = Stance(ARM, pin.SE3.Identity(), Q)
    far = pin.SE3(stance.free_end.rotation, np.array([1.2, 0.0, 0.4]))
    way = list(step_over(stance, far * F, stance.free_end, dt=0.02, patience=2.0))
    assert len(way) > 10 and not is_at(way[-1], far)
    assert all(one.anchor == "base" and (np.abs(one.q) <= ARM.limits).all() for one in way)


@pytest.mark.parametrize(("call", "kind", "says"), [
    (lambda: Stance(SphericalArm(0.4, 0.3), pin.SE3.Identity(), Q), InvalidValue, "lower = 0.3: expected upper = 0.4"),
    (lambda: Stance(SphericalArm(tip_offset=0.2), pin.SE3.Identity(), Q), InvalidValue, "tip_offset = 0.2"),
    (lambda: Stance(SphericalArm(limits=(1, 2, 3, 2, 3, 2, 3)), pin.SE3.Identity(), Q), InvalidValue, "limits = "),
    (lambda: Stance(ARM, np.eye(4), Q), InvalidType, "fixture"), (lambda: Stance(ARM, F, Q[:6]), InvalidValue, "q = "),
    (lambda: Stance(ARM, F, Q, "elbow"), InvalidValue, "anchor = 'elbow'"),
    (lambda: list(step_over(Stance(ARM, F, Q), F, F, speed=0.0)), InvalidValue, "speed = 0.0"),
    (lambda: list(move(Stance(ARM, F, Q), None)), InvalidType, "target = None"),
])  # fmt: skip
def test_bad_input_is_named(call, kind, says):
    with pytest.raises(kind) as raised:
        call()
    assert says in str(raised.value)


@pytest.mark.parametrize("call", [
    swap, body_poses, lambda stance: free_end_velocity(stance, np.zeros(6)), lambda stance: list(move(stance, F)),
    lambda stance: is_at(stance, F), lambda stance: list(step_over(stance, F, F)),
])  # fmt: skip
def test_what_is_no_stance_is_named(call):
    for stance in (None, "base", Q):
        with pytest.raises(InvalidType, match="^stance = .*a Stance$"):
            call(stance)


BAD_MOVES = {
    "speed": (-1.0, 1e-300, 1e300, np.nan, "x"), "dt": (0.0, 1e-300, 1e300, np.nan, "x"), "gain": (-1.0, None),
    "patience": (0.0, 1e300, np.nan, None), "near": (0.0, np.nan, "x"),
}  # fmt: skip


@pytest.mark.parametrize("argument", BAD_MOVES)
def test_motions_without_end_are_named(argument):
    stance = Stance(ARM, F, Q)
    for value in BAD_MOVES[argument]:
        with pytest.raises(TutorialbotError, match=f"^{argument} = "):
            next(move(stance, F, **{argument: value}))


def test_poses_are_asked_for_before_anything_moves():
    stance = Stance(ARM, F, Q)
    for call, argument in (
        (lambda: is_at(stance, None), "target"), (lambda: is_at(stance, F, 0.0), "near"),
        (lambda: next(step_over(stance, None, F)), "fixture"), (lambda: next(step_over(stance, F, "down")), "rest"),
    ):  # fmt: skip
        with pytest.raises(TutorialbotError, match=f"^{argument} = "):
            call()


def test_who_is_there_already_has_no_way_to_go():
    stance = Stance(ARM, F, Q)
    assert all(is_at(one, stance.free_end) for one in move(stance, stance.free_end))
