"""The cleaning in MuJoCo: set points for base and arm through trapezoids, what touches what, what the nozzle passed.

Nothing is covered because it was planned: only poses that the simulated nozzle had count, and only while it lay flat
on the floor and in contact with it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import mujoco
import numpy as np

from tutorialbot.scene import control, omni
from tutorialbot.scene.room import ACCELERATION, ARM, MOVING, SPEED, WHEEL_RATE, WHEELS, Room, assemble, place

PERIOD = 0.02  # of the outer loop [s]
TIMESTEP = 0.002  # [s]
NOTICED = 0.05  # clearances up to this [m] are measured
CALM = 0.6  # share of the joints' accelerations that is used
PRESSED = 6.0  # how hard the nozzle is pressed against the floor [N]
STILL = 0.02  # below about this speed [m/s] its friction is not counted on
FLAT = 0.003  # the nozzle's underside must nowhere be higher than this [m] to count as on the floor
RECORD = 5  # every this many periods the state is kept for the film


@dataclass
class Recording:
    """What happened. times (n,) [s]; nozzle (n, 3): x, y [m], yaw [rad]; base (n, 3); on_floor (n,): flat and touching;
    clearance: the least so far [m], NOTICED when nothing came nearer, and between which geoms; film: times and qpos.
    """

    times: list[float] = field(default_factory=list)
    nozzle: list[tuple[float, float, float]] = field(default_factory=list)
    base: list[tuple[float, float, float]] = field(default_factory=list)
    touching: list[bool] = field(default_factory=list)
    on_floor: list[bool] = field(default_factory=list)
    clearance: float = NOTICED
    nearest: tuple[str, str] = ("", "")
    film_times: list[float] = field(default_factory=list)
    film: list[np.ndarray] = field(default_factory=list)


class CleaningSimulation:
    """A room, the robot in it with the vacuum cleaner in its hand, and a recording of all that it does."""

    def __init__(self, room: Room, base: np.ndarray, arm: np.ndarray):
        self.model, self._lead = assemble(room, timestep=TIMESTEP, seen=False)
        self.data = mujoco.MjData(self.model)
        model = self.model
        model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC  # a pyramid's friction would push the nozzle aside
        of_room = np.array([model.body(body).name.startswith("room/") or body == 0 for body in model.geom_bodyid])
        solid = of_room & (model.geom_contype & 2 > 0)
        model.geom_gap[solid] = NOTICED  # noticed from afar, felt only when it touches
        self._of_room = solid
        self._floor, self._nozzle = model.geom("room/floor").id, model.geom("vacuum/nozzle").id
        self._wheels = np.array([model.actuator(f"wheel_{i}").id for i in range(1, 5)])
        self._qpos = np.array([model.joint(name).qposadr[0] for name in MOVING])
        self._ctrl = np.array([model.actuator(name).id for name in MOVING])
        self._integrals = np.array([model.actuator(name).actadr[0] for name in ARM])
        self._friction = float(model.geom_friction[self._nozzle, 0])
        half = model.geom_size[self._nozzle]
        self._corners = half * [[i, j, -1] for i in (-1, 1) for j in (-1, 1)]
        model.body_gravcomp[model.body("vacuum/vacuum").id] = 1.0  # the controllers know what the tool weighs
        self._dofs = np.array([model.joint(name).dofadr[0] for name in MOVING])
        self._tool, self._velocity = model.body("vacuum/nozzle").id, np.zeros(len(MOVING))
        self._inertia, self._jacobian = np.empty((model.nv, model.nv)), np.empty((3, model.nv))
        place(model, self.data, base, arm)
        self.reference = self.data.qpos[self._qpos].copy()
        self.record = Recording()

    def follow(self, references: Iterable[np.ndarray], *, press: bool = False) -> None:
        """Follow references (10,) for MOVING, one a period (see `paced`); `press` the nozzle against the floor or not.

        The controllers' integrals stay empty: what there is to bear is known beforehand, and against the floor they
        would only wind up. While it presses, a contact in any step of a period counts, else in the last.
        """
        steps = round(PERIOD / TIMESTEP)
        for reference in references:
            before, self.reference = self.reference, reference
            velocity = (reference - before) / PERIOD
            self._roll(before[2], velocity[:3])
            lead = self._lead * velocity
            self._feed_forward((velocity - self._velocity) / PERIOD, PRESSED if press else 0.0)
            self._velocity = velocity
            touched = False
            for step in range(1, steps + 1):
                self.data.ctrl[self._ctrl] = before + step / steps * (reference - before) + lead
                mujoco.mj_step(self.model, self.data)
                self.data.act[self._integrals] = 0.0
                touched = touched or ((press or step == steps) and self._touching())
            self._look(touched)

    def _feed_forward(self, acceleration: np.ndarray, press: float) -> None:
        """Give the motors what is known beforehand, the computed torque: M a for the reference's acceleration (10,),
        centrifugal forces, the weight of the nozzle, which hangs on hinges of its own, and J^T f with the force f that
        presses the nozzle down and overcomes its friction.
        """
        data = self.data
        mujoco.mj_fullM(self.model, data, self._inertia)
        torque = self._inertia[np.ix_(self._dofs, self._dofs)] @ acceleration
        torque += (data.qfrc_bias - data.qfrc_gravcomp)[self._dofs]
        if press:
            mujoco.mj_jacBody(self.model, data, self._jacobian, None, self._tool)
            x, y, _ = self._jacobian @ data.qvel
            drag = self._friction / (np.hypot(x, y) + STILL)
            torque += press * np.array([drag * x, drag * y, -1.0]) @ self._jacobian[:, self._dofs]
        data.qfrc_applied[self._dofs] = torque

    def _roll(self, yaw: float, velocity: np.ndarray) -> None:
        """Turn the omni wheels as the base's velocity (3,) in the room asks."""
        x, y, turn = velocity
        cosine, sine = np.cos(yaw), np.sin(yaw)
        twist = np.array([cosine * x + sine * y, cosine * y - sine * x, turn])
        self.data.ctrl[self._wheels] = omni.jacobian(WHEELS) @ twist

    def _touching(self) -> bool:
        """Whether nozzle and floor touch now."""
        contact = self.data.contact
        pair = contact.geom == (self._floor, self._nozzle)
        return bool((pair.all(axis=1) & (contact.dist <= 0.0)).any())

    def _look(self, touching: bool) -> None:
        """Write down where the nozzle is, whether it lies on the floor, and what came near."""
        data, record = self.data, self.record
        contacts = data.contact
        pairs, distances = contacts.geom, contacts.dist
        for (a, b), distance in zip(pairs.tolist(), distances.tolist(), strict=True):
            if self._floor not in (a, b) and (self._of_room[a] or self._of_room[b]) and distance < record.clearance:
                record.clearance = distance
                record.nearest = (self.model.geom(a).name or self._body(a), self.model.geom(b).name or self._body(b))
        turn = data.geom_xmat[self._nozzle].reshape(3, 3)
        place = data.geom_xpos[self._nozzle]
        flat = (place[2] + self._corners @ turn[2]).max() < FLAT
        record.times.append(data.time)
        record.nozzle.append((place[0], place[1], float(np.arctan2(turn[1, 0], turn[0, 0]))))
        record.base.append(tuple(data.qpos[self._qpos[:3]]))
        record.touching.append(touching)
        record.on_floor.append(bool(touching and flat))
        if len(record.times) % RECORD == 1:
            record.film_times.append(data.time)
            record.film.append(data.qpos.copy())

    def _body(self, geom: int) -> str:
        return self.model.body(self.model.geom_bodyid[geom]).name

    @property
    def failed(self) -> bool:
        """Whether MuJoCo warned or left the finite numbers."""
        return bool(self.data.warning.number.any() or not np.isfinite(self.data.qpos).all())


