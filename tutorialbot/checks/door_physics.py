"""Was it the hand that opened the door? Records of moves at a door, and the rules that physics sets them.

A joint that is written, a latch that is switched off, a force out of nothing: each leaves a trace that no hand can.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from tutorialbot.bo.objective import DoorTask
from tutorialbot.checks.guard import Wrong
from tutorialbot.scene.door import Door
from tutorialbot.scene.simulation import MOVING, Settings, Trace, assemble
from tutorialbot.trajectory import PoseTrajectory

SLACK = 0.03  # of the grasp [m]
SLIP = 0.1  # by which the handle may be faster than the hand [m/s]: both are joined by a stiff spring
LOOSE = np.deg2rad(1.5)  # a hinge angle that a shut latch does not allow
BRUTE = (250.0, 60.0)  # forces [N] and torques [Nm] that break a handle or a wrist


@dataclass(frozen=True)
class Record:
    """One move at a door as a spectator sees it, n instants of equal distance.

    times (n,) [s]; joints (n, 9) of MOVING; wrench (n, 6) at the wrist, tared, in the sensor's frame; hinge (n,) and
    lever (n,) [rad]; lowest [rad] is the lever's lowest angle up to the end of the move, earlier moves included.
    """

    times: np.ndarray
    joints: np.ndarray
    wrench: np.ndarray
    hinge: np.ndarray
    lever: np.ndarray
    lowest: float

    @classmethod
    def of(cls, trace: Trace, watch: list[tuple[float, float, float]], lowest: float = 0.0) -> "Record":
        """Join what the robot felt with what a spectator saw: both looked at the same instants."""
        seen = np.array(watch)[: len(trace.times)]
        return cls(
            trace.times,
            trace.joints,
            trace.wrench,
            seen[:, 1],
            seen[:, 2],
            min(lowest, float(seen[:, 2].min(initial=0.0))),
        )


def replay(door: Door, trajectory: PoseTrajectory) -> Record:
    """Let a robot that nobody has touched follow `trajectory` on a door that nobody has touched."""
    task = DoorTask(door, settings=Settings(stiffness=1.0))
    simulation = task.simulation
    period = simulation.settings.control_period
    simulation.watch = []
    instants = np.arange(period, trajectory.duration + 0.5, period)
    poses = (trajectory.sample(trajectory.times[0] + t) for t in instants)
    return Record.of(simulation.follow(task.track(simulation.joints, poses), stop=False), simulation.watch)


@dataclass(frozen=True)
class Motion:
    """Where hand and handle were (n, 3) [m], their speeds (n,) [m/s], and the work of the hand on the door (n,) [J]."""

    hand: np.ndarray
    grip: np.ndarray
    hand_speed: np.ndarray
    grip_speed: np.ndarray
    work: np.ndarray


def reconstruct(door: Door, record: Record) -> Motion:
    """Return the motion of hand and handle: by the joints alone, whatever any simulation said of them."""
    model, _ = assemble(door, Settings())
    data = mujoco.MjData(model)
    robot = [model.joint(name).qposadr[0] for name in MOVING]
    hinge, lever = (model.joint(f"door/{name}").qposadr[0] for name in (door.names.hinge, door.names.handle))
    tool, wrist, grip = (model.site(name).id for name in ("tool", "wrist", f"door/{door.names.grip}"))
    hands, grips, wrists, frames = [], [], [], []
    for joints, open_, turned in zip(record.joints, record.hinge, record.lever, strict=True):
        data.qpos[robot], data.qpos[hinge], data.qpos[lever] = joints, open_, turned
        mujoco.mj_kinematics(model, data)
        hands.append(data.site_xpos[tool].copy()), grips.append(data.site_xpos[grip].copy())
        wrists.append(data.site_xpos[wrist].copy()), frames.append(data.site_xmat[wrist].reshape(3, 3).copy())
    hand, handle, place = map(np.array, (hands, grips, wrists))
    step = np.diff(record.times, prepend=0.0)
    steps = np.diff(place, axis=0, prepend=place[:1])
    turns = [np.zeros(3), *(pin.log3(b @ a.T) for a, b in zip(frames, frames[1:], strict=False))]
    felt = [(frame @ wrench[:3], frame @ wrench[3:]) for frame, wrench in zip(frames, record.wrench, strict=True)]
    work = np.cumsum([force @ s + torque @ t for (force, torque), s, t in zip(felt, steps, turns, strict=True)])
    speeds = [np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1) / step for points in (hand, handle)]
    return Motion(hand, handle, *speeds, work)


def losses(door: Door, record: Record) -> float:
    """Return the energy [J] that the hinge turned into heat on the way."""
    turned = np.diff(record.hinge, prepend=record.hinge[:1])
    step = np.diff(record.times, prepend=0.0)
    return float(np.sum(door.hinge_damping * turned**2 / step + door.hinge_friction * np.abs(turned)))


def released(door: Door, record: Record) -> float:
    """Return the energy [J] that the lever's spring gave back on the way (negative: that it took up)."""
    first, last = (0.5 * door.lever_stiffness * (door.lever_preload - record.lever[i]) ** 2 for i in (0, -1))
    return float(first - last)


def judge(door: Door, record: Record) -> None:
    """Raise Wrong by the first rule of physics that the move breaks."""
    if not len(record.times):
        return
    motion = reconstruct(door, record)
    apart = np.linalg.norm(motion.hand - motion.grip, axis=1)
    faster = motion.grip_speed - motion.hand_speed
    if faster.max() > SLIP:
        i = int(faster.argmax())
        raise Wrong(
            "the handle moves with the hand",
            f"after {record.times[i]:.2f} s the handle runs at {motion.grip_speed[i]:.1f} m/s and the hand at"
            f" {motion.hand_speed[i]:.2f} m/s: the door was put there, nobody moved it.",
        )
    if apart.max() > SLACK:
        i = int(apart.argmax())
        raise Wrong(
            "the hand holds the handle",
            f"after {record.times[i]:.2f} s the hand is {apart[i]:.2f} m away from the handle.",
        )
    loose = record.hinge.max()
    if loose > LOOSE and record.lowest > door.release_angle:
        raise Wrong(
            "the lever opens the latch",
            f"the hinge came to {np.rad2deg(loose):.0f} degrees, but the lever never below"
            f" {np.rad2deg(record.lowest):.0f} degrees: the latch lets go at {np.rad2deg(door.release_angle):.0f}.",
        )
    heat, given = losses(door, record), motion.work[-1] + released(door, record)
    if loose > LOOSE and given < 0.5 * heat - 0.03:
        raise Wrong(
            "the hand does the work",
            f"the hinge turned {heat:.2f} J into heat, but hand and lever spring gave the door only {given:.2f} J:"
            " something else pushed it.",
        )
    force, torque = (np.linalg.norm(part, axis=1).max() for part in (record.wrench[:, :3], record.wrench[:, 3:]))
    if force > BRUTE[0] or torque > BRUTE[1]:
        raise Wrong(
            "no brute force",
            f"the wrist felt {force:.0f} N and {torque:.0f} Nm; the handle breaks at {BRUTE[0]:g} N or"
            f" {BRUTE[1]:g} Nm.",
        )
