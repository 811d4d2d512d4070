"""Robots in a scene: every geom where and how MuJoCo and pinocchio have it, and motions that stay true."""

import mujoco
import numpy as np
import pinocchio
import pytest
import umsgpack
from pinocchio.visualize import MeshcatVisualizer

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.viewers import MujocoView, PinocchioView, Scene, play
from tutorialbot.viewers.solids import solids

WEDGE = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.1], [0.3, 0, 0.1]], float)
MODEL = f"""<mujoco><asset>
  <material name="green" rgba="0 1 0 1" shininess="0.9"/>
  <mesh name="wedge" vertex="{" ".join(map(str, WEDGE.ravel()))}"/></asset>
<worldbody><geom name="floor" type="plane" size="0 0 1"/>
 <geom name="table" type="plane" size="0.5 0.25 1" pos="0 0 0.5"/>
 <body pos="0 0 1"><joint type="hinge" axis="0 1 0"/>
  <geom name="box" type="box" size="0.1 0.2 0.3" pos="0.1 0 0" euler="10 20 30" rgba="1 0 0 1"/>
  <geom name="sphere" type="sphere" size="0.15" pos="0 0.4 0" material="green"/>
  <body pos="0.4 0 0"><joint type="slide" axis="1 0 0"/>
   <geom name="capsule" type="capsule" size="0.05 0.2" euler="40 0 0"/>
   <geom name="cylinder" type="cylinder" size="0.07 0.1" pos="0 0 0.3" euler="0 50 0"/>
   <geom name="ellipsoid" type="ellipsoid" size="0.1 0.05 0.2" pos="0 0 -0.4" euler="0 0 60"/>
   <geom name="mesh" type="mesh" mesh="wedge" pos="0.1 0.2 0.3" euler="0 30 0" rgba="0 0 1 0.5"/>
   <geom name="hidden" type="sphere" size="0.4" group="3"/></body></body>
 <body name="target" mocap="true"><geom name="ball" type="sphere" size="0.02"/></body>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_string(MODEL)


@pytest.fixture
def moved(model):
    data = mujoco.MjData(model)
    data.qpos[:] = 0.7, -0.2
    data.mocap_pos[0] = 0.5, 0.6, 0.7
    mujoco.mj_forward(model, data)
    return data


def by_geom(scene: Scene, model: mujoco.MjModel, prefix: str = "robot") -> dict:
    """Return what the scene shows as {geom name: Solid}."""
    shown = (s for s in solids(scene.window.entries) if s.path.startswith(f"/meshcat/{prefix}/"))
    return {s.path.rsplit("/", 1)[1].rsplit("_", 1)[0]: s for s in shown}


def in_geom(solid, model, data, name: str) -> np.ndarray:
    """Return the vertices of a solid in the frame in which MuJoCo has the geom `name`."""
    geom = data.geom(name)
    return (solid.vertices - geom.xpos) @ geom.xmat.reshape(3, 3)


def test_every_geom_lies_where_mujoco_has_it(model, moved):
    view = MujocoView(model)
    view.update(moved)
    shown = by_geom(view.scene, model)
    assert set(shown) == {"table", "box", "sphere", "capsule", "cylinder", "ellipsoid", "mesh", "ball"}

    def local(name):
        return in_geom(shown[name], model, moved, name)

    near = {"atol": 1e-6, "rtol": 0}
    np.testing.assert_allclose(np.abs(local("box")), np.broadcast_to([0.1, 0.2, 0.3], (8, 3)), **near)
    np.testing.assert_allclose(np.linalg.norm(local("sphere"), axis=1), 0.15, **near)
    np.testing.assert_allclose(np.linalg.norm(local("ellipsoid") / [0.1, 0.05, 0.2], axis=1), 1.0, **near)
    np.testing.assert_allclose(np.linalg.norm(local("ball"), axis=1), 0.02, **near)
    points = local("capsule")
    axis = np.stack([0 * points[:, 0], 0 * points[:, 1], points[:, 2].clip(-0.2, 0.2)], -1)
    np.testing.assert_allclose(np.linalg.norm(points - axis, axis=1), 0.05, **near)
    points = local("cylinder")
    np.testing.assert_allclose(np.abs(points).max(0), [0.07, 0.07, 0.1], **near)
    np.testing.assert_allclose(np.linalg.norm(points[:, :2], axis=1).max(), 0.07, **near)
    np.testing.assert_allclose(np.ptp(local("table"), axis=0)[:2], [1.0, 0.5], **near)


def test_mesh_keeps_the_places_that_its_author_gave(model, moved):
    """MuJoCo moves a mesh to its centre of mass: the reference here is the author's pose and vertices instead."""
    view = MujocoView(model)
    view.update(moved)
    body = moved.body(2)
    turn = np.empty(4)
    mujoco.mju_euler2Quat(turn, np.deg2rad([0.0, 30.0, 0.0]), "xyz")
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, turn)
    expected = (WEDGE @ rotation.reshape(3, 3).T + [0.1, 0.2, 0.3]) @ body.xmat.reshape(3, 3).T + body.xpos
    vertices = by_geom(view.scene, model)["mesh"].vertices
    distance = np.linalg.norm(vertices[:, None] - expected, axis=-1)
    assert distance.min(1).max() < 1e-6 and distance.min(0).max() < 1e-6


