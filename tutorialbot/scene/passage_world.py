"""The passage of paper 4 in MuJoCo: the home robot at a door with a closer plays a motion back, and the door answers.

The robot's joints follow set points by servos of limited strength; nothing but the hand on the knob (a weld that is
switched), contacts and the closer moves the door. What is compared with the kinematic motion is the door's angle.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, float_array
from tutorialbot.pose import check_pose
from tutorialbot.scene import home_robot, omni
from tutorialbot.scene.closing_door import ClosingDoor, check_closing_door

TIMESTEP, LOOK = 0.002, 0.01  # of the physics; between two set points, and between two looks at the door [s]
LONGEST = 1000.0  # a motion that is played back [s]
GRASP_REACH = 0.03  # a hand further than this from the knob takes nothing [m]
JAW_TIME = 1.0  # how long before a grasp and after a release the jaws stand open [s]
HOLDING = ("base_rim", "hand_pad")  # the parts that may touch the panel
BASE_PARTS, ARM_PARTS = ("base_rim", "base_body", "mast"), ("link_0", "link_3", "link_4", "link_7", "hand_pad")
SEEN_GROUP = 2  # of the geoms for the eye, in the MJCF files


@dataclass(frozen=True)
class Touch:
    """One part of the robot on one part of the door: from when to when [s], and the largest normal force [N]."""

    robot: str
    door: str
    first: float
    last: float
    force: float

    @property
    def holding(self) -> bool:
        """Whether it is a holding pad on the panel: all other touches are bumps."""
        return self.robot in HOLDING and self.door == "panel"


@dataclass(frozen=True)
class Replay:
    """What MuJoCo makes of a motion, at its times (n,) [s].

    door_angle (n,) [rad]; base (n, 3) [m, m, rad] and q (n, 7) [rad] measured; joint_rates (n, 7) [rad/s]; torques
    (n, 7) [Nm] of the arm's servos, gravity included; base_lag (n,) [m] between the base and its set point; held (n,)
    whether the weld held the knob; grasp_gap [m] the largest distance of hand and knob at a grasp; qpos (n, nq) for
    `world(...)`; outcome "finished", "missed" (a grasp out of reach) or "failed" (the simulation broke down).
    """

    times: np.ndarray
    door_angle: np.ndarray
    base: np.ndarray
    q: np.ndarray
    joint_rates: np.ndarray
    torques: np.ndarray
    base_lag: np.ndarray
    held: np.ndarray
    grasp_gap: float
    touches: tuple[Touch, ...]
    qpos: np.ndarray
    outcome: str

    @property
    def bumps(self) -> tuple[Touch, ...]:
        """The touches that are not a holding pad on the panel."""
        return tuple(touch for touch in self.touches if not touch.holding)


def world(
    door: ClosingDoor, *, seen: bool = True, fixtures: Sequence[pin.SE3] = (), wall_opacity: float = 1.0
) -> mujoco.MjModel:
    """Return the compiled robot and door (its names prefixed "door/"), with fixtures on the wall at the frames given.

    The hand (body "link_7") holds the knob by the equality "grasp", which is off. `seen=False` leaves out what is there
    for the eye alone: a step costs less, and qpos is laid out alike. Raises InvalidType for what is no door.
    """
    check_closing_door(door), _truth("seen", seen)
    if not isinstance(fixtures, Sequence):
        raise InvalidType("fixtures", fixtures, "a row of pinocchio.SE3")
    frames = [check_pose("fixtures", frame) for frame in fixtures]
    spec, shut = home_robot.robot_spec(), door.spec()
    spec.option.timestep = TIMESTEP
    shut.material("wall").rgba[3] = finite_number("wall_opacity", wall_opacity, 0.0, 1.0)
    spec.attach(shut, prefix="door/", frame=spec.worldbody.add_frame())
    spec.add_exclude(name="hand_knob", bodyname1="link_7", bodyname2="door/knob")
    spec.add_equality(name="grasp", type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1="link_7",
                      name2="door/knob", active=False, solref=[0.01, 1.0])  # fmt: skip
    for i, frame in enumerate(frames):
        home_robot.add_fixture(spec, frame, f"fixture_{i}")
    if not seen:
        for geom in spec.geoms:
            if geom.group == SEEN_GROUP:
                spec.delete(geom)
    return spec.compile()


def configuration(model: mujoco.MjModel, door: ClosingDoor, base, q, angle) -> np.ndarray:
    """Return qpos (..., nq) of `world(door)` for pictures, from base (..., 3), q (..., 7), door's angle (...) [rad].

    Raises InvalidType or InvalidValue for shapes that do not fit, what is no finite number, and another model.
    """
    check_closing_door(door)
    if not isinstance(model, mujoco.MjModel):
        raise InvalidType("model", model, "the model that world(door) returns")
    rows = float_array("angle", angle).shape
    angle, base, q = (finite_array(name, part, (*rows, *size)) for name, part, size in
                      (("angle", angle, ()), ("base", base, (3,)), ("q", q, (7,))))  # fmt: skip
    if "door/hinge" not in (model.joint(i).name for i in range(model.njnt)):
        raise InvalidValue("model", model, "the model that world(door) returns")
    qpos = np.tile(model.qpos0, (*angle.shape, 1))
    qpos[..., [model.joint(name).qposadr[0] for name in home_robot.MOVING]] = np.concatenate([base, q], axis=-1)
    qpos[..., model.joint("door/hinge").qposadr[0]] = angle
    qpos[..., model.joint("door/closer_arm").qposadr[0]] = door.closer_arm(angle)
    return qpos


def replay(
    door: ClosingDoor,
    times: np.ndarray,
    base: np.ndarray,
    q: np.ndarray,
    grasped: np.ndarray,
    *,
    hold_by_base: bool = True,
    hold_by_hand: bool = True,
    start_angle: float = 0.0,
) -> Replay:
    """Play a motion back in MuJoCo and return what the door does.

    times (n,) [s], increasing; base (n, 3) x, y [m] and yaw [rad]; q (n, 7) [rad]; grasped (n,) truth values: whether
    the hand shall hold the knob from that sample on. The door begins at rest at `start_angle` [rad]. Between samples
    the set points are interpolated; the jaws open by themselves around a grasp. `hold_by_base=False` takes all
    contact of the base with the door away, `hold_by_hand=False` that of the arm: what would happen without them.

    A grasp takes hold where the hand is, if it is within GRASP_REACH of the knob. Contact of the jaws and the hand with
    the knob's bar is not simulated. Raises InvalidType or InvalidValue for bad arguments, and for more than LONGEST.
    """
    times, base, q, grasped = _checked(times, base, q, grasped)
    _truth("hold_by_base", hold_by_base), _truth("hold_by_hand", hold_by_hand)
    model = world(door, seen=False)
    finite_number("start_angle", start_angle, 0.0, door.open_limit)
    run = _Run(model, door, hold_by_base, hold_by_hand)
    clock, commands, hold = _commands(run.model, times, base, q, grasped)
    run.place(base[0], q[0], start_angle, commands[0], bool(hold[0]))
    record = [run.look(0.0)]
    for instant, command, take in zip(clock[1:], commands[1:], hold[1:], strict=True):
        run.step(command, bool(take), float(instant))
        record.append(run.look(float(instant)))
    return _result(run, door, times, base, clock, np.array(record))


def _truth(name: str, value: bool) -> None:
    if not isinstance(value, bool):
        raise InvalidType(name, value, "True or False")


def _checked(times, base, q, grasped) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    times = finite_array("times", times, (-1,))
    n = len(times)
    if n < 2 or not (np.diff(times) > 0.0).all():
        raise InvalidValue("times", times, "two or more, increasing")
    if not times[-1] - times[0] <= LONGEST:
        raise InvalidValue("times", times, f"at most {LONGEST:g} s from the first to the last")
    base, q, grasped = finite_array("base", base, (n, 3)), finite_array("q", q, (n, 7)), np.asarray(grasped)
    if grasped.dtype != bool:
        raise InvalidType("grasped", grasped, f"truth values of shape ({n},)")
    if grasped.shape != (n,):
        raise InvalidValue("grasped", f"array of shape {grasped.shape}", f"shape ({n},)")
    return times, base, q, grasped


def _commands(model, times, base, q, grasped) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the clock (m,) [s] from 0, the controls (m, nu) and whether to hold the knob (m,), one a look.

    A set point runs ahead by (damping / stiffness) * speed, so that the servo's damping does not drag.
    """
    clock = LOOK * np.arange(math.floor((times[-1] - times[0]) / LOOK + 1e-6) + 1)
    at = np.clip(np.searchsorted(times - times[0], clock + 1e-9, side="right") - 1, 0, None)
    goal = np.column_stack([np.interp(clock, times - times[0], column) for column in np.hstack([base, q]).T])
    speed = np.gradient(goal, LOOK, axis=0) if len(clock) > 1 else np.zeros_like(goal)
    commands = np.zeros((len(clock), model.nu))
    ids = [model.actuator(name).id for name in home_robot.MOVING]
    lead = -model.actuator_biasprm[ids, 2] / model.actuator_gainprm[ids, 0]
    commands[:, ids] = goal + lead * speed
    (x, y, turn), cosine, sine = speed[:, :3].T, np.cos(goal[:, 2]), np.sin(goal[:, 2])
    rates = omni.to_wheels(home_robot.WHEELS, np.column_stack([cosine * x + sine * y, cosine * y - sine * x, turn]))
    commands[:, [model.actuator(name).id for name in home_robot.WHEEL_JOINTS]] = rates
    hold = grasped[at]
    near, reach = hold.copy(), round(JAW_TIME / LOOK)
    for change in np.flatnonzero(hold[1:] != hold[:-1]) + 1:
        near[max(0, change - reach) : change + reach] = True
    open_jaws = home_robot.JAW_OPEN * (near & ~hold)
    commands[:, [model.actuator(name).id for name in home_robot.JAWS]] = open_jaws[:, None]
    return clock, commands, hold


