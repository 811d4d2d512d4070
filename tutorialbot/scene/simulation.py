"""The door trial in MuJoCo: a robot holds the handle, follows joint targets, and feels force and torque at its wrist.

What the robot may know of a move is in `Trace`: time, force, torque and its own pose. The door's angles are for the
spectator alone (`DoorSimulation.hinge_angle`, `.lever_angle`, `.watch`); the search sees them only through the outcome
"opened", its stop condition.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from tutorialbot.errors import finite_array
from tutorialbot.scene import control
from tutorialbot.scene.door import Door
from tutorialbot.scene.world import ACCELERATION, CASTERS, DRIVE_RATE, MOVING, SPEED, STEER_RATE, Settings, assemble
from tutorialbot.seeding import make_rng

SHUT = np.deg2rad(0.3)  # below this hinge angle the latch can catch
OUTCOMES = ("finished", "collision", "opened", "failed")


@dataclass(frozen=True)
class Trace:
    """What the robot knows of one move: nothing of the door but whether it is open.

    times (n,) [s] from the move's start, wrench (n, 6) at the wrist [N, Nm] in the sensor's frame, tared; joints (n, 9)
    measured; outcome one of OUTCOMES; `time` [s] the move lasted: the paper's time to collision t_c when it collided.
    """

    times: np.ndarray
    wrench: np.ndarray
    joints: np.ndarray
    outcome: str
    time: float

    @property
    def force(self) -> np.ndarray:
        """Norm of the force (n,) [N]."""
        return np.linalg.norm(self.wrench[:, :3], axis=1)

    @property
    def torque(self) -> np.ndarray:
        """Norm of the torque (n,) [Nm]."""
        return np.linalg.norm(self.wrench[:, 3:], axis=1)


@dataclass(frozen=True)
class Snapshot:
    """Everything that decides what happens next: MuJoCo's state, the controllers' and the noise generator's."""

    state: np.ndarray
    reference: np.ndarray
    velocity: np.ndarray
    steer: list[float]
    drive: list[float]
    noise: dict


