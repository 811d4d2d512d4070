"""The objective of paper 1: move the hand in a direction and measure the time until force or torque says stop.

The robot knows time, force, torque and its own pose. Nothing here reads the door.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import mujoco
import numpy as np
import pinocchio as pin

from tutorialbot import robots
from tutorialbot.bo.space import SearchSpace
from tutorialbot.errors import InvalidType, InvalidValue, finite_number
from tutorialbot.ik import prioritized
from tutorialbot.pose import interpolate, so4_distance
from tutorialbot.scene.door import Door
from tutorialbot.scene.simulation import MOVING, DoorSimulation, Settings, Trace
from tutorialbot.trajectory import PoseTrajectory

NOMINAL = np.array(
    [0.0, 0.0, 0.0, 0.0, 0.87, -1.66, 0.0, 0.79, 0.0]
)  # of MOVING: elbow down, hand level, forearm raised
POSTURE_WEIGHTS = np.array(
    [0.03, 0.03, 0.03, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
)  # of the springs that share a motion out to base and arm
TRACKING = 3e-4  # their stiffness against the hand's while it follows a path
DURATION = 4.0  # of a whole move [s], paper 1, section 4
PENALTY = 5.0  # t_p of eq. (1)
NEW, NEW_WEIGHT = 0.1, 10.0  # `new_pose_cost`: what counts as new, and what it is worth [s]
BACK = 0.06  # `new_pose_cost`: what counts as coming back [m]
PATH_STEP = 0.05  # SO(4) distance between the poses kept of the path


@dataclass(frozen=True)
class Trial:
    """One evaluation of the objective. `time` is t_c [s]; `settled` the pose once contact forces have died away."""

    c: np.ndarray
    time: float
    outcome: str
    start: pin.SE3
    end: pin.SE3
    settled: pin.SE3
    cost: float

    def to_json(self) -> dict:
        """Return what `from_json` needs, every bit of it."""
        poses = {name: getattr(self, name).homogeneous.tolist() for name in ("start", "end", "settled")}
        return {
            "c": self.c.tolist(),
            "time": self.time,
            "outcome": self.outcome,
            "cost": self.cost,
            **poses,
        }

    @classmethod
    def from_json(cls, entry: dict) -> "Trial":
        """Return the trial that `to_json` wrote."""
        poses = {name: pin.SE3(np.array(entry[name])) for name in ("start", "end", "settled")}
        return cls(
            np.array(entry["c"]),
            entry["time"],
            entry["outcome"],
            cost=entry["cost"],
            **poses,
        )


class Visited(Protocol):
    """What a cost may know of the way so far: the hand's poses, nothing of the door."""

    poses: list[pin.SE3]  # along the committed path, the first one with the door shut
    sections_done: int


Cost = Callable[[float, pin.SE3, pin.SE3, Visited], float]


def paper_cost(time: float, start: pin.SE3, settled: pin.SE3, path: Visited) -> float:
    """Return f_b = -t_c + t_p (paper 1, eq. (1)).

    t_p = 5 when the hand comes nearer to the pose in which it held the shut door, by the SO(4) distance with R = 0.1 m,
    else 0; the first section has no penalty.
    """
    first = path.poses[0]
    nearer = so4_distance(first, settled) < so4_distance(first, start)
    return -time + (PENALTY if nearer and path.sections_done else 0.0)


def new_pose_cost(time: float, start: pin.SE3, settled: pin.SE3, path: Visited) -> float:
    """Return eq. (1) mended: -t_c - 10 d, with d the SO(4) distance to the nearest pose of the path so far.

    -t_c + t_p while d < 0.1, and when the hand comes back toward the first pose by more than 0.06 m from its furthest.
    Time alone cannot tell a hand that moves from one that presses with a soft arm: where it rests once the forces have
    died away can. And "away from the first pose" cannot tell a door that opens from a lever that turns further: away
    from everywhere the hand has been can.
    """
    new = min(so4_distance(pose, settled) for pose in path.poses)
    first = path.poses[0].translation
    furthest = max(float(np.linalg.norm(pose.translation - first)) for pose in path.poses)
    back = furthest - float(np.linalg.norm(settled.translation - first))
    return -time + PENALTY if new < NEW or back > BACK else -time - NEW_WEIGHT * new


