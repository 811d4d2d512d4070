"""The modular home robot of paper 4: its measures, its arm alone, and fixtures on which the arm can hang.

Both ends of the arm take a round bar: on the mast, on a fixture, on the door's knob. A bar's frame has x along the bar
and z away from what carries it, so the frame of the arm's end that holds it (z out of the end) is that frame turned by
half a turn about x; the arm's `anchor` frame, seen from the other end, is the bar's frame itself.
"""

import mujoco
import numpy as np
import pinocchio as pin

from tutorialbot import paths, robots
from tutorialbot.errors import BrokenFile, InvalidValue, finite_array, finite_number
from tutorialbot.pose import check_pose
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.omni import OmniWheel

NAME = "home_robot"
ARM = tuple(f"arm_{i}" for i in range(1, 8))
MOVING = (*robots.BASE, *ARM)
JAWS = ("jaw_left", "jaw_right")
WHEEL_JOINTS = ("wheel_1", "wheel_2", "wheel_3")
BASE_RADIUS, BASE_HEIGHT = 0.25, 0.32  # the drum; its rim of rubber may lean on the door [m]
MAST_RADIUS, ANCHOR_HEIGHT = 0.07, 0.70  # from the drum up to the bar that the arm stands on [m]
LINK, END = 0.35, 0.15  # from ball to elbow; from ball to the arm's end [m]
ARM_RADIUS = 0.04  # of the capsules between anchor, balls, elbow and tip [m]
PAD_RADIUS, PAD_BEHIND = 0.03, 0.01  # of the hand's pad: a ball whose centre lies behind the tip, on its z axis [m]
JAW_OPEN = 0.02  # how far each jaw opens; it reaches 0.02 beyond the tip [m]
FIXTURE_STAND_OFF = 0.06  # from a wall to the bar of a fixture on it [m]
AZIMUTHS = (np.pi / 3, np.pi, 5 * np.pi / 3)  # of the wheels, as in robot.xml
WHEELS = tuple(OmniWheel(0.2 * np.cos(a), 0.2 * np.sin(a), a + np.pi / 2, 0.06) for a in AZIMUTHS)


def robot_spec() -> mujoco.MjSpec:
    """Return an editable model of the robot; raises BrokenFile when its MJCF is missing or damaged."""
    path = paths.MODELS / NAME / "robot.xml"
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise BrokenFile(f"{path}: not a valid MJCF file: {error}") from None


def base_spec() -> mujoco.MjSpec:
    """Return the robot without its arm: what stays behind when the arm has left."""
    spec = robot_spec()
    for actuator in (*ARM, *JAWS):
        spec.delete(spec.actuator(actuator))
    spec.delete(spec.body("link_0"))
    return spec


def arm_spec(*, loose: bool = False) -> mujoco.MjSpec:
    """Return the arm alone, with the end that holds on the body "anchor" at the origin.

    The anchor is a mocap body: set its pose to hang the arm anywhere. `loose` gives it a free joint instead, so that
    its pose is part of qpos: for pictures of an arm that changes its anchor.
    """
    spec = robot_spec()
    anchor, mast = spec.body("base"), spec.body("mast")
    for actuator in (*robots.BASE, *WHEEL_JOINTS):
        spec.delete(spec.actuator(actuator))
    for part in (*anchor.joints, *anchor.geoms, *mast.geoms, *(spec.body(wheel) for wheel in WHEEL_JOINTS)):
        spec.delete(part)
    anchor.name, anchor.mocap = "anchor", not loose
    if loose:
        anchor.add_freejoint(name="anchor")
    spec.body("link_0").pos = [0.0, 0.0, 0.0]
    return spec


def apart(spec: mujoco.MjSpec | None = None) -> mujoco.MjModel:
    """Return base and arm as two things in the world of `spec` (an empty one by default), compiled: for pictures.

    Names are those of the robot, prefixed "base/" and "arm/"; `apart_qpos` tells where they are.
    """
    spec = spec or mujoco.MjSpec()
    for prefix, part in (("base/", base_spec()), ("arm/", arm_spec(loose=True))):
        spec.option.integrator = part.option.integrator
        spec.attach(part, prefix=prefix, frame=spec.worldbody.add_frame())
    return spec.compile()