class _Run:
    """One world with its hand, its closer and a note of every touch."""

    def __init__(self, model: mujoco.MjModel, door: ClosingDoor, hold_by_base: bool, hold_by_hand: bool):
        self.model, self.data, self.door = model, mujoco.MjData(model), door
        untouchable = (() if hold_by_base else BASE_PARTS) + (() if hold_by_hand else ARM_PARTS)
        for name in untouchable:
            model.geom(name).contype[:] = model.geom(name).conaffinity[:] = 0
        self.moving = np.array([model.joint(name).qposadr[0] for name in home_robot.MOVING])
        self.arm = np.array([model.joint(name).dofadr[0] for name in home_robot.ARM])
        self.hinge, self.closer = model.joint("door/hinge").qposadr[0], model.actuator("door/closer").id
        self.grasp, self.hand, self.knob = (
            model.equality("grasp").id,
            model.body("link_7").id,
            model.body("door/knob").id,
        )
        self.tip, self.grip = model.site("tip").id, model.site("door/grip").id
        self.substeps, self.gap, self.missed = round(LOOK / TIMESTEP), 0.0, False
        self.touched: dict[tuple[str, ...], list[float]] = {}

    def place(self, base: np.ndarray, q: np.ndarray, angle: float, command: np.ndarray, hold: bool) -> None:
        """Start at rest, with the robot and the door where they are told to be."""
        self.data.ctrl[:] = command
        self.data.qpos[self.moving] = np.concatenate([base, q])
        self.data.qpos[self.hinge] = angle
        if hold:
            self._switch(hold)
        mujoco.mj_forward(self.model, self.data)

    def step(self, command: np.ndarray, hold: bool, instant: float) -> None:
        """Go on to the next look with these controls."""
        data = self.data
        data.ctrl[:] = command
        data.ctrl[self.closer] = 1.0 if data.qpos[self.hinge] < self.door.hold_angle else 0.0
        if hold != bool(data.eq_active[self.grasp]) and not (hold and self.missed):
            self._switch(hold)
        mujoco.mj_step(self.model, data, self.substeps)
        if data.ncon:
            self._note(instant)

    def look(self, instant: float) -> np.ndarray:
        """Return the state as one row: qpos, rates and torques of the arm, whether the knob is held."""
        data = self.data
        torque = data.qfrc_actuator[self.arm]
        return np.concatenate([data.qpos, data.qvel[self.arm], torque, [data.eq_active[self.grasp]]])

    def _switch(self, hold: bool) -> None:
        """Close or open the weld; it keeps the hand and the knob as they stand to each other when it closes."""
        model, data = self.model, self.data
        if hold:
            mujoco.mj_kinematics(model, data)
            gap = float(np.linalg.norm(data.site_xpos[self.tip] - data.site_xpos[self.grip]))
            self.gap = max(self.gap, gap)
            if gap > GRASP_REACH:
                self.missed = True
                return
            inverse, turn = np.empty(4), np.empty(4)
            mujoco.mju_negQuat(inverse, data.xquat[self.hand])
            mujoco.mju_mulQuat(turn, inverse, data.xquat[self.knob])
            place = data.xmat[self.hand].reshape(3, 3).T @ (data.xpos[self.knob] - data.xpos[self.hand])
            model.eq_data[self.grasp, :10] = np.concatenate([np.zeros(3), place, turn])
        data.eq_active[self.grasp] = hold

    def _note(self, instant: float) -> None:
        wrench = np.empty(6)
        for i, pair in enumerate(self.data.contact.geom.tolist()):
            mujoco.mj_contactForce(self.model, self.data, i, wrench)
            names = sorted((self.model.geom(geom).name for geom in pair), key=lambda name: name.startswith("door/"))
            touch = self.touched.setdefault(tuple(names), [instant, instant, 0.0])
            touch[1], touch[2] = instant, max(touch[2], abs(float(wrench[0])))


