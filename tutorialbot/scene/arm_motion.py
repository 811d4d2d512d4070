"""Feed joint angles to the simulated arm of paper 2: trapezoidal profiles outside, PID controllers inside (MuJoCo)."""

from dataclasses import dataclass

import mujoco
import numpy as np

from tutorialbot.errors import InvalidValue, finite_array, finite_number
from tutorialbot.scene import control, room

PERIOD = 0.01  # of the outer loop [s]
REST = 1e-9  # [rad]
LONGEST = 3600.0  # that a way point may be held [s]


@dataclass(frozen=True)
class ArmTrace:
    """What the arm did: an instant every PERIOD.

    times (n,) [s]; commanded, measured (n, 7) [rad], the profile's reference and the joints; tip (n, 3) [m] the
    thumb's root in the abdomen's frame; arrivals (k,) the instant's number at which each way point has been held.
    """

    times: np.ndarray
    commanded: np.ndarray
    measured: np.ndarray
    tip: np.ndarray
    arrivals: np.ndarray


def follow_angles(
    world: mujoco.MjModel, data: mujoco.MjData, lead: np.ndarray, way_points: np.ndarray, *, hold: float = 0.5
) -> ArmTrace:
    """Move the left arm of an assembled world through joint angles (k, 7) [rad], each held for `hold` [s], for
    an instant at least.

    world, lead (10,): as `room.assemble` returns them; data: the state to go on from, see `room.place`; the base stays.
    Raises InvalidType or InvalidValue for way points of another shape, with NaN, or beyond a joint's range, and for a
    world whose time step is longer than PERIOD.
    """
    way_points = finite_array("way_points", way_points, (-1, len(room.ARM)))
    if not len(way_points):
        raise InvalidValue("way_points", "none", "one or more")
    if world.opt.timestep > PERIOD:
        raise InvalidValue("world.opt.timestep", world.opt.timestep, f"a time step of {PERIOD} s or less")
    ranges = np.array([world.joint(name).range for name in room.ARM])
    beyond = (way_points < ranges[:, 0] - 1e-6) | (way_points > ranges[:, 1] + 1e-6)
    if beyond.any():
        row, joint = np.argwhere(beyond)[0]
        low, high = ranges[joint].round(4).tolist()
        found = float(way_points[row, joint])
        raise InvalidValue(f"way_points[{row}, {joint}]", found, f"an angle within [{low}, {high}] rad")
    held = max(1, round(finite_number("hold", hold, 0.0, LONGEST) / PERIOD))
    actuators = [world.actuator(name).id for name in room.ARM]
    joints = [world.joint(name).qposadr[0] for name in room.ARM]
    abdomen, tip = data.site("abdomen"), data.site("tip")
    steps, base = round(PERIOD / world.opt.timestep), len(room.MOVING) - len(room.ARM)
    reference, velocity = data.qpos[joints].copy(), np.zeros(len(joints))
    rows, arrivals = [], []
    for goal in way_points:
        waited = 0
        while waited < held or np.abs(reference - goal).max() > REST:
            waited = waited + 1 if np.abs(reference - goal).max() <= REST else 0
            reference, velocity = control.trapezoid_step(
                reference, velocity, goal, room.SPEED[base:], room.ACCELERATION[base:], PERIOD
            )
            data.ctrl[actuators] = reference + lead[base:] * velocity
            mujoco.mj_step(world, data, steps)
            inside = abdomen.xmat.reshape(3, 3).T @ (tip.xpos - abdomen.xpos)
            rows.append((data.time, reference, data.qpos[joints], inside))
        arrivals.append(len(rows) - 1)
    times, commanded, measured, tips = (np.array(column) for column in zip(*rows, strict=True))
    return ArmTrace(times, commanded, measured, tips, np.array(arrivals))