def paced(samples: np.ndarray, speed: float) -> np.ndarray:
    """Return references (n, 10), one a period, along samples (m, 10) that stand evenly on the way, from rest to rest.

    One trapezoid for the whole way keeps all joints in step, so that straight lines stay straight. It is as fast as the
    joint that is slowest to go its part allows (SPEED, ACCELERATION, the wheels' WHEEL_RATE), at most `speed` [1/s].
    """
    slope = np.abs(np.diff(samples, axis=0)).max(axis=0) * (len(samples) - 1)
    with np.errstate(divide="ignore"):
        speed, brake = min(speed, (SPEED / slope).min()), (CALM * ACCELERATION / slope).min()
    wheels = np.abs(omni.jacobian(WHEELS)).max(axis=0) @ slope[:3]
    speed = min(speed, WHEEL_RATE / wheels) if wheels > 0.0 else speed
    if not np.isfinite(speed) or slope.max() < 1e-9:
        return samples[-1:]
    share, velocity, shares = np.zeros(1), np.zeros(1), []
    while not shares or shares[-1] < 1.0 - 1e-9:
        share, velocity = control.trapezoid_step(share, velocity, np.ones(1), speed, brake, PERIOD)
        shares.append(float(share[0]))
    at = np.linspace(0.0, 1.0, len(samples))
    return np.stack([np.interp(shares, at, column) for column in samples.T], axis=1)
