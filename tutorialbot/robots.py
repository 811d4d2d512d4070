"""Load a robot of `models/` by name, as the library's own object: `mujoco.MjModel` or `pinocchio.Model`."""

from collections.abc import Sequence
from pathlib import Path

import mujoco
import pinocchio as pin

from tutorialbot.errors import BrokenFile, InvalidValue, one_of
from tutorialbot.paths import MODELS

BASE = ("base_x", "base_y", "base_yaw")
ARM = ("arm_1", "arm_2", "arm_3", "arm_4", "arm_5", "arm_6")


def names() -> list[str]:
    """Names of the robots that `load` knows: the folders of `models/` that hold a robot.xml."""
    return sorted(path.parent.name for path in MODELS.glob("*/robot.xml"))


def load(name: str) -> mujoco.MjModel:
    """Return the MuJoCo model of robot `name`; raise InvalidValue for an unknown name, BrokenFile for a bad file."""
    return _mujoco_model(_file(name))


def load_pinocchio(name: str, joints: Sequence[str] | None = None) -> pin.Model:
    """Return the pinocchio model of robot `name`, its other joints than `joints` locked at zero; None keeps all.

    `joints` are the names in the robot.xml, in any order; the model keeps the file's order, and so does q. Every site
    of the file is a frame. pinocchio makes one joint of a body's several (the three of the base), so those stay or go
    together. Raises InvalidValue for an unknown name, BrokenFile for a bad file.
    """
    file = _file(name)
    members = _joints_of_bodies(_mujoco_model(file))
    try:
        model = pin.buildModelFromMJCF(str(file))
    except (RuntimeError, ValueError) as error:
        raise BrokenFile(f"{file}: pinocchio cannot read it: {error}") from error
    if joints is None:
        return model
    known = [joint for group in members.values() for joint in group]
    keep = {one_of("joints", joint, known) for joint in joints}
    for group in members.values():
        if 0 < len(keep.intersection(group)) < len(group):
            raise InvalidValue("joints", list(joints), f"all or none of {', '.join(group)}: they move one body")
    locked = [model.getJointId(joint) for joint, group in members.items() if keep.isdisjoint(group)]
    return pin.buildReducedModel(model, locked, pin.neutral(model))


def _file(name: str) -> Path:
    return MODELS / one_of("name", name, names()) / "robot.xml"


def _mujoco_model(file: Path) -> mujoco.MjModel:
    try:
        return mujoco.MjModel.from_xml_path(str(file))
    except ValueError as error:
        raise BrokenFile(f"{file}: MuJoCo cannot read it: {error}") from error


def _joints_of_bodies(model: mujoco.MjModel) -> dict[str, list[str]]:
    """Pinocchio's name of the joint that moves each body -> MuJoCo's names of the joints which it is made of."""
    found = {}
    for body in range(model.nbody):
        first, count = model.body_jntadr[body], model.body_jntnum[body]
        group = [model.joint(first + i).name for i in range(count)]
        if group:
            found[group[0] if count == 1 else f"Composite_{group[0]}"] = group
    return found
