"""The references of notebook 3's exercises agree with ways to compute the same that share no line with them."""

import coal
import numpy as np
import pytest
import torch
from scipy.ndimage import distance_transform_edt

from tests.exercises.sets import SOLUTIONS
from tutorialbot.checks import cspace_descent, cspace_grids, cspace_motion, cspace_numbers, cspace_rectangles
from tutorialbot.checks.counting import packages_called
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import arm, grids
from tutorialbot.vox2c.scenes import random_scene


def test_rectangles_meet_where_coal_says_so():
    a, b = (np.array(r) for r in cspace_rectangles._draw(make_rng(41), 3000, (np.pi, np.pi)))
    seen = []
    for pair in zip(a, b, strict=True):
        placed = []
        for x, z, long, wide, angle in pair:
            c, s = np.cos(angle), np.sin(angle)
            turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
            placed += [coal.Box(2 * wide, 1.0, 2 * long), coal.Transform3s(turn, np.array([x, 0.0, z]))]
        seen.append(coal.collide(*placed, coal.CollisionRequest(), coal.CollisionResult()) > 0)
    assert (np.array(seen) == (cspace_rectangles.overlap(a, b) > 0)).all()
    assert 0.3 < np.mean(seen) < 0.9


def test_the_pairs_that_touch_do_but_for_rounding():
    depth = cspace_rectangles.overlap(*cspace_rectangles._touching(make_rng(42), 500))
    assert np.abs(depth).max() < 1e-12 and (depth > 0).any() and (depth < 0).any()


def test_the_scenes_of_the_arm_have_hits_of_both_links():
    for second, third, expected in cspace_grids._arm_cases():
        assert second.any() and third.any() and not expected.all()
        assert (cspace_grids.own_angles(second, third) == expected).all()


def test_points_fall_into_the_voxels_of_the_package():
    scene = random_scene(43)
    counts = cspace_grids.voxel_counts(grids.point_cloud(scene), np.array(arm.DOMAIN[0]), 2.3 / 32, (32, 32, 32))
    assert ((counts > 0) == grids.voxelize(scene)).all()


def test_the_gradient_is_what_torch_derives():
    rng = make_rng(44)
    logits, gt = rng.normal(0.0, 3.0, (4, 9, 9)), rng.random((4, 9, 9))
    loss, down, up = cspace_numbers.loss_parts(logits, gt, 2.5)
    x, weight = torch.tensor(logits, requires_grad=True), torch.tensor(2.5)
    theirs = torch.nn.functional.binary_cross_entropy_with_logits(x, torch.tensor(gt), pos_weight=weight)
    theirs.backward()
    assert loss == pytest.approx(theirs.item(), rel=1e-12)
    assert up - down == pytest.approx(x.grad.numpy(), abs=1e-14)


def test_it_is_seen_whose_functions_are_called():
    x = torch.ones(3)
    for call in (lambda: torch.sigmoid(x), lambda: x.exp(), lambda: torch.nn.functional.softplus(x)):
        assert "torch" in packages_called(call)
    for call in (lambda: np.exp(np.ones(3)), lambda: np.ones(3).sum(), lambda: sorted([2, 1])):
        assert "torch" not in packages_called(call)


def test_the_links_of_the_arm_end_where_the_package_has_them():
    q = make_rng(45).uniform(-3.0, 3.0, (50, 2))
    places = cspace_motion.joint_places(q, np.array([arm.ELBOW, arm.MIDDLE + arm.HALF_LENGTH]))
    points = arm.forward_kinematics(q)[:, 1:] - arm.JOINT_1
    assert points[..., 2] + 1j * points[..., 0] == pytest.approx(places, abs=1e-12)


def test_as_many_steps_as_said_keep_every_point_within_and_far_fewer_do_not():
    rng = make_rng(46)
    for _ in range(50):
        turn, lengths, most = rng.uniform(-3.0, 3.0, 3), rng.uniform(0.1, 0.6, 3), 0.01
        n = cspace_motion.fewest(turn, lengths, most)
        places = [cspace_motion.joint_places(np.linspace(0, 1, k + 1)[:, None] * turn, lengths) for k in (n, n // 10)]
        moved = [np.abs(np.diff(place, axis=0)).max() for place in places]
        assert moved[0] <= most < moved[1]


def test_a_map_pays_with_the_first_query_that_makes_it_cheaper():
    for map_seconds, saving in make_rng(47).uniform(0.001, 1.0, (200, 2)):
        q = cspace_numbers.pays(map_seconds, saving)
        assert q * saving > map_seconds >= (q - 1) * saving
    assert cspace_numbers.pays(1.0, 0.25) == 5 and cspace_numbers.pays(1.0, 0.0) is None


def trials():
    return [*cspace_descent.simple_trials(), *cspace_descent.arm_trials()]


def test_the_cheapest_ways_are_dijkstras():
    for trial in trials():
        inputs = trial.blocked, trial.price, trial.goal
        assert cspace_descent.cheapest(*inputs) == pytest.approx(SOLUTIONS["downhill_values"](*inputs))


def test_a_descent_costs_what_it_costs_step_by_step():
    *_, trial = trials()
    inputs = trial.blocked, trial.price, trial.goal
    values = cspace_descent.cheapest(*inputs)
    whole, move = cspace_descent.descents(values, *inputs), cspace_descent.steepest(values, trial.blocked)[1]
    for place in make_rng(48).permutation(np.argwhere(np.isfinite(values)))[:50]:
        start, at, cost = tuple(place), tuple(place), 0.0
        while at != trial.goal:
            a, b = cspace_descent.MOVES[move[at]]
            to = (at[0] + a) % len(values), (at[1] + b) % len(values)
            assert not trial.blocked[[to[0], to[0], at[0]], [to[1], at[1], to[1]]].any() and values[to] < values[at]
            cost += np.hypot(a, b) * (trial.price[at] + trial.price[to]) / 2
            at = to
        assert cost == pytest.approx(whole[start])


def test_the_exact_values_leave_room_below_the_price_that_is_allowed():
    """Going down by fall over length is not quite the cheapest way even then."""
    for trial in trials():
        inputs = trial.blocked, trial.price, trial.goal
        best = cspace_descent.cheapest(*inputs)
        some = np.isfinite(best) & (best > 0)
        ratio = cspace_descent.descents(best, *inputs)[some] / best[some]
        assert ratio.max(initial=1.0) < 1.25 < cspace_descent.DEARER


def test_a_field_that_only_attracts_has_a_hollow_in_every_trap():
    for trial in cspace_descent.simple_trials():
        if trial.check == "trap":
            away = np.abs(np.indices((20, 20)) - np.reshape(trial.goal, (2, 1, 1)))
            field = np.where(trial.blocked, np.inf, np.hypot(*np.minimum(away, 20 - away)))
            reached = np.isfinite(cspace_descent.cheapest(trial.blocked, trial.price, trial.goal))
            assert (reached & (cspace_descent.steepest(field, trial.blocked)[0] <= 0)).sum() > 1


def test_prices_fall_with_the_distance_to_what_is_blocked():
    blocked = cspace_descent.diagonals(16, (3, 4))
    away = distance_transform_edt(~np.tile(blocked, (3, 3)))[16:32, 16:32]
    expected = 1 + 5 * np.exp(-((away / 2) ** 2))
    assert cspace_descent.near_obstacles(blocked, 5.0, 2.0) == pytest.approx(expected)