def _result(run: _Run, door: ClosingDoor, times, base, clock, record) -> Replay:
    model = run.model
    now = times - times[0]

    def at(columns: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(now, clock, column) for column in columns.T])

    qpos, (rates, torques) = at(record[:, : model.nq]), np.split(at(record[:, model.nq : -1]), 2, axis=1)
    angle = qpos[:, run.hinge]
    qpos[:, model.joint("door/closer_arm").qposadr[0]] = door.closer_arm(angle)
    moved = qpos[:, run.moving]
    touches = tuple(
        Touch(robot, thing.removeprefix("door/"), float(first + times[0]), float(last + times[0]), force)
        for (robot, thing), (first, last, force) in sorted(run.touched.items())
    )
    lag, held = np.linalg.norm(moved[:, :2] - base[:, :2], axis=1), np.interp(now, clock, record[:, -1]) > 0.5
    broken = bool(run.data.warning.number.any()) or not np.isfinite(record).all()
    return Replay(
        times=times, door_angle=angle, base=moved[:, :3], q=moved[:, 3:], joint_rates=rates, torques=torques,
        base_lag=lag, held=held, grasp_gap=run.gap, touches=touches, qpos=qpos,
        outcome="failed" if broken else "missed" if run.missed else "finished",
    )  # fmt: skip
