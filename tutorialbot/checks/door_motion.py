"""Exercise 10 of notebook 1, open design: a robot opens a door that it knows nothing of, judged on physics."""

import hashlib
from collections.abc import Callable
from dataclasses import replace
from types import FunctionType

import mujoco
import numpy as np
import pinocchio as pin

from tutorialbot.bo.objective import DoorTask, Trial, new_pose_cost
from tutorialbot.checks import door_physics
from tutorialbot.checks.door_section import SPACE, inside, unknown_door
from tutorialbot.checks.guard import Crashed, Student, Wrong, show
from tutorialbot.checks.mechanism import Exercise
from tutorialbot.scene.door import Door
from tutorialbot.trajectory import PoseTrajectory

BUDGET = 300  # moves
OPEN_ANGLE = np.deg2rad(80.0)  # on replay; the search stops at 90


class Robot:
    """A robot with its hand on the lever of a shut door that it knows nothing of. All it can do:

    robot.attempt(c)  move in the direction c (5,), measure, come back: a Trial (time, outcome, cost, start, settled)
    robot.keep(c)     move in that direction and stay there: a Trial
    robot.undo()      go back to before the last keep
    robot.pose        where the hand is; robot.kept: the poses after each keep, the first one included
    robot.moves_left  attempts and keeps that remain

    Directions are in the tool's frame, w = 0.15 m, at most 90 degrees; the cost is the `improved` one.
    A Trial with the outcome "opened" means that the door is open.
    """

    def __init__(self, door: Door, budget: int):
        self._task = DoorTask(door, space=SPACE, cost=new_pose_cost)
        self._task.simulation.watch = []
        self._left = budget
        self._times = [0.0]
        self._kept = [self._task.start]
        self._records: list[door_physics.Record] = []
        self._broken: Wrong | None = None
        self._lowest = [0.0]
        self._seen = self._fingerprint()

    @property
    def moves_left(self) -> int:
        """Attempts and keeps that remain."""
        return self._left

    @property
    def pose(self) -> pin.SE3:
        """Where the hand is."""
        return self._kept[-1].copy()

    @property
    def kept(self) -> PoseTrajectory:
        """The poses after each `keep`, the first one included, with the time that the moves took."""
        return PoseTrajectory(np.array(self._times), list(self._kept))

    def attempt(self, c: np.ndarray) -> Trial:
        """Move in the direction c (5,), measure, and come back."""
        return self._do(self._task.attempt, c)

    def keep(self, c: np.ndarray) -> Trial:
        """Move in the direction c (5,) and stay there."""
        trial = self._do(self._task.commit, c)
        self._kept.append(self._task.start)
        self._times.append(self._times[-1] + max(trial.time, 0.01))
        lowest = min(self._lowest[-1], min((lever for *_, lever in self._task.simulation.watch), default=0.0))
        self._lowest.append(lowest)
        self._records.append(door_physics.Record.of(self._task.trace, self._task.simulation.watch, lowest))
        return trial

    def undo(self) -> None:
        """Go back to before the last `keep`; nothing happens when there was none."""
        self._look()
        if len(self._kept) > 1:
            self._task.undo()
            self._kept.pop(), self._times.pop(), self._records.pop(), self._lowest.pop()
        self._seen = self._fingerprint()

    def _do(self, move: Callable[[np.ndarray], Trial], c: np.ndarray) -> Trial:
        self._look()
        if self._left <= 0:
            self._fail(Wrong("budget", f"more than {BUDGET} moves: a real robot would still be at it tomorrow."))
        self._left -= 1
        self._task.simulation.watch.clear()
        trial = move(inside(c))
        self._seen = self._fingerprint()
        return replace(trial, c=trial.c.copy())

    def _fail(self, wrong: Wrong) -> None:
        self._broken = self._broken or wrong
        raise wrong

    def _look(self) -> None:
        """Raise Wrong when anything of the world is not as the last move left it."""
        now = self._fingerprint()
        changed = [name for name, value in self._seen.items() if now[name] != value]
        if changed:
            self._fail(
                Wrong(
                    "hands off the world",
                    f"between two moves somebody changed {', '.join(changed)}: the robot may only move its hand.",
                )
            )

    def _fingerprint(self) -> dict[str, object]:
        simulation = self._task.simulation
        model = np.empty(mujoco.mj_sizeModel(simulation.model), np.uint8)
        mujoco.mj_saveModel(simulation.model, None, model)
        state, here = simulation.snapshot().state, self._task.here.state
        parts = {**vars(simulation), **vars(self._task)}
        return {
            "the state of the simulation (joints, forces, latch)": state.tobytes(),
            "the state that moves start from": here.tobytes(),
            "the number of moves left": self._left,
            "the model": hashlib.sha1(model).hexdigest(),
            "the door or the settings": (simulation.door, simulation.settings),
            "the parts of the robot": {
                n: id(p)
                for n, p in parts.items()
                if isinstance(p, FunctionType) or n in ("data", "model", "cost", "space")
            },
            "the names of its parts": sorted(parts),
            "where the joints are": str([parts[n] for n in ("_hinge", "_handle", "_latch", "_grasp")]),
        }


def _judge_open(student: Student) -> None:
    door = unknown_door()
    robot = Robot(door, BUDGET)
    try:
        answer = student(robot)
        robot._look()
    except (Wrong, Crashed):
        for record in robot._records:
            door_physics.judge(door, record)
        if robot._broken is not None:
            raise robot._broken from None
        raise
    for record in robot._records:
        door_physics.judge(door, record)
    if not isinstance(answer, PoseTrajectory):
        raise Wrong(
            "shape of the answer", f"the answer is {show(answer)}, expected a PoseTrajectory: robot.kept is one."
        )
    start = robot.kept.poses[0].actInv(answer.poses[0])
    if np.linalg.norm(start.translation) > 0.02 or np.linalg.norm(pin.log3(start.rotation)) > 0.1:
        raise Wrong(
            "starts at the handle",
            f"the path begins {np.linalg.norm(start.translation):.2f} m away from where the hand holds the shut door.",
        )
    if answer.duration > 300.0:
        raise Wrong("in reasonable time", f"the path takes {answer.duration:.0f} s; 300 s are enough for any door.")
    record = door_physics.replay(door, answer)
    door_physics.judge(door, record)
    reached = record.hinge.max(initial=0.0)
    if reached < OPEN_ANGLE:
        raise Wrong(
            "opens a fresh door",
            f"executed alone on the same door, shut again, your path opens it by {np.rad2deg(reached):.0f} degrees;"
            f" {np.rad2deg(OPEN_ANGLE):.0f} are asked for.",
        )


open_the_door = Exercise(
    "open_the_door",
    "open design: open a door that you know nothing of, and return the hand's path.",
    (
        'Algorithm 1: sections of trials; at the end of each, keep the best direction; end at the outcome "opened".',
        "What just worked will work again: try the last kept direction first. The rest of the trials may"
        " be random, or asked from TwistSearch.",
        "Where the hand really went tells more than where it was sent:"
        " SPACE.point(*SPACE.moved(trial.start, trial.settled)) is that direction."
        " Keep nothing whose cost is above -0.5.",
    ),
    _judge_open,
    limit=600.0,
)
