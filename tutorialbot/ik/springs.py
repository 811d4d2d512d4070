"""Virtual springs between frames of a robot and where they shall be: errors, energy, force and stiffness.

The physics under `prioritized`, which says what it is for; J is a frame's Jacobian in the frame's own axes throughout.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, one_of, whole_number
from tutorialbot.pose import check_pose


@dataclass(frozen=True)
class Task:
    """A frame of the robot and the pose it shall have.

    frame: name or index in the pinocchio model; target: in the world's frame; position_weight k_p [N/m] and
    rotation_weight k_r [Nm/rad], of which one may be zero: then that part is free.
    """

    frame: str | int
    target: pin.SE3
    position_weight: float = 1.0
    rotation_weight: float = 0.1

    def __post_init__(self):
        check_pose("target", self.target)
        total = sum(finite_number(name, getattr(self, name), 0.0) for name in ("position_weight", "rotation_weight"))
        if total == 0.0:
            raise InvalidValue("position_weight, rotation_weight", (0, 0), "at least one above zero")


@dataclass
class Problem:
    """What stays the same over the iterations; made by `problem`. springs: (frame index, target, k_p, k_r)."""

    model: pin.Model
    springs: list[tuple[int, pin.SE3, float, float]]
    posture: np.ndarray
    weights: np.ndarray
    data: pin.Data
    low: np.ndarray = field(init=False)
    high: np.ndarray = field(init=False)
    hand: np.ndarray = field(init=False)  # (tasks, 6) k_p, k_p, k_p, k_r, k_r, k_r of each spring
    upper: np.ndarray = field(init=False)  # (nv, nv) True where row <= column

    def __post_init__(self):
        self.low, self.high = self.model.lowerPositionLimit, self.model.upperPositionLimit
        self.hand = np.array([[k_p] * 3 + [k_r] * 3 for _, _, k_p, k_r in self.springs])
        self.upper = ~np.tri(self.model.nv, k=-1, dtype=bool)


def check_model(model: pin.Model) -> pin.Model:
    """Return `model` when it is a pinocchio model whose joints have one number each, or raise."""
    if not isinstance(model, pin.Model):
        raise InvalidType("model", model, "a pinocchio.Model")
    if model.nq != model.nv:
        raise InvalidValue("model", model.name, "joints that have one number each (no quaternions)")
    return model


def problem(
    model: pin.Model, tasks: Task | Sequence[Task], posture: np.ndarray, posture_weights: np.ndarray | None = None,
    data: pin.Data | None = None,
) -> Problem:
    """Check the arguments once and gather them for `step`. posture, posture_weights (nv,): rest and w of the joints.

    Raises InvalidType or InvalidValue for anything that does not fit the model. `data` spares pinocchio's work space.
    """
    check_model(model)
    springs = []
    if not isinstance(tasks, Task | list | tuple):
        raise InvalidType("tasks", tasks, "a Task or several")
    if data is not None and not isinstance(data, pin.Data):
        raise InvalidType("data", data, "a pinocchio.Data, made by this model's createData()")
    for task in [tasks] if isinstance(tasks, Task) else tasks:
        if not isinstance(task, Task):
            raise InvalidType("tasks", task, "a Task or several")
        springs.append((_frame_index(model, task.frame), task.target, task.position_weight, task.rotation_weight))
    if not springs:
        raise InvalidValue("tasks", tasks, "at least one Task")
    weights = np.ones(model.nv) if posture_weights is None else finite_array("posture_weights", posture_weights, (-1,))
    if weights.shape != (model.nv,) or (weights <= 0).any():
        raise InvalidValue("posture_weights", weights, f"{model.nv} numbers above zero")
    posture = finite_array("posture", posture, (model.nv,))
    return Problem(model, springs, posture, weights, model.createData() if data is None else data)


def errors_at(this: Problem, q: np.ndarray) -> np.ndarray:
    """(tasks, 6): e_p [m] and e_r [rad] of each spring, in the axes of its frame."""
    pin.forwardKinematics(this.model, this.data, q)
    found = np.empty((len(this.springs), 6))
    for row, (frame, target, _, _) in zip(found, this.springs, strict=True):
        here = pin.updateFramePlacement(this.model, this.data, frame)
        apart = here.actInv(target)
        row[:3], row[3:] = apart.translation, pin.log3(apart.rotation)
    return found


def worst(this: Problem, errors: np.ndarray) -> tuple[float, float]:
    """Largest |e_p| [m] and |e_r| [rad] over the springs that are there."""
    position = rotation = 0.0
    for (_, _, k_p, k_r), e in zip(this.springs, errors, strict=True):
        position = max(position, math.sqrt(e[:3] @ e[:3])) if k_p else position
        rotation = max(rotation, math.sqrt(e[3:] @ e[3:])) if k_r else rotation
    return position, rotation


def energy_at(this: Problem, errors: np.ndarray, away: np.ndarray, eps: float) -> float:
    """Energy V of the targets' springs and, `away` (nv,) from the posture, of the joints'."""
    return 0.5 * (np.vdot(this.hand * errors, errors) + eps * ((this.weights * away) @ away))


def force_and_stiffness(this: Problem, q: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force (nv,) of the targets' springs on the joints, and their stiffness (nv, nv), posture left out.

    Seen from the world, the columns of J = (J_v, J_w) obey dJ_v[j]/dq_i = J_w[i] x J_v[j] for joint i before joint j
    (and half of J_w[i] x J_w[j] for the turns), which gives, in any axes,

        H_ij = J_i^T W J_j + J_w[i]^T (k_p [e_p]x J_v[j] + k_r/2 [e_r]x J_w[j])      for i <= j

    with W = k_p for the position and k_r (c 1 + (1 - c) u u^T), c = (t/2) / tan(t/2), for a rotation by t about u.
    """
    pin.computeJointJacobians(this.model, this.data, q)
    force = stiffness = 0.0
    for (frame, _, k_p, k_r), e in zip(this.springs, errors, strict=True):
        jacobian = pin.getFrameJacobian(this.model, this.data, frame, pin.LOCAL)
        x, y, z, a, b, c = e.tolist()
        angle = math.sqrt(a * a + b * b + c * c)
        half = 0.5 * angle
        curve = half / math.tan(half) if angle > 1e-6 else 1.0
        bent = k_r * (1.0 - curve) / angle**2 if angle > 1e-6 else 0.0
        x, y, z, p, stiff = k_p * x, k_p * y, k_p * z, 0.5 * k_r, k_r * curve
        metric = np.array([
            [k_p, 0, 0, 0, 0, 0],
            [0, k_p, 0, 0, 0, 0],
            [0, 0, k_p, 0, 0, 0],
            [0, 0, 0, stiff + bent * a * a, bent * a * b, bent * a * c],
            [0, 0, 0, bent * a * b, stiff + bent * b * b, bent * b * c],
            [0, 0, 0, bent * a * c, bent * b * c, stiff + bent * c * c],
            [0, -z, y, 0, -p * c, p * b],
            [z, 0, -x, p * c, 0, -p * a],
            [-y, x, 0, -p * b, p * a, 0],
        ]) @ jacobian
        swing = jacobian[3:].T @ metric[6:]
        force = force + np.array([x, y, z, k_r * a, k_r * b, k_r * c]) @ jacobian
        stiffness = stiffness + jacobian.T @ metric[:6] + np.where(this.upper, swing, swing.T)
    return force, stiffness


def _frame_index(model: pin.Model, frame: str | int) -> int:
    if isinstance(frame, str):
        if not model.existFrame(frame):
            one_of("frame", frame, [known.name for known in model.frames])
        return model.getFrameId(frame)
    if whole_number("frame", frame) >= model.nframes:
        raise InvalidValue("frame", frame, f"an index below {model.nframes}")
    return frame