def test_normals_point_outward(model):
    for solid in by_geom(MujocoView(model).scene, model).values():
        if solid.normals is not None:
            corners, middle = solid.vertices[solid.faces], solid.vertices.mean(0)
            turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            size = np.linalg.norm(turned, axis=1)
            solid_faces = size > 1e-9
            agree = (turned * solid.normals[solid.faces].sum(1)).sum(1)[solid_faces]
            outward = (turned * (corners.mean(1) - middle)).sum(1)[solid_faces]
            assert (agree > 0).all() and (outward > -1e-9).all(), solid.path


def test_colours_groups_and_ghosts(model):
    solid = by_geom(MujocoView(model).scene, model)
    np.testing.assert_allclose(solid["box"].rgba, (1, 0, 0, 1))
    np.testing.assert_allclose(solid["sphere"].rgba, (0, 1, 0, 1))
    np.testing.assert_allclose(solid["mesh"].rgba, (0, 0, 1, 0.5))
    assert set(by_geom(MujocoView(model, groups=(3,)).scene, model)) == {"hidden"}
    np.testing.assert_allclose(by_geom(MujocoView(model, opacity=0.5).scene, model)["mesh"].rgba[3], 0.25)


def test_two_robots_in_one_scene(model, moved):
    scene = Scene()
    MujocoView(model, scene).update(moved)
    second = MujocoView(model, scene, prefix="second", offset=pinocchio.SE3(np.eye(3), np.array([0, 2.0, 0])))
    second.update(moved)
    first, other = by_geom(scene, model), by_geom(scene, model, "second")
    for name in first:
        np.testing.assert_allclose(other[name].vertices, first[name].vertices + [0, 2, 0], atol=1e-9)
    count = len(scene.window.entries)
    MujocoView(model, scene, prefix="second")  # the same name again takes its place
    assert len(scene.window.entries) == count


def test_update_reads_positions_alone_and_leaves_the_data_as_it_was(model, moved):
    view, before = MujocoView(model), moved.xpos.copy()
    moved.qpos[:] = 0.1, 0.0  # xpos is stale now
    view.update(moved)
    assert np.array_equal(moved.xpos, before)
    shown = by_geom(view.scene, model)["box"].vertices
    view.update(np.array([0.1, 0.0]))
    np.testing.assert_array_equal(by_geom(view.scene, model)["box"].vertices, shown)


def test_bodies_at_rest_send_nothing(model):
    view = MujocoView(model)
    view.scene.window.take()
    view.update(np.array([0.0, 0.3]))  # the second joint alone moves the last body alone
    assert [key[1] for key in view.scene.window.take()] == ["/meshcat/robot/body_2"]


@pytest.fixture(scope="module")
def arm():
    robot = pinocchio.buildSampleModelManipulator()
    return robot, pinocchio.buildSampleGeometryModelManipulator(robot)


def test_pinocchio_geometries_lie_where_pinocchio_has_them(arm):
    robot, visual = arm
    view, data, places = PinocchioView(robot, visual), robot.createData(), visual.createData()
    q = pinocchio.randomConfiguration(robot)
    view.update(q)
    pinocchio.updateGeometryPlacements(robot, data, visual, places, q)
    shown = {s.path.rsplit("/", 1)[1]: s for s in solids(view.scene.window.entries)}
    assert len(shown) == len(visual.geometryObjects)
    for geometry, place in zip(visual.geometryObjects, places.oMg, strict=True):
        points = (shown[geometry.name].vertices - place.translation) @ place.rotation
        half = getattr(geometry.geometry, "halfLength", 0.0)
        axis = np.zeros_like(points)
        axis[:, 2] = points[:, 2].clip(-half, half)
        np.testing.assert_allclose(np.linalg.norm(points - axis, axis=1), geometry.geometry.radius, atol=1e-6)


def test_scene_is_a_viewer_for_pinocchios_own_visualizer(arm, recwarn):
    robot, visual = arm
    scene, q = Scene(height=60), pinocchio.randomConfiguration(robot)
    visualizer = MeshcatVisualizer(robot, None, visual)
    visualizer.initViewer(viewer=scene, loadModel=True)
    visualizer.display(q)
    own = PinocchioView(robot, visual)
    own.update(q)

    def boxes(of):
        return {s.path.rsplit("/", 1)[1]: np.concatenate([s.vertices.min(0), s.vertices.max(0)]) for s in of}

    theirs, ours = boxes(solids(scene.window.entries)), boxes(solids(own.scene.window.entries))
    assert set(theirs) == set(ours)
    for name in ours:
        np.testing.assert_allclose(theirs[name], ours[name], atol=5e-3)
    assert visualizer.captureImage(64, 48).shape[:2] == (48, 64)
    assert not [w for w in recwarn if issubclass(w.category, UserWarning)]


