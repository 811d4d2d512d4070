"""Rooms: refused when they are none, solid where they look solid, and the same with and without what is only seen."""

import mujoco
import numpy as np
import pytest
import shapely

from tests.scene.postures import posture
from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.scene import furniture_kinds
from tutorialbot.scene.furniture import Furniture
from tutorialbot.scene.room import (
    BASE_RADIUS,
    BASE_TOP,
    MOVING,
    NOZZLE_HEIGHT,
    ROOMS,
    WALL_SOLID,
    WORKING_HEIGHT,
    Room,
    assemble,
    place,
)

FLOOR = np.array([[0, 0], [3, 0], [3, 2], [0, 2.0]])
L_SHAPE = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2.0]])
ARM = posture(0.3, 0.2, WORKING_HEIGHT)


def at_rest(model):
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return data


def ray(data, start, direction, group):
    """Distance [m] to the first geom of a group along a ray, -1 for none, and the name of its body."""
    model, hit = data.model, np.zeros(1, np.int32)
    start, direction = np.asarray(start, float), np.asarray(direction, float)
    far = mujoco.mj_ray(model, data, start, direction, np.arange(6) == group, 1, -1, hit)
    return far, model.body(model.geom_bodyid[hit[0]]).name if hit[0] >= 0 else ""


def test_three_rooms_with_pieces_to_go_around():
    assert len(ROOMS) == 3
    for name, room in ROOMS.items():
        assert room.name == name and 5 < room.area < 25 and room.furniture
        assert room.area == pytest.approx(shapely.Polygon(room.floor).area)
        model = room.spec().compile()
        bodies = {model.body(b).name for b in range(model.nbody)}
        assert bodies == {"world", *(piece.name for piece in room.furniture)}
    assert len(ROOMS["bedroom with a narrow passage"].floor) > 4


def test_the_passage_is_narrow_and_wide_enough_for_the_base():
    room = ROOMS["bedroom with a narrow passage"]
    bed, wardrobe = (
        shapely.Polygon(next(p for p in room.furniture if p.name == n).footprint) for n in ("bed", "wardrobe")
    )
    assert 2 * BASE_RADIUS + 0.2 < bed.distance(wardrobe) < 0.85


@pytest.mark.parametrize("name", ROOMS)
def test_without_what_is_seen_every_number_is_the_same(name):
    room, ends = ROOMS[name], []
    for visible in (False, True):
        model, lead = assemble(room, seen=visible)
        data = mujoco.MjData(model)
        place(model, data, np.array(room.start), ARM)
        assert lead.shape == (len(MOVING),) and (lead > 0).all()
        states = []
        for step in range(60):
            data.ctrl[[model.actuator(j).id for j in ("base_x", "base_yaw", "arm_1")]] += 0.004 * np.cos(0.1 * step)
            mujoco.mj_step(model, data, 2)
            states.append(np.concatenate([data.qpos, data.qvel, data.sensordata, data.qfrc_constraint]))
        ends.append((model, np.array(states)))
    (bare, felt), (full, also_felt) = ends
    np.testing.assert_array_equal(felt, also_felt)
    assert np.abs(felt[-1] - felt[0]).max() > 0.05  # something happened
    assert bare.ngeom < full.ngeom / 4 and bare.nq == full.nq
    free = full.geom_contype + full.geom_conaffinity == 0
    assert (full.geom_group[free & (full.geom_bodyid == 0)] == 2).all()


@pytest.mark.parametrize("name", ROOMS)
def test_the_range_finder_sees_the_same_from_many_places(name):
    """What is drawn lies inside what is solid, at the height of the beams: both models give the same ranges."""
    room, rng = ROOMS[name], np.random.default_rng(4)
    models = [assemble(room, seen=visible)[0] for visible in (False, True)]
    free = room.polygon.buffer(-0.3) - shapely.union_all(
        [shapely.Polygon(o) for o in room.obstacles(0, BASE_TOP)]
    ).buffer(0.3)
    spots = rng.uniform(room.floor.min(0), room.floor.max(0), (60, 2))
    spots = spots[shapely.contains_xy(free, spots)]
    assert len(spots) > 5
    for spot in spots:
        base, ranges = [*spot, rng.uniform(-3, 3)], []
        for model in models:
            data = mujoco.MjData(model)
            place(model, data, base, ARM)
            ranges.append([data.sensor(f"range{i:02d}").data[0] for i in range(11)])
        np.testing.assert_allclose(ranges[0], ranges[1], atol=2e-3)
        assert (np.array(ranges) > 0).all()  # the room is closed


@pytest.mark.parametrize("kind", furniture_kinds.KINDS)
@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_obstacles_are_where_the_geoms_are(kind, yaw):
    """Rays from above through a grid: solid geoms stand under the outlines and nowhere else."""
    piece = Furniture(kind, "it", 1.5, 1.0, yaw)
    room = Room("room", FLOOR + [[-2, -2], [2, -2], [2, 2], [-2, 2]], (piece,), start=(-1.0, -1.0, 0.0))
    model = room.spec(seen=False).compile()
    data = at_rest(model)
    outlines = shapely.union_all([shapely.Polygon(o) for o in room.obstacles(0.0, 3.0)])
    if kind == "carpet":
        assert outlines.is_empty and not any(
            model.body(b).name == "it" for b in range(model.nbody) if model.body_geomnum[b]
        )
        return
    assert shapely.Polygon(piece.footprint).buffer(0.01).covers(outlines)
    for x in np.linspace(0.3, 2.7, 17):
        for y in np.linspace(-0.2, 2.2, 17):
            away = shapely.Point(x, y).distance(outlines.boundary)
            if away > 0.01:
                found = ray(data, (x, y, 3.0), (0, 0, -1), 3)[1] == "it"
                assert found == outlines.contains(shapely.Point(x, y))