def apart_qpos(
    model: mujoco.MjModel, base: np.ndarray, anchor: pin.SE3, q: np.ndarray, jaws: float = 0.0
) -> np.ndarray:
    """Return qpos (nq,) of a model of `apart`.

    base (3,) x, y [m], yaw [rad]; anchor: pose of the bar that the arm holds on to, in the world; q (7,) [rad]; jaws
    [m]: how far each jaw of the free end is open, 0 to JAW_OPEN.
    """
    base, q, pose = finite_array("base", base, (3,)), finite_array("q", q, (7,)), check_pose("anchor", anchor)
    qpos = model.qpos0.copy()
    qpos[[model.joint(f"base/{name}").qposadr[0] for name in robots.BASE]] = base
    qpos[[model.joint(f"arm/{name}").qposadr[0] for name in ARM]] = q
    finite_number("jaws", jaws, 0.0, JAW_OPEN)
    qpos[[model.joint(f"arm/{name}").qposadr[0] for name in JAWS]] = jaws
    first = model.joint("arm/anchor").qposadr[0]
    qpos[first : first + 7] = [*pose.translation, *pin.Quaternion(pose.rotation).coeffs()[[3, 0, 1, 2]]]
    return qpos


def fixture_frame(door: ClosingDoor, x: float, z: float) -> pin.SE3:
    """Return the frame of the bar of a fixture on the wall's robot side, at `x` along the wall and `z` up [m].

    Its x axis points up, along the bar, and its z axis out of the wall, toward -y.
    """
    turned = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    return pin.SE3(turned, np.array([x, door.wall[0] - FIXTURE_STAND_OFF, z]))


def add_fixture(spec: mujoco.MjSpec, frame: pin.SE3, name: str = "fixture") -> None:
    """Add to the world of `spec` a fixture whose bar has the frame `frame`, and a site `name` there."""
    pose = check_pose("frame", frame)
    quaternion = pin.Quaternion(pose.rotation).coeffs()[[3, 0, 1, 2]]
    body = spec.worldbody.add_body(name=name, pos=pose.translation, quat=quaternion)
    seen = {"group": 2, "contype": 0, "conaffinity": 0, "mass": 0.0}
    box, cylinder = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
    dark, metal = [0.19, 0.20, 0.23, 1.0], [0.62, 0.65, 0.69, 1.0]
    body.add_geom(type=box, size=[0.055, 0.055, 0.006], pos=[0, 0, 0.006 - FIXTURE_STAND_OFF], rgba=dark, **seen)
    accent = [0.93, 0.46, 0.10, 1.0]
    body.add_geom(type=cylinder, size=[0.036, 0.003, 0], pos=[0, 0, 0.014 - FIXTURE_STAND_OFF], rgba=accent, **seen)
    for way in (-1.0, 1.0):
        size = [0.005, 0.017, FIXTURE_STAND_OFF / 2 + 0.005]
        body.add_geom(type=box, size=size, pos=[way * 0.033, 0, 0.012 - FIXTURE_STAND_OFF / 2], rgba=metal, **seen)
    turned = [np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0]
    body.add_geom(type=cylinder, size=[0.014, 0.03, 0], quat=turned, rgba=metal, **seen)
    body.add_site(name=name)


def add_wall(spec: mujoco.MjSpec, fixture: pin.SE3, size: tuple[float, float] = (1.4, 1.7)) -> None:
    """Add a wall to the world of `spec`, with a fixture's frame `fixture` before it: wide and high as `size` [m]."""
    pose, (wide, high), thick = check_pose("fixture", fixture), size, 0.06
    out = np.array([pose.rotation[0, 2], pose.rotation[1, 2], 0.0])
    if np.linalg.norm(out) < 1.0 - 1e-6:
        raise InvalidValue("fixture", fixture, "a frame whose z axis is level: it points out of an upright wall")
    middle = pose.translation - (FIXTURE_STAND_OFF + thick / 2) * out
    yaw = np.arctan2(out[1], out[0])
    spec.worldbody.add_geom(
        name="wall", type=mujoco.mjtGeom.mjGEOM_BOX, size=[thick / 2, wide / 2, high / 2],
        pos=[middle[0], middle[1], high / 2], quat=[np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)],
        rgba=[0.87, 0.88, 0.88, 1.0], group=2, contype=0, conaffinity=0,
    )  # fmt: skip
