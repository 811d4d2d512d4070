"""Wavefront and potential field: the first against scipy's shortest paths, the second where it is known to stall."""

import numpy as np
import pytest
from scipy.ndimage import maximum_filter
from scipy.sparse import lil_matrix
from scipy.sparse.csgraph import shortest_path

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.vox2c import fields, labels, motions
from tutorialbot.vox2c.scenes import random_scene

SEEDS = range(4_200_000, 4_200_006)


def random_map(n: int, share: float, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random((n, n)) < share


def angles(cells, n: int) -> np.ndarray:
    return 2 * np.pi * (np.asarray(cells) / n - 0.5)


def steps_by_scipy(cspace: np.ndarray, goal: tuple) -> np.ndarray:
    n = len(cspace)
    graph = lil_matrix((n * n, n * n))
    for i, j in np.argwhere(~cspace):
        for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            k, m = (i + a) % n, (j + b) % n
            if not cspace[k, m]:
                graph[i * n + j, k * n + m] = 1
    found = shortest_path(graph.tocsr(), indices=goal[0] * n + goal[1], unweighted=True).reshape(n, n)
    return np.where(np.isfinite(found) & ~cspace, found, -1)


@pytest.mark.parametrize(("n", "share"), [(3, 0.2), (8, 0.3), (12, 0.4), (18, 0.35), (18, 0.0), (2, 0.0), (1, 0.0)])
def test_the_wavefront_counts_the_shortest_way(n, share):
    for seed in range(5):
        cspace = random_map(n, share, seed)
        goal = tuple(np.argwhere(~cspace)[0])
        np.testing.assert_array_equal(fields.wavefront(cspace, angles(goal, n)), steps_by_scipy(cspace, goal))


def test_paths_are_as_short_as_scipys_and_free():
    for seed in range(20):
        cspace, n = random_map(18, 0.35, seed), 18
        free = np.argwhere(~cspace)
        start, goal = free[3], free[-4]
        steps = steps_by_scipy(cspace, tuple(goal))[tuple(start)]
        path = fields.path(cspace, angles(start, n), angles(goal, n))
        if steps < 0:
            assert path.shape == (0, 2)
            continue
        assert np.abs(np.diff(path, axis=0)).sum() == pytest.approx(steps * 2 * np.pi / n)
        np.testing.assert_allclose(path[0], angles(start, n))
        np.testing.assert_allclose(motions.wrap(path[-1] - angles(goal, n)), 0, atol=1e-9)
        for a, b in zip(path[:-1], path[1:], strict=True):
            assert not motions.map_blocks_motion(cspace, *a, *b, motions.SEARCH_STEP)


def test_a_path_goes_over_the_seam():
    cspace = np.zeros((72, 72), dtype=bool)
    path = fields.path(cspace, np.radians([175, 0]), np.radians([-175, 0]))
    assert np.degrees(motions.length(path)) == pytest.approx(10)


def test_long_straight_ways_keep_their_direction():
    cspace = np.zeros((72, 72), dtype=bool)
    cspace[30:32] = True  # a wall across theta1: the way from one side to the other is nearly a whole turn
    path = fields.path(cspace, angles((29, 5), 72), angles((33, 5), 72))
    assert np.degrees(motions.length(path)) == pytest.approx(5 * 68)
    assert np.abs(np.diff(path, axis=0)).max() < np.pi


def test_the_wavefront_has_no_hollow_but_the_goal():
    for seed in SEEDS:
        cspace = labels.exact_cspace(random_scene(seed), 5)
        goal = np.argwhere(~cspace)[seed % 50]
        field = fields.wavefront(cspace, angles(goal, 72))
        np.testing.assert_array_equal(np.argwhere(fields.hollows(field)), [goal])
        assert not fields.stalled(field, angles(goal, 72)).any()


def trap() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A pocket that opens away from the goal, with the start inside."""
    cspace = np.zeros((72, 72), dtype=bool)
    cspace[30:43, 40] = cspace[30, 30:41] = cspace[42, 30:41] = True
    return cspace, angles((36, 36), 72), angles((36, 50), 72)


def test_the_potential_field_stalls_in_a_pocket_and_the_wavefront_does_not():
    cspace, start, goal = trap()
    field = fields.potential(cspace, goal)
    assert fields.stalled(field, goal)[36, 36]
    assert fields.path(cspace, start, goal, "potential").shape == (0, 2)
    hollow = fields.descend(field, start)[-1]
    assert fields.hollows(field)[tuple(hollow)] and tuple(hollow) != (36, 50)
    assert len(fields.path(cspace, start, goal)) > 2


def test_the_potential_field_gets_there_where_nothing_is_in_the_way():
    cspace = np.zeros((72, 72), dtype=bool)
    goal = angles((10, 60), 72)
    field = fields.potential(cspace, goal)
    assert not fields.stalled(field, goal).any()
    path = fields.path(cspace, angles((30, 5), 72), goal, "potential")
    assert np.degrees(np.abs(np.diff(path, axis=0)).sum()) == pytest.approx(5 * (20 + 17))


def test_obstacles_push_within_their_influence_only():
    cspace = np.zeros((72, 72), dtype=bool)
    cspace[0, 0] = True
    field = fields.potential(cspace, (0.0, 0.0), influence=0.5)
    i, j = np.indices((72, 72))
    pull = 0.5 * ((i - 36) ** 2 + (j - 36) ** 2) * np.radians(5) ** 2
    away = fields.distance_to_obstacles(cspace)
    far, near = away >= 0.5, (away > 0) & (away < 0.5)
    np.testing.assert_allclose(field[far], pull[far], atol=1e-12)
    push = 0.5 * fields.REPULSION * (1 / away[near] - 2) ** 2
    np.testing.assert_allclose(field[near], pull[near] + push)
    assert np.isinf(field[0, 0])


def test_of_equal_neighbours_a_descent_leaves_neither():
    field = np.zeros((6, 6))
    field[3, 3] = 1.0
    assert fields.descend(field, angles((1, 1), 6)).tolist() == [[1, 1]]
    assert len(fields.descend(field, angles((3, 3), 6))) == 2
    assert fields.hollows(field).sum() == 35


def test_stalled_is_where_a_descent_ends_elsewhere():
    cspace = labels.exact_cspace(random_scene(SEEDS[0]), 10)
    goal = np.argwhere(~cspace)[7]
    field = fields.potential(cspace, angles(goal, 36))
    found = fields.stalled(field, angles(goal, 36))
    for cell in np.argwhere(~cspace):
        last = fields.descend(field, angles(cell, 36))[-1]
        assert found[tuple(cell)] == (tuple(last) != tuple(goal))
    assert not found[cspace].any()


def test_distance_to_obstacles_wraps():
    cspace = np.zeros((36, 36), dtype=bool)
    cspace[0, 0] = True
    found = fields.distance_to_obstacles(cspace)
    i, j = np.indices((36, 36))
    expected = np.hypot(np.minimum(i, 36 - i), np.minimum(j, 36 - j)) * np.radians(10)
    np.testing.assert_allclose(found, expected)
    assert np.isinf(fields.distance_to_obstacles(~np.ones((4, 4), dtype=bool))).all()


def test_widened_and_nearest_free_cells():
    for seed in range(5):
        cspace = random_map(18, 0.1, seed)
        np.testing.assert_array_equal(fields.widened(cspace), maximum_filter(cspace, 3, mode="wrap"))
        for q in np.random.default_rng(seed).uniform(-4, 4, (40, 2)):
            cell = fields.free_cell(cspace, *q)
            own = motions.cell(q[0], 18), motions.cell(q[1], 18)
            around = [((own[0] + a) % 18, (own[1] + b) % 18) for a in (-1, 0, 1) for b in (-1, 0, 1)]
            free = [one for one in around if not cspace[one]]
            if not cspace[own] or not free:
                assert cell == own
            else:
                away = [motions.distance(q, angles(one, 18)) for one in free]
                assert motions.distance(q, angles(cell, 18)) == pytest.approx(min(away))


def test_many_starts_share_one_field():
    cspace = labels.exact_cspace(random_scene(SEEDS[1]), 5)
    free = np.argwhere(~cspace)
    goal = angles(free[100], 72)
    field = fields.wavefront(cspace, goal)
    for cell in free[::500]:
        start = angles(cell, 72)
        np.testing.assert_array_equal(fields.along(field, start, goal), fields.path(cspace, start, goal))


@pytest.mark.parametrize(
    ("cspace", "error"),
    [(np.zeros((4, 5), bool), InvalidValue), (np.zeros((4, 4)), InvalidType), (np.zeros((0, 0), bool), InvalidValue),
     (None, InvalidType), ("map", InvalidType)],
)  # fmt: skip
def test_odd_maps_are_named(cspace, error):
    for call in (
        lambda m: fields.wavefront(m, (0, 0)),
        lambda m: fields.potential(m, (0, 0)),
        lambda m: fields.path(m, (0, 0), (1, 1)),
        fields.distance_to_obstacles,
    ):
        with pytest.raises(error, match="^cspace = "):
            call(cspace)


def test_odd_ends_and_weights_are_named():
    cspace = np.zeros((4, 4), bool)
    with pytest.raises(InvalidValue, match="^goal = "):
        fields.wavefront(cspace, (0, np.nan))
    with pytest.raises(InvalidValue, match="^start = "):
        fields.path(cspace, (0, np.inf), (0, 0))
    with pytest.raises(InvalidValue, match="^planner = "):
        fields.path(cspace, (0, 0), (0, 0), "RRT")
    with pytest.raises(InvalidValue, match="^influence = "):
        fields.potential(cspace, (0, 0), influence=0.0)