def animated(scene: Scene) -> tuple[dict, dict]:
    """Return the animation's options and {path: (times, positions, quaternions xyzw)}."""
    command = umsgpack.unpackb(scene.window.entries["set_animation", "/", ""])
    found = {}
    for animation in command["animations"]:
        tracks = {t["name"]: t for t in animation["clip"]["tracks"]}
        numbers = {n: np.frombuffer(t["values"].data, np.float32) for n, t in tracks.items()}
        times = np.frombuffer(tracks[".position"]["times"].data, np.float32)
        places, turns = numbers[".position"].reshape(-1, 3), numbers[".quaternion"].reshape(-1, 4)
        found[animation["path"]] = times, places, turns
    return command["options"], found


def test_animation_is_the_motion_everywhere_between_its_keys(model):
    view, times = MujocoView(model), np.linspace(5.0, 9.0, 800)
    motion = np.stack([3.0 * np.sin(times), 0.3 * np.cos(2 * times)], -1)
    play(view, motion, times, speed=2.0)
    options, tracks = animated(view.scene)
    assert options["speed"] == 2.0 and options["play"] and options["repetitions"] == np.inf
    data = mujoco.MjData(model)
    for k in range(0, 800, 7):
        data.qpos[:] = motion[k]
        mujoco.mj_kinematics(model, data)
        for body in (1, 2):
            at, places, turns = tracks[f"/meshcat/robot/body_{body}"]
            now = times[k] - 5.0
            place = [np.interp(now, at, places[:, i]) for i in range(3)]
            i = int(np.clip(np.searchsorted(at, now) - 1, 0, len(at) - 2))
            ends = [pinocchio.Quaternion(turn.astype(float)) for turn in turns[i : i + 2]]
            turn = ends[0].slerp(float((now - at[i]) / (at[i + 1] - at[i])), ends[1]).matrix()
            np.testing.assert_allclose(place, data.xpos[body], atol=2e-3)
            np.testing.assert_allclose(turn, data.xmat[body].reshape(3, 3), atol=8e-3)
    at, _, turns = tracks["/meshcat/robot/body_1"]
    assert len(at) < 200 and at[0] == 0.0 and at[-1] == pytest.approx(4.0)
    assert ((turns[1:] * turns[:-1]).sum(1) > 0).all()  # no jump between the two signs of a quaternion


def test_two_robots_play_together_and_a_still_one_costs_nothing(model):
    scene = Scene()
    first, second = MujocoView(model, scene), MujocoView(model, scene, prefix="ghost")
    play(first, np.zeros((300, 2)), np.linspace(0, 3, 300))
    play(second, np.stack([np.linspace(0, 1, 300)] * 2, -1), np.linspace(0, 3, 300))
    _, tracks = animated(scene)
    assert {path.split("/")[2] for path in tracks} == {"robot", "ghost"}
    assert all(len(t[0]) == 2 for path, t in tracks.items() if "/robot/" in path)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda m: MujocoView("robot.xml"), InvalidType, "model = 'robot.xml'"),
        (lambda m: MujocoView(m, scene="s"), InvalidType, "scene = 's'"),
        (lambda m: MujocoView(m, prefix="/"), InvalidValue, "prefix = '/'"),
        (lambda m: MujocoView(m, opacity=2.0), InvalidValue, "opacity = 2.0"),
        (lambda m: MujocoView(m, offset=np.zeros((4, 4))), InvalidValue, "offset"),
        (lambda m: MujocoView(m, groups=2), InvalidType, "groups = 2"),
        (lambda m: MujocoView(m).update(np.zeros(3)), InvalidValue, "qpos"),
        (lambda m: MujocoView(m).update([0.0, np.nan]), InvalidValue, "qpos"),
        (lambda m: PinocchioView(m, m), InvalidType, "a pinocchio.Model"),
        (lambda m: PinocchioView(pinocchio.Model(), m), InvalidType, "visual_model"),
        (lambda m: play(m, [[0, 0]], [0]), InvalidType, "view"),
        (lambda m: play(MujocoView(m), np.zeros((3, 2)), [0, 1]), InvalidValue, "2 times for 3 configurations"),
        (lambda m: play(MujocoView(m), np.zeros((2, 2)), [1, 1]), InvalidValue, "rising"),
        (lambda m: play(MujocoView(m), np.zeros((2, 2)), [0, 1], speed=0), InvalidValue, "speed = 0"),
    ],
)
def test_bad_input(model, call, error, words):
    with pytest.raises(error, match=words):
        call(model)


def test_a_straight_motion_needs_two_keys_alone(model):
    view = MujocoView(model)
    play(view, np.stack([np.zeros(300), np.linspace(-0.5, 0.5, 300)], -1), np.linspace(0, 3, 300))
    _, tracks = animated(view.scene)
    assert {path: len(times) for path, (times, _, _) in tracks.items()} == dict.fromkeys(tracks, 2)