class DoorTask:
    """The robot with its hand on the handle of a shut door, and what it can try.

    `here` is the state that every trial starts from; `commit` moves it on. Raises InvalidValue when the robot cannot
    reach the handle. `seen=False` makes a model that is faster but not for a viewer, with the same results.
    """

    def __init__(
        self,
        door: Door,
        *,
        settings: Settings | None = None,
        space: SearchSpace | None = None,
        cost: Cost = paper_cost,
        relax: float = 0.15,
        seed: int = 0,
        seen: bool = True,
    ):
        settings, space = Settings() if settings is None else settings, SearchSpace() if space is None else space
        kinds = {"door": (door, Door), "settings": (settings, Settings), "space": (space, SearchSpace)}
        for name, (value, kind) in kinds.items():
            if not isinstance(value, kind):
                raise InvalidType(name, value, f"a {kind.__name__}")
        if not callable(cost):
            raise InvalidType("cost", cost, "a function")
        self.space, self.cost, self.relax = space, cost, finite_number("relax", relax, 0.0, 10.0)
        robot = robots.load_pinocchio("mobile_manipulator", MOVING)
        posture = start_posture(door, robot)
        self.simulation = DoorSimulation(door, posture, settings, seed, seen=seen)
        hand = prioritized.Task("tool", pin.SE3.Identity())
        self.kinematics = prioritized.problem(robot, hand, posture, POSTURE_WEIGHTS)
        self.simulation.relax(0.3)
        self.simulation.begin()
        self.start = self.simulation.tool_pose
        self.poses = [self.start]
        self.here = self.simulation.snapshot()
        self.sections_done = 0
        self._before: list = []  # what `undo` goes back to
        self.trace: Trace | None = None  # of the last move

    def attempt(self, c: np.ndarray) -> Trial:
        """Move from `here` in the direction c (5,), measure, and come back by restoring the snapshot."""
        self.simulation.restore(self.here)
        trial = self._move(c)
        self.simulation.restore(self.here)
        return trial

    def commit(self, c: np.ndarray) -> Trial:
        """Move from `here` in the direction c (5,) and stay: the end of the move is where the next section starts."""
        self.simulation.restore(self.here)
        before = (self.here, self.start, len(self.poses))
        trial = self._move(c)
        self._before.append(before)
        self.simulation.begin()
        self.start = self.simulation.tool_pose
        self.here = self.simulation.snapshot()
        pieces = math.ceil(so4_distance(trial.start, self.start) / PATH_STEP)
        self.poses += [interpolate(trial.start, self.start, (i + 1) / pieces) for i in range(pieces)]
        self.sections_done += 1
        return trial

    def undo(self) -> None:
        """Go back to before the last `commit`, and forget its way. Raises InvalidValue when there is none."""
        if not self._before:
            raise InvalidValue("undo", "no move", "at least one `commit` before it")
        self.here, self.start, known = self._before.pop()
        del self.poses[known:]
        self.sections_done -= 1
        self.simulation.restore(self.here)

    def _move(self, c: np.ndarray) -> Trial:
        simulation = self.simulation
        simulation.begin()
        start = simulation.tool_pose
        self.trace = simulation.follow(self.targets(simulation.joints, start, self.space.goal(start, c)))
        end = settled = simulation.tool_pose
        if self.trace.outcome == "collision" and self.relax:
            rest = simulation.relax(self.relax)
            settled = simulation.tool_pose
            if rest.outcome == "failed":  # the simulation broke down while the hand came to rest
                self.trace = replace(self.trace, outcome="failed")
        failed = self.trace.outcome == "failed"
        cost = PENALTY if failed else self.cost(self.trace.time, start, settled, self)
        finite_number("cost(...)", cost)
        return Trial(np.asarray(c, dtype=float), self.trace.time, self.trace.outcome, start, end, settled, cost)

    def targets(
        self, joints: np.ndarray, start: pin.SE3, goal: pin.SE3, duration: float = DURATION
    ) -> Iterator[np.ndarray]:
        """Yield joint targets (9,), one a control period, along the straight line and SLERP from `start` to `goal`."""
        steps = max(1, round(duration / self.simulation.settings.control_period))
        return self.track(joints, (interpolate(start, goal, i / steps) for i in range(1, steps + 1)))

    def track(self, joints: np.ndarray, poses: Iterable[pin.SE3]) -> Iterator[np.ndarray]:
        """Yield joint targets (9,) that carry the hand through `poses`, starting at `joints` (9,).

        The arm is drawn to NOMINAL and the base to where it stands now, so that both share the motion in one way only.
        """
        self.kinematics.posture[:3] = joints[:3]
        for pose in poses:
            joints = prioritized.follow(self.kinematics, pose, joints, TRACKING)
            yield joints


def start_posture(door: Door, robot: pin.Model | None = None) -> np.ndarray:
    """Return joint values (9,) of MOVING that put the hand on the handle of the shut door, the base straight in front
    of it. `robot` spares loading it; it has the joints MOVING.

    Raises InvalidValue when the handle is out of the robot's reach.
    """
    model = door.model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    site = data.site(door.names.grip)
    grip = pin.SE3(site.xmat.reshape(3, 3).copy(), site.xpos.copy())
    robot = robots.load_pinocchio("mobile_manipulator", MOVING) if robot is None else robot
    known = robot.createData()
    pin.framesForwardKinematics(robot, known, NOMINAL)
    hand = known.oMf[robot.getFrameId("tool")]
    yaw = math.atan2(grip.rotation[1, 0], grip.rotation[0, 0])
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    posture = NOMINAL.copy()
    posture[:2] = grip.translation[:2] - turn @ hand.translation[:2]
    posture[2] = yaw
    result = prioritized.solve(robot, posture, prioritized.Task("tool", grip), posture_weights=POSTURE_WEIGHTS)
    if not result.converged:
        raise InvalidValue(
            "door",
            f"handle at {np.round(grip.translation, 3).tolist()} m",
            f"a handle within the robot's reach (the hand stops {result.position_error:.3f} m short)",
        )
    return result.q


def execute(door: Door, trajectory: PoseTrajectory, settings: Settings | None = None) -> tuple[float, Trace]:
    """Let the hand follow `trajectory` on a fresh shut `door`, with no search and no stop; return the hinge angle
    reached [rad].

    The way is known, so by default the arm is as stiff as it can be (stiffness 1) and nothing ends the move but an open
    door. Raises InvalidType for a `trajectory` that is none.
    """
    if not isinstance(trajectory, PoseTrajectory):
        raise InvalidType("trajectory", trajectory, "a PoseTrajectory")
    task = DoorTask(door, settings=Settings(stiffness=1.0) if settings is None else settings)
    period = task.simulation.settings.control_period
    instants = np.arange(period, trajectory.duration + 0.5, period)
    poses = (trajectory.sample(trajectory.times[0] + t) for t in instants)
    way = task.track(task.simulation.joints, poses)
    trace = task.simulation.follow(way, stop=False)
    return task.simulation.hinge_angle, trace
