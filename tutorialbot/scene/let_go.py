"""A door with a closer, let go: how it swings when nobody touches it."""

import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number
from tutorialbot.scene.closing_door import ClosingDoor

STEP = 1e-3  # of the integration [s]


def let_go(door: ClosingDoor, times: np.ndarray, theta: float, rate: float = 0.0) -> np.ndarray:
    """Return the angles (n,) [rad] of the door at `times` (n,) [s], increasing, from `theta` [rad], `rate` [rad/s] on.

        inertia * theta'' = -closer(theta) - hinge_damping * theta' - hinge_friction against the motion

    until it meets a stop and stays there: it does not rebound. Raises InvalidType or InvalidValue for bad arguments.
    """
    if not isinstance(door, ClosingDoor):
        raise InvalidType("door", door, "a ClosingDoor")
    times, speed = finite_array("times", times, (-1,)), finite_number("rate", rate)
    if not len(times) or (np.diff(times) <= 0.0).any():
        raise InvalidValue("times", times, "one or more, increasing")
    angle = finite_number("theta", theta, 0.0, door.open_limit)
    clock = np.arange(times[0], times[-1] + STEP, STEP)
    angles = np.empty(len(clock))
    for i in range(len(clock)):
        angles[i] = angle
        speed = _faster(door, angle, speed)
        angle = min(max(angle + STEP * speed, 0.0), door.open_limit)
        if angle in (0.0, door.open_limit):
            speed = 0.0
    return np.interp(times, clock, angles)


def _faster(door: ClosingDoor, angle: float, speed: float) -> float:
    """Return the speed [rad/s] a step later. Friction stops a door that the closer does not move."""
    drive = -door.closer_torque - door.closer_stiffness * angle if angle < door.hold_angle else 0.0
    stuck = abs(drive) <= door.hinge_friction
    if speed == 0.0 and stuck:
        return 0.0
    drag = door.hinge_damping * speed + np.copysign(door.hinge_friction, speed if speed else drive)
    after = speed + STEP * (drive - drag) / door.inertia
    return 0.0 if stuck and after * speed < 0.0 else float(after)
