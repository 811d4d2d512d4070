"""The way to open a door for somebody who knows all its measures."""

import numpy as np
import pinocchio as pin

from tutorialbot.scene.door import Door
from tutorialbot.trajectory import PoseTrajectory


def ideal_path(door: Door, start: pin.SE3, angle: float = 1.7) -> PoseTrajectory:
    """Turn the lever about its spindle by 43 degrees, then let go half-way while the door swings about its hinge."""
    sign = 1.0 if door.side == "right" else -1.0
    spindle = start * pin.SE3(np.eye(3), np.array([0.0, sign * door.lever_length, 0.0]))
    down = [spindle * pin.SE3(pin.exp3(np.array([sign * a, 0, 0])), np.zeros(3)) * spindle.actInv(start)
            for a in np.linspace(0.0, 0.75, 5)]  # fmt: skip
    swing = [
        pin.SE3(pin.exp3(np.array([0, 0, sign * a])), np.zeros(3)) * down[-1] for a in np.linspace(0.0, angle, 12)[1:]
    ]
    poses = down + swing
    return PoseTrajectory(2.0 * np.arange(len(poses)), poses)
