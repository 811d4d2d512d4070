"""The world of a door trial: its settings, and the compiled model of the robot with its hand on the door's handle."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from tutorialbot import paths
from tutorialbot.errors import InvalidType, InvalidValue, finite_number, positive
from tutorialbot.scene import control
from tutorialbot.scene.door import Door

MOVING = ("base_x", "base_y", "base_yaw", *(f"arm_{i}" for i in range(1, 7)))
SPEED = np.array([0.5, 0.5, 0.8, 1.5, 1.5, 1.5, 2.5, 2.5, 2.5])  # of the trapezoids, [m/s] and [rad/s]
ACCELERATION = np.array([1.5, 1.5, 2.5, 6.0, 6.0, 6.0, 10.0, 10.0, 10.0])  # [m/s^2] and [rad/s^2]
CASTERS = (control.Caster(0.0, 0.20, 0.05, 0.075), control.Caster(0.0, -0.20, 0.05, 0.075))  # as in robot.xml
STEER_RATE, DRIVE_RATE = 8.0, 12.0  # of the casters [rad/s]
STIFFEST = 10.0  # beyond this `stiffness` every move collides at the first look at the sensor
TIMESTEPS = (1e-5, 0.02)  # shorter ones never end, longer ones tear the contacts apart [s]
SEEN_GROUP = 2  # of the geoms for the eye, in the MJCF files


@dataclass(frozen=True)
class Settings:
    """What a trial needs beside the door. SI units.

    `stiffness` scales the arm's PID gains: at 1 the hand gives way by 8, 1.7 and 1.3 kN/m along x, y and z, at 0.12 by
    1.3, 0.21 and 0.14 kN/m (a test measures it). `open_angle` is where the door counts as open. The noises are standard
    deviations an axis of the wrist sensor; `tare` subtracts the hand's weight.
    """

    stiffness: float = 0.12
    force_limit: float = 40.0
    torque_limit: float = 8.0
    open_angle: float = np.pi / 2
    timestep: float = 0.002
    control_period: float = 0.04  # of the outer loop: one joint target each
    sensor_period: float = 0.01  # of the set points and of the look at the wrist sensor
    force_noise: float = 0.0
    torque_noise: float = 0.0
    tare: bool = True

    def __post_init__(self):
        finite_number("stiffness", self.stiffness, 0.0, STIFFEST, above=True)
        for name in ("force_limit", "torque_limit"):
            positive(name, getattr(self, name))
        finite_number("timestep", self.timestep, *TIMESTEPS)
        finite_number("open_angle", self.open_angle, 0.0, np.pi, above=True)
        for period, unit in (("sensor_period", "timestep"), ("control_period", "sensor_period")):
            length, part = finite_number(period, getattr(self, period), getattr(self, unit), 1.0), getattr(self, unit)
            if abs(length / part - round(length / part)) > 1e-6:
                raise InvalidValue(period, length, f"a whole multiple of {unit} = {part:g}")
        for name in ("force_noise", "torque_noise"):
            finite_number(name, getattr(self, name), 0.0)
        if not isinstance(self.tare, bool):
            raise InvalidType("tare", self.tare, "True or False")


def assemble(door: Door, settings: Settings, *, seen: bool = True) -> tuple[mujoco.MjModel, np.ndarray]:
    """Return the compiled world and the lead (9,) [s] of the joints MOVING.

    The world is the robot, the door (its names prefixed "door/") and the weld "grasp" of the hand to the handle. The
    lead is the ratio of damping to stiffness of each joint's controller: a set point that runs ahead by lead * speed is
    not dragged by damping.

    `seen=False` leaves out the geoms that are there for the eye alone. No number of the state changes and qpos is laid
    out alike, but a step costs less: for searches, whose results a model with them can show.
    """
    spec = mujoco.MjSpec.from_file(str(paths.MODELS / "mobile_manipulator" / "robot.xml"))
    spec.option.timestep = settings.timestep
    lead = []
    for name in MOVING:
        actuator = spec.actuator(name)
        if name.startswith("arm"):
            k = settings.stiffness
            factors = {"kp": k, "ki": k, "kd": math.sqrt(k), "imax": k}
            gains = {key: float(value) * factors[key] for key, value in actuator.plugin.config.items()}
            actuator.plugin.config = {key: repr(value) for key, value in gains.items()}
            lead.append(gains["kd"] / gains["kp"])
        else:
            lead.append(-actuator.biasprm[2] / actuator.gainprm[0])
    spec.attach(door.spec(), prefix="door/", frame=spec.worldbody.add_frame())
    spec.add_equality(
        name="grasp",
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1="tool",
        name2=f"door/{door.names.grip}",
        solref=[0.01, 1.0],
    )
    if not seen:
        for geom in spec.geoms:
            if geom.group == SEEN_GROUP and geom.mass == 0.0 and not (geom.contype or geom.conaffinity):
                spec.delete(geom)
    return spec.compile(), np.array(lead)
