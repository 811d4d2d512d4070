"""Motions over time: of joints (`Trajectory`) and of a gripper (`PoseTrajectory`)."""

import bisect
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue, TutorialbotError, finite_array, finite_number
from tutorialbot.pose import check_pose, from_quaternion, interpolate, to_quaternion

FORMAT = "tutorialbot pose trajectory, 1"


def _rising(times: np.ndarray) -> np.ndarray:
    times = finite_array("times", times, (-1,))
    if len(times) == 0 or (np.diff(times) <= 0).any():
        raise InvalidValue("times", times, "at least one instant, each later than the one before")
    return times


@dataclass(frozen=True)
class Trajectory:
    """Joint positions over time.

    times: (n,) [s], strictly rising; positions: (n, nq) [rad or m].
    """

    times: np.ndarray
    positions: np.ndarray

    def __post_init__(self):
        object.__setattr__(self, "times", _rising(self.times))
        object.__setattr__(self, "positions", finite_array("positions", self.positions, (len(self.times), -1)))

    @property
    def duration(self) -> float:
        """Time from the first to the last instant [s]."""
        return float(self.times[-1] - self.times[0])

    def sample(self, t: float | np.ndarray) -> np.ndarray:
        """Return the positions at `t` [s], linear between instants and held before the first and after the last.

        (nq,) for a number, (m, nq) for an array (m,) of instants.
        """
        t = finite_array("t", t, (-1,)) if np.ndim(t) else finite_number("t", t)
        return np.stack([np.interp(t, self.times, column) for column in self.positions.T], axis=-1)


@dataclass(frozen=True)
class PoseTrajectory:
    """Poses over time, with `pose.interpolate` between them: straight lines and SLERP.

    times: (n,) [s], strictly rising; poses: n `pinocchio.SE3`.
    """

    times: np.ndarray
    poses: list[pin.SE3]

    def __post_init__(self):
        object.__setattr__(self, "times", _rising(self.times))
        if not isinstance(self.poses, list | tuple):
            raise InvalidType("poses", self.poses, "a list of pinocchio.SE3")
        if len(self.poses) != len(self.times):
            raise InvalidValue("poses", f"{len(self.poses)} poses", f"{len(self.times)}, one for each instant")
        object.__setattr__(self, "poses", [check_pose(f"poses[{i}]", pose) for i, pose in enumerate(self.poses)])

    @property
    def duration(self) -> float:
        """Time from the first to the last instant [s]."""
        return float(self.times[-1] - self.times[0])

    def sample(self, t: float) -> pin.SE3:
        """Return the pose at `t` [s]; the first and the last pose hold before and after."""
        t = finite_number("t", t)
        if t <= self.times[0] or len(self.poses) == 1:
            return self.poses[0].copy()
        if t >= self.times[-1]:
            return self.poses[-1].copy()
        i = bisect.bisect_right(self.times, t) - 1
        share = (t - self.times[i]) / (self.times[i + 1] - self.times[i])
        return interpolate(self.poses[i], self.poses[i + 1], share)

    def save(self, path: str | Path) -> None:
        """Write a JSON file: times [s], positions [m], quaternions (w, x, y, z). Written beside and then renamed.

        Raises BrokenFile when it cannot be written.
        """
        split = [to_quaternion(pose) for pose in self.poses]
        content = {
            "format": FORMAT,
            "times": self.times.tolist(),
            "positions": [position.tolist() for position, _ in split],
            "quaternions_wxyz": [quaternion.tolist() for _, quaternion in split],
        }
        path = Path(path)
        unfinished = path.with_name(path.name + ".part")
        try:
            unfinished.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
            unfinished.replace(path)
        except OSError as error:
            raise BrokenFile(f"{path}: cannot be written: {error.strerror}") from None

    @staticmethod
    def load(path: str | Path) -> "PoseTrajectory":
        """Read what `save` wrote; raise BrokenFile when it is cut short, damaged, or something else."""
        try:
            content = json.loads(Path(path).read_text(encoding="utf-8"))
            if content["format"] != FORMAT:
                raise BrokenFile(f"{path}: format {content['format']!r}, expected {FORMAT!r}")
            pairs = zip(content["positions"], content["quaternions_wxyz"], strict=True)
            return PoseTrajectory(content["times"], [from_quaternion(p, q) for p, q in pairs])
        except BrokenFile:
            raise
        except OSError as error:
            raise BrokenFile(f"{path}: cannot be read: {error.strerror}") from None
        except (RecursionError, ValueError, TypeError, KeyError, TutorialbotError) as error:
            raise BrokenFile(f"{path}: not a whole pose trajectory ({error!r})") from error