class DoorSimulation:
    """One robot at one door; at `posture` (9,), values of MOVING, its hand is on the handle of the shut door.

    `seen=False` leaves out of `model` what is there for the eye alone, see `assemble`.
    """

    def __init__(
        self, door: Door, posture: np.ndarray, settings: Settings | None = None, seed: int = 0, *, seen: bool = True
    ):
        self.door, self.settings = door, settings or Settings()
        self.model, self._lead = assemble(door, self.settings, seen=seen)
        self.data = mujoco.MjData(self.model)
        self._posture = finite_array("posture", posture, (len(MOVING),))
        self._seed = seed
        model, names = self.model, door.names
        self._qpos = np.array([model.joint(name).qposadr[0] for name in MOVING])
        self._qvel = np.array([model.joint(name).dofadr[0] for name in MOVING])
        self._ctrl = np.array([model.actuator(name).id for name in MOVING])
        casters = ("caster_left", "caster_right")
        self._steer_ctrl = np.array([model.actuator(f"{name}_steer").id for name in casters])
        self._drive_ctrl = np.array([model.actuator(f"{name}_drive").id for name in casters])
        self._hinge = model.joint(f"door/{names.hinge}").qposadr[0]
        self._handle = None if names.handle is None else model.joint(f"door/{names.handle}").qposadr[0]
        self._latch = None if names.latch is None else model.equality(f"door/{names.latch}").id
        self._grasp = model.equality("grasp").id
        hand = model.site("wrist").bodyid[0]
        self._wrist = model.site("wrist").id
        self._weight = float(model.body_mass[hand]) * -model.opt.gravity[2]
        self._center = model.body_ipos[hand] - model.site("wrist").pos
        self._substeps = max(1, round(self.settings.sensor_period / self.settings.timestep))
        self._looks = max(1, round(self.settings.control_period / (self._substeps * self.settings.timestep)))
        self.watch: list[tuple[float, float, float]] | None = None  # (time, hinge, lever), when somebody wants to see
        self.reset()

    # --- state -------------------------------------------------------------------------------------------------------
    def reset(self) -> None:
        """Shut the door, put the hand on the handle, forget every move."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self._qpos] = self._posture
        self._noise = make_rng(self._seed, 1)
        self._steer, self._drive = [0.0, 0.0], [0.0, 0.0]
        self.begin()

    def begin(self) -> None:
        """Start a move where the robot is: every reference at its measured value, integrals empty."""
        mujoco.mj_forward(self.model, self.data)
        self._reference = self.data.qpos[self._qpos].copy()
        self._velocity = np.zeros(len(MOVING))
        self.data.act[:] = 0.0
        self.data.ctrl[self._ctrl] = self._reference

    def snapshot(self) -> Snapshot:
        """Return all state, so that `restore` goes on bit for bit as if nothing had happened since."""
        size = mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_INTEGRATION)
        state = np.empty(size)
        mujoco.mj_getState(self.model, self.data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        return Snapshot(
            state,
            self._reference.copy(),
            self._velocity.copy(),
            self._steer.copy(),
            self._drive.copy(),
            self._noise.bit_generator.state,
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to `snapshot`."""
        mujoco.mj_setState(self.model, self.data, snapshot.state, mujoco.mjtState.mjSTATE_INTEGRATION)
        self._reference, self._velocity = snapshot.reference.copy(), snapshot.velocity.copy()
        self._steer, self._drive = snapshot.steer.copy(), snapshot.drive.copy()
        self._noise.bit_generator.state = snapshot.noise
        self.data.warning.number[:] = 0

    # --- what can be read --------------------------------------------------------------------------------------------
    @property
    def joints(self) -> np.ndarray:
        """Measured values of MOVING (9,)."""
        return self.data.qpos[self._qpos].copy()

    @property
    def tool_pose(self) -> pin.SE3:
        """Measured pose of the hand in the world."""
        mujoco.mj_kinematics(self.model, self.data)
        site = self.data.site("tool")
        return pin.SE3(site.xmat.reshape(3, 3).copy(), site.xpos.copy())

    @property
    def hinge_angle(self) -> float:
        """Angle of the door [rad] (or stroke [m] of a sliding one): for the spectator."""
        return float(self.data.qpos[self._hinge])

    @property
    def lever_angle(self) -> float:
        """Angle of the handle [rad], 0 when there is none: for the spectator."""
        return 0.0 if self._handle is None else float(self.data.qpos[self._handle])

    # --- motion ------------------------------------------------------------------------------------------------------
    def follow(self, targets: Iterable[np.ndarray], *, stop: bool = True) -> Trace:
        """Follow joint targets (9,), one a control period, and return what was felt.

        With `stop` the move ends at the first reading beyond the force or torque limit ("collision"). It always ends
        when the door is open ("opened"), and as "failed" when the simulation warns, resets itself or leaves the finite
        numbers.
        """
        period = self._substeps * self.settings.timestep
        readings, joints, outcome = [], [], "finished"
        for goal in targets:
            before, lead = self._reference, self._command(goal, self._looks * period)
            for look in range(1, self._looks + 1):
                self.data.ctrl[self._ctrl] = before + (look / self._looks) * (self._reference - before) + lead
                mujoco.mj_step(self.model, self.data, self._substeps)
                self._switch_latch()
                readings.append(self._read_wrench())
                joints.append(self.data.qpos[self._qpos])
                if self.watch is not None:
                    self.watch.append((self.data.time, self.hinge_angle, self.lever_angle))
                outcome = self._judge(readings[-1], stop)
                if outcome != "finished":
                    break
            if outcome != "finished":
                break
        if self.data.warning.number.any() or not np.isfinite(self.data.qpos).all():
            outcome = "failed"
        times = period * np.arange(1, len(readings) + 1)
        return Trace(
            times,
            np.array(readings).reshape(-1, 6),
            np.array(joints).reshape(-1, len(MOVING)),
            outcome,
            period * len(readings),
        )

    def _judge(self, wrench: list[float], stop: bool) -> str:
        """Return how the move stands after a reading: one of OUTCOMES, "finished" while nothing has happened."""
        force, torque = math.hypot(*wrench[:3]), math.hypot(*wrench[3:])
        if not math.isfinite(force + torque):
            return "failed"
        if self.data.qpos[self._hinge] >= self.settings.open_angle:
            return "opened"
        over = force > self.settings.force_limit or torque > self.settings.torque_limit
        return "collision" if stop and over else "finished"

    def relax(self, seconds: float) -> Trace:
        """Command the robot to stay where it is, and let contact forces die away; return what was felt."""
        self.begin()
        goal = self._reference.copy()
        return self.follow((goal for _ in range(round(seconds / self.settings.control_period))), stop=False)

    def _command(self, goal: np.ndarray, period: float) -> np.ndarray:
        """One tick of the outer loop: trapezoids, then casters; return the lead (9,) of the inner loops' set points."""
        before = self._reference
        self._reference, self._velocity = control.trapezoid_step(
            before, self._velocity, goal, SPEED, ACCELERATION, period
        )
        x, y, turn = self._velocity[:3].tolist()
        if x or y or turn:
            yaw = float(before[2])
            cosine, sine = math.cos(yaw), math.sin(yaw)
            factor = self._roll(cosine * x + sine * y, cosine * y - sine * x, turn, period)
            if factor < 1.0:  # the casters cannot turn that fast: the base goes the same way, slower
                self._velocity[:3] *= factor
                self._reference[:3] = before[:3] + period * self._velocity[:3]
        self.data.ctrl[self._steer_ctrl] = self._steer
        self.data.ctrl[self._drive_ctrl] = self._drive
        return self._lead * self._velocity

    def _roll(self, vx: float, vy: float, turn: float, period: float) -> float:
        """Roll the casters under a twist in the base's frame; return the share of it that their rate limits allow.

        The equations of `control.to_casters`, written out for plain floats: this runs 100 times a trial.
        """
        rates = []
        for caster, steer in zip(CASTERS, self._steer, strict=True):
            ux, uy = vx - turn * caster.y, vy + turn * caster.x
            cosine, sine = math.cos(steer), math.sin(steer)
            rates.append(((cosine * uy - sine * ux) / caster.offset - turn, (cosine * ux + sine * uy) / caster.radius))
        excess = max(1.0, *(max(abs(steer) / STEER_RATE, abs(drive) / DRIVE_RATE) for steer, drive in rates))
        for i, (steer, drive) in enumerate(rates):
            self._steer[i] += period * steer / excess
            self._drive[i] += period * drive / excess
        return 1.0 / excess

    def _switch_latch(self) -> None:
        """Hysteresis of the latch: off below the release angle, on again above the engage angle with the door shut."""
        if self._latch is None or self._handle is None:
            return
        angle = self.data.qpos[self._handle]
        if self.data.eq_active[self._latch]:
            if angle < self.door.release_angle:
                self.data.eq_active[self._latch] = 0
        elif angle > self.door.engage_angle and self.data.qpos[self._hinge] < SHUT:
            self.data.eq_active[self._latch] = 1

    def _read_wrench(self) -> list[float]:
        """Force and torque at the wrist in the sensor's frame, less the hand's weight, plus noise."""
        wrench = self.data.sensordata[:6].tolist()
        if self.settings.tare:
            x, y, z = (self._weight * up for up in self.data.site_xmat[self._wrist, 6:].tolist())
            cx, cy, cz = self._center.tolist()
            gravity = (x, y, z, cy * z - cz * y, cz * x - cx * z, cx * y - cy * x)
            wrench = [reading - part for reading, part in zip(wrench, gravity, strict=True)]
        if self.settings.force_noise or self.settings.torque_noise:
            noise = self._noise.standard_normal(6).tolist()
            scale = 3 * [self.settings.force_noise] + 3 * [self.settings.torque_noise]
            wrench = [reading + n * s for reading, n, s in zip(wrench, noise, scale, strict=True)]
        return wrench
