"""Ways of the cleaning robot through narrow places: they are clear all along, not only where it was looked."""

import numpy as np
import pytest

from tutorialbot.cleaning import body, route
from tutorialbot.cleaning.lanes import in_room
from tutorialbot.cleaning.reach import solve_postures
from tutorialbot.cleaning.retreat import FAR
from tutorialbot.cleaning.task import prepare
from tutorialbot.cleaning.wriggle import MISSED, TURN, clear_between, moved, neighbours, turned
from tutorialbot.scene.room import ROOMS
from tutorialbot.seeding import make_rng

LEAST = 0.005
BELOW_TABLE = np.array([1.56, 0.81, np.deg2rad(135.0)]), np.array([0.81, 0.37])  # the nozzle behind the chair's leg


@pytest.fixture(scope="module")
def prepared():
    *_, postures = solve_postures(3)
    return prepare(ROOMS["living room"], postures)


def finely(prepared, a, b, count=200):
    """Return the clearance (count, n) [m] along even drives from states a to b (n, 5)."""
    shares = np.linspace(0.0, 1.0, count)[:, None, None]
    states = (a + shares * (b - a)).reshape(-1, 5)
    found = prepared.body.clearance(prepared.distances, states[:, :3], states[:, 3:])
    return found.reshape(count, len(a))


@pytest.fixture(scope="module")
def moves(prepared):
    """States (n, 5) below the table and others after one small move, which both keep LEAST, and how near (n,) [m] the
    robot comes to something on the way.
    """
    rng = make_rng(17)
    states = np.concatenate(BELOW_TABLE) + rng.uniform(-1.0, 1.0, (1000, 5)) * [0.2, 0.2, 0.4, 0.1, 0.0]
    after = neighbours(states).reshape(-1, 5)
    before = np.tile(states, (len(after) // len(states), 1))
    keeps = (prepared.body.clearance(prepared.distances, x[:, :3], x[:, 3:]) > LEAST for x in (before, after))
    kept = np.logical_and(*keeps)
    before, after = before[kept], after[kept]
    return before, after, finely(prepared, before, after, count=41).min(axis=0)


def test_small_moves_are_clear_between_their_ends(prepared, moves):
    before, after, least = moves
    said = clear_between(prepared.body, prepared.distances, before, after, LEAST)
    assert least[said].min() > LEAST - MISSED
    assert least[~said].max() < LEAST + MISSED
    assert 0 < (~said).sum() < 0.5 * len(said)


def test_a_look_half_way_would_not_do(prepared, moves):
    """The fault that was there: ends and half way are clear, and in between the robot brushes something."""
    before, after, least = moves
    half = (before + after) / 2
    seen = prepared.body.clearance(prepared.distances, half[:, :3], half[:, 3:]) > LEAST
    assert least[seen].min() < 0.001 < LEAST - MISSED


def test_a_turn_about_the_nozzle_moves_it_on_the_way():
    """Driven evenly in base and arm, the nozzle leaves the middle of the turn by millimetres, which must be counted."""
    start = np.array([[0.0, 0.0, 0.0, 1.0, 0.0]])
    end = turned(start, TURN, about_nozzle=True)
    half = (start + end) / 2
    away = in_room(half[:, :3], half[:, 3:]) - [[1.0, 0.0]]
    assert 0.001 < np.linalg.norm(away) < 0.005
    assert moved(start, end) > 0.9 * TURN


def test_a_way_from_below_the_table_is_found_and_clear(prepared):
    router = prepared.router
    assert router.exit(*BELOW_TABLE) is None  # neither drawn close nor driven straight back
    way = router.exit(*BELOW_TABLE, wriggle=True)
    states = np.column_stack([way.base, way.nozzle])
    assert finely(prepared, states[:-1], states[1:]).min() > route.TIGHT - MISSED
    assert states[0] == pytest.approx(np.concatenate(BELOW_TABLE))
    assert states[-1, 3:] == pytest.approx(route.DRAWN)
    assert router.component[way.node] == router.home


def test_the_tool_alone_knows_how_far_the_open_is(prepared):
    poses = np.array([[3.3, 1.2, 0.0], [0.725, 1.12, np.deg2rad(135.0)], [2.1, 3.4, 0.0]])  # free, table, sofa
    steps = prepared.router._retreat.steps(poses)
    assert steps[0] <= 2 < steps[1] < FAR == steps[2]


@pytest.mark.parametrize("tilt", [0.0, 0.3, 0.52, 0.75, 0.9, 1.57])
def test_columns_enclose_a_capsule(tilt):
    rng = make_rng(5)
    radius, half = 0.02, 0.3
    axis = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    x, y, radii, low, high = body._capsule(np.zeros(3), axis, np.array([radius, half]))
    points = rng.uniform(-half, half, (4000, 1)) * axis
    points[:1000] = np.where(rng.random((1000, 1)) < 0.5, half, -half) * axis
    out = rng.standard_normal((4000, 3))
    points += radius * out / np.linalg.norm(out, axis=1, keepdims=True)
    inside = np.hypot(points[:, :1] - x, points[:, 1:2] - y) <= radii + 1e-9
    inside &= (points[:, 2:] >= low - 1e-9) & (points[:, 2:] <= high + 1e-9)
    assert inside.any(axis=1).all()
    assert radii.max() < 0.035