def test_under_the_table_there_is_room_for_the_nozzle_but_not_at_its_legs():
    table = Furniture("table", "table", 1.5, 1.0)
    low, all_heights = table.solids(0.0, NOZZLE_HEIGHT), table.solids(0.0, 1.0)
    assert len(low) == 4 and sum(shapely.Polygon(o).area for o in low) < 0.02
    assert shapely.union_all([shapely.Polygon(o) for o in all_heights]).area == pytest.approx(
        table.length * table.width
    )


def test_furniture_and_walls_stop_the_robot_and_the_nozzle():
    carton = Furniture("carton", "carton", 2.0, 1.0, height=0.3)
    room = Room("room", FLOOR, (carton,), start=(0.6, 1.0, 0.0))
    model, _ = assemble(room, seen=False)
    data = mujoco.MjData(model)
    for y, thing in ((1.0, "room/carton"), (0.4, "world")):
        place(model, data, [0.6, y, 0.0], ARM)
        for _ in range(300):
            data.actuator("base_x").ctrl[:] += 0.006
            mujoco.mj_step(model, data, 5)
        touched = {frozenset(model.body(model.geom_bodyid[g]).name for g in c.geom) for c in data.contact}
        assert any(thing in pair and pair & {"vacuum/nozzle", "vacuum/vacuum", "base"} for pair in touched)
    assert not any("wheel" in model.body(model.geom_bodyid[g]).name for c in data.contact for g in c.geom)


@pytest.mark.parametrize("corners", [FLOOR, L_SHAPE, L_SHAPE[::-1], np.insert(FLOOR, 1, [1.5, 0.0], axis=0)])
def test_walls_stand_around_the_floor_and_not_on_it(corners):
    room = Room("room", corners, start=(0.5, 0.5, 0.0))
    data, rng = at_rest(room.spec().compile()), np.random.default_rng(5)
    inside = rng.uniform(0, 3, (100, 2))
    inside = inside[shapely.contains_xy(room.polygon.buffer(-0.01), inside)]
    for x, y in inside:
        assert ray(data, (x, y, 3.0), (0, 0, -1), 3)[0] == pytest.approx(3.0)  # the floor, no wall above it
        for angle in (0.1, 1.7, 3.3, 4.9):
            far, _ = ray(data, (x, y, 1.0), (np.cos(angle), np.sin(angle), 0), 3)
            end = shapely.LineString([(x, y), (x + 9 * np.cos(angle), y + 9 * np.sin(angle))])
            assert far == pytest.approx(shapely.Point(x, y).distance(end.intersection(room.polygon.exterior)), abs=1e-6)
    assert ray(data, (0.5, 0.5, WALL_SOLID + 0.1), (1, 0, 0), 3)[0] < 0


CHEST = Furniture("carton", "chest", 2.0, 1.0)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: Room("r", FLOOR[:2]), InvalidValue, "floor = '2 corners'"),
        (lambda: Room("r", FLOOR[[0, 2, 1, 3]]), InvalidValue, "cross"),
        (lambda: Room("r", [[0, 0], [1, np.inf], [2, 2]]), InvalidValue, "floor"),
        (lambda: Room("", FLOOR), InvalidType, "name"),
        (lambda: Room("r", FLOOR, (Furniture("sofa", "sofa", 0.2, 1.0),)), InvalidValue, "'sofa'.*inside the room"),
        (lambda: Room("r", FLOOR, (CHEST, CHEST), (0.5, 0.5, 0)), InvalidValue, "a name of its own"),
        (lambda: Room("r", FLOOR, ("sofa",)), InvalidType, "furniture"),
        (lambda: Room("r", FLOOR, start=(-1, 0, 0)), InvalidValue, "start.*inside"),
        (lambda: Room("r", FLOOR, start=(0.1, 1, 0)), InvalidValue, "start.*free"),
        (lambda: Room("r", FLOOR, (CHEST,), start=(2.0, 1.0, 0)), InvalidValue, "start.*free"),
        (lambda: Room("r", FLOOR, start=(0, 0)), InvalidValue, "start"),
        (lambda: Room("r", FLOOR, start=(1, 1, 0), wall_height=-1), InvalidValue, "wall_height"),
        (lambda: Furniture("throne", "x", 0, 0), InvalidValue, "kind = 'throne'.*'sofa'"),
        (lambda: Furniture("sofa", 3, 0, 0), InvalidType, "name"),
        (lambda: Furniture("sofa", "world", 0, 0), InvalidValue, "name = 'world'"),
        (lambda: Furniture("sofa", "x", np.nan, 0), InvalidValue, "x = nan"),
        (lambda: Furniture("sofa", "x", 0, 0, length=-1.0), InvalidValue, "length = -1.0"),
        (lambda: assemble("living room"), InvalidType, "room = 'living room'"),
        (lambda: assemble(ROOMS["living room"], timestep=0.0), InvalidValue, "timestep"),
    ],
)
def test_bad_input(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_a_bad_place_is_refused():
    model, _ = assemble(ROOMS["spare room"], seen=False)
    for base, arm, words in (([0, 0], ARM, "base"), ([0, 0, np.nan], ARM, "base"), ([1, 1, 0], ARM[:6], "arm")):
        with pytest.raises(InvalidValue, match=words):
            place(model, mujoco.MjData(model), base, arm)
