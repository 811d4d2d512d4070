"""Distances of the robot from the door, against shapely on the floor and coal in space."""

import coal
import numpy as np
import pytest
import shapely

from tutorialbot.ik import passage_clearance as clearance
from tutorialbot.ik import srs
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT, ARM_RADIUS, BASE_RADIUS

ARM, DOOR = SphericalArm(), ClosingDoor()


def test_segment_to_box_agrees_with_shapely():
    rng = np.random.default_rng(0)
    box = np.array([[-0.3, -0.1], [0.5, 0.2]])
    a, b = rng.uniform(-1.0, 1.0, (2, 500, 2))
    a[:20], b[:20, 1] = b[:20], b[:20, 1]  # some are points
    a[20:40, 0] = b[20:40, 0]  # some go along an axis
    found = clearance.segment_to_box(a, b, box)
    wanted = [shapely.LineString([p, q]).distance(shapely.box(*box.ravel())) for p, q in zip(a, b, strict=True)]
    assert (found == 0.0).any()
    assert np.abs(found - wanted).max() < 1e-12


def test_segment_to_segment_is_the_least_over_points_of_both():
    p, q, r, s = np.random.default_rng(1).uniform(-1.0, 1.0, (4, 200, 3))
    t = np.linspace(0.0, 1.0, 101)[:, None, None]
    one, two = p + t * (q - p), r + t * (s - r)
    sampled = np.linalg.norm(one[:, None] - two[None], axis=-1).min(axis=(0, 1))
    found = clearance.segment_to_segment(p, q, r, s)
    assert (found <= sampled + 1e-12).all()
    assert (sampled - found).max() < 0.02


def test_parallel_segments():
    p = np.array([[0.0, 0.0, 0.0]])
    assert clearance.segment_to_segment(p, p + [1, 0, 0], p + [0.3, 0.2, 0], p + [2, 0.2, 0])[0] == pytest.approx(0.2)


def coal_distance(points: np.ndarray, box: np.ndarray, pose) -> float:
    """Distance in space of the arm's upper arm (a capsule) from a box, by coal."""
    a, b = points[1], points[2]
    z = (b - a) / np.linalg.norm(b - a)
    x = np.cross(z, [0.3, 0.5, 0.7])
    x /= np.linalg.norm(x)
    capsule = coal.Capsule(ARM_RADIUS, float(np.linalg.norm(b - a)))
    at = coal.Transform3s(np.stack([x, np.cross(z, x), z], axis=1), (a + b) / 2)
    middle = pose.rotation @ box.mean(axis=0) + pose.translation
    result = coal.DistanceResult()
    return coal.distance(capsule, at, coal.Box(*(box[1] - box[0])), coal.Transform3s(pose.rotation, middle),
                         coal.DistanceRequest(), result)  # fmt: skip


def test_arm_from_panel_agrees_with_coal():
    rng, compared = np.random.default_rng(2), 0
    for _ in range(60):
        q, base = rng.uniform(-0.9, 0.9, 7) * ARM.limits, rng.uniform([-0.5, -1.2, -3.0], [1.5, -0.2, 3.0])
        theta = rng.uniform(0.0, 1.5)
        points = srs.chain(ARM, q)
        c, s = np.cos(base[2]), np.sin(base[2])
        world = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [base[0], base[1], ANCHOR_HEIGHT]
        wanted = coal_distance(world, DOOR.panel_box, DOOR.panel_frame(theta))
        found = clearance.measure(ARM, DOOR, np.array([theta]), base[None], q[None]).panel[0, 1]
        if wanted > 0.0:
            assert found == pytest.approx(wanted, abs=1e-5)
            compared += 1
    assert compared > 30


def test_base_touches_the_closed_panel_and_the_frame_where_it_should():
    door = DOOR
    before = np.array([[0.4, -door.thickness / 2 - BASE_RADIUS, 0.0]])
    panel, frame = clearance.base_alone(door, np.zeros(1), before)
    assert panel[0] == pytest.approx(0.0, abs=1e-12)
    right = door.opening[1]
    inside = np.array([[right - BASE_RADIUS - 0.03, 0.05, 0.0]])
    assert clearance.base_alone(door, np.full(1, 1.5), inside)[1][0] == pytest.approx(0.03, abs=1e-9)
    all_parts = clearance.measure(ARM, door, np.full(1, 1.5), inside, np.zeros((1, 7)))
    assert all_parts.frame[0, 0] == pytest.approx(0.03, abs=1e-9)


def test_an_arm_that_stands_up_is_measured_from_the_lintel():
    low = ClosingDoor(height=1.6)
    stands = clearance.measure(ARM, low, np.zeros(1), np.array([[0.4, -2.0, 0.0]]), np.zeros((1, 7)))
    assert stands.frame[0, 1:].max() < 0.0
    assert stands.frame[0, 0] > 1.0


def test_a_folded_arm_meets_itself_and_the_base():
    folded = np.array([[0.0, 0.2, 0.0, 3.0, 0.0, 0.0, 0.0], [0.0, 2.1, 0.0, 0.9, 0.0, 0.0, 0.0]])
    near = clearance.measure(ARM, DOOR, np.zeros(2), np.zeros((2, 3)), folded)
    assert near.itself[0] < 0.0
    assert near.deck[1] < 0.0
    upright = clearance.measure(ARM, DOOR, np.zeros(1), np.zeros((1, 3)), np.zeros((1, 7)))
    assert upright.itself[0] > 0.2 and upright.deck[0] > 0.1


def test_in_panel_is_the_doors_own():
    points = np.random.default_rng(3).uniform(-1.0, 1.0, (5, 2))
    wanted = DOOR.to_panel(0.7, np.column_stack([points, np.zeros(5)]))[:, :2]
    assert np.abs(clearance.in_panel(points[:, None], np.full(5, 0.7))[:, 0] - wanted).max() < 1e-12
