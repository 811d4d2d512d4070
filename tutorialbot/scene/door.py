"""The doors of paper 1 (section 3, Fig. 2): one dataclass, one MJCF; or any other MJCF by naming its joints.

Frames: z points up, the hinge axis is vertical through the origin, the closed panel lies in the y-z plane, and the
robot stands at x < 0. A positive hinge angle opens the door toward the robot, (0, pi); the lever turns within (-pi/4,
0), and a negative angle lowers its free end.
"""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from tutorialbot import paths
from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue, finite_number, one_of
from tutorialbot.scene.closing_door import ClosingDoor as ClosingDoor  # the door of paper 4: both under one name

LEVER_LOW = -np.pi / 4  # paper 1, section 3
BAR_END = 0.022  # how far the lever is seen to go on beyond the grip [m]
BOLT_THROW = 0.012  # how far the bolt reaches behind the strike plate [m]
LIMITS = {  # of `Door`: from the smallest to the largest that is still a door, in the units named there
    "spindle_radius": (0.1, 2.0), "lever_length": (0.02, 0.5), "stand_off": (0.02, 0.3), "edge": (0.01, 0.5),
    "handle_height": (0.1, 3.0), "panel_height": (0.1, 4.0), "panel_thickness": (0.005, 0.3), "mass": (0.5, 500.0),
    "hinge_damping": (0.0, 100.0), "hinge_friction": (0.0, 100.0), "lever_stiffness": (0.0, 50.0),
    "lever_preload": (0.0, np.pi), "lever_damping": (0.0, 5.0), "lever_friction": (0.0, 5.0),
    "release_angle": (LEVER_LOW, 0.0), "engage_angle": (LEVER_LOW, 0.0),
}  # fmt: skip


@dataclass(frozen=True)
class DoorFile:
    """A door in an MJCF file that is not ours, and what its parts are called.

    `handle` is the joint that must turn before the latch lets go (None: there is none, as on a valve or a sliding
    door); `latch` is an equality constraint that holds the door and that the handle switches off (None: no such
    constraint).
    """

    path: Path
    hinge: str
    handle: str | None
    grip: str
    latch: str | None


@dataclass(frozen=True)
class Door:
    """A hinged door with a lever handle. Lengths in m, angles in rad, torques in Nm, masses in kg.

    `latch="equality"` holds the hinge by a constraint that is switched off when the lever passes `release_angle` and on
    again when the lever is back above `engage_angle` with the door shut. `latch="bolt"` is a rigid bolt behind a strike
    plate, coupled to the lever. `side` is where the hinge is as the robot sees it.

    Raises InvalidValue or InvalidType when a number is not finite, outside LIMITS, or out of proportion.
    """

    spindle_radius: float = 0.42  # hinge axis to lever spindle
    lever_length: float = 0.12
    stand_off: float = 0.07  # panel surface to lever axis
    edge: float = 0.06  # lever spindle to free edge
    handle_height: float = 1.0
    panel_height: float = 0.5  # reduced, as in the paper
    panel_thickness: float = 0.04
    mass: float = 12.0
    hinge_damping: float = 1.0
    hinge_friction: float = 0.2
    lever_stiffness: float = 1.0
    lever_preload: float = 0.4  # angle by which the return spring is wound when the lever is at rest
    lever_damping: float = 0.03
    lever_friction: float = 0.03
    release_angle: float = np.deg2rad(-35.0)
    engage_angle: float = np.deg2rad(-28.0)
    latch: str = "equality"
    side: str = "right"
    file: DoorFile | None = None

    def __post_init__(self):
        for name, (low, high) in LIMITS.items():
            finite_number(name, getattr(self, name), low, high)
        one_of("latch", self.latch, ("equality", "bolt"))
        one_of("side", self.side, ("right", "left"))
        if self.file is not None and not isinstance(self.file, DoorFile):
            raise InvalidType("file", self.file, "a DoorFile (Door.from_mjcf makes one)")
        if self.lever_length >= self.spindle_radius:
            raise InvalidValue(
                "lever_length",
                self.lever_length,
                f"less than spindle_radius = {self.spindle_radius}: the lever must end on the door",
            )
        if self.panel_height > 2.0 * self.handle_height:
            raise InvalidValue(
                "panel_height", self.panel_height, f"at most twice handle_height = {self.handle_height}: it hangs free"
            )
        if self.release_angle >= self.engage_angle:
            raise InvalidValue(
                "release_angle", self.release_angle, f"less than engage_angle = {self.engage_angle:g} (hysteresis)"
            )

    @classmethod
    def from_mjcf(
        cls,
        path: str | Path,
        *,
        hinge: str,
        grip: str,
        handle: str | None = None,
        latch: str | None = None,
        release_angle: float = np.deg2rad(-35.0),
        engage_angle: float = np.deg2rad(-28.0),
    ) -> "Door":
        """Return a door from any MJCF file: `hinge` and `handle` name joints, `grip` a site (x forward, z up), `latch`
        an equality.

        The hinge must open in its positive direction, the handle turn in its negative one. Raises BrokenFile when the
        file cannot be read or compiled, and InvalidValue when it holds no element of a given name.
        """
        if not isinstance(path, str | Path):
            raise InvalidType("path", path, "the path of an MJCF file")
        for argument, name in {"hinge": hinge, "grip": grip, "handle": handle, "latch": latch}.items():
            if not isinstance(name, str) and not (name is None and argument in ("handle", "latch")):
                raise InvalidType(argument, name, f"a name in {path}")
        door = cls(
            release_angle=release_angle,
            engage_angle=engage_angle,
            file=DoorFile(Path(path), hinge, handle, grip, latch),
        )
        model = door.model()
        kinds = {
            "hinge": (mujoco.mjtObj.mjOBJ_JOINT, hinge),
            "handle": (mujoco.mjtObj.mjOBJ_JOINT, handle),
            "grip": (mujoco.mjtObj.mjOBJ_SITE, grip),
            "latch": (mujoco.mjtObj.mjOBJ_EQUALITY, latch),
        }
        for argument, (kind, name) in kinds.items():
            if name is not None and mujoco.mj_name2id(model, kind, name) < 0:
                there = [mujoco.mj_id2name(model, kind, i) for i in range(_count(model, kind))]
                raise InvalidValue(
                    argument, name, f"a name in {path}: {', '.join(filter(None, there)) or 'none there'}"
                )
        if handle == hinge:
            raise InvalidValue("handle", handle, f"another joint than the hinge, or None, in {path}")
        for argument, name in (("hinge", hinge), ("handle", handle)):
            if name is not None and model.joint(name).type[0] < int(mujoco.mjtJoint.mjJNT_SLIDE):
                raise InvalidValue(argument, name, "a joint of type hinge or slide: one number says where it stands")
        return door

    @property
    def names(self) -> DoorFile:
        """What the parts are called in `spec()`."""
        return self.file or DoorFile(
            paths.MODELS / "door" / "door.xml", "hinge", "lever", "grip", "latch" if self.latch == "equality" else None
        )

    def spec(self) -> mujoco.MjSpec:
        """Return an editable model of this door; raises BrokenFile when its MJCF file is missing or damaged."""
        path = self.names.path
        if not path.is_file():
            raise BrokenFile(f"{path}: no such MJCF file")
        try:
            spec = mujoco.MjSpec.from_file(str(path))
        except ValueError as error:
            raise BrokenFile(f"{path}: not a valid MJCF file: {error}") from None
        if self.file is None:
            _shape(spec, self)
            if self.latch == "bolt":
                _use_bolt(spec, self)
        return spec

    def model(self) -> mujoco.MjModel:
        """Return the compiled door alone; raises BrokenFile when it does not compile."""
        spec = self.spec()
        try:
            return spec.compile()
        except ValueError as error:
            raise BrokenFile(f"{self.names.path}: does not compile: {error}") from None


def _count(model: mujoco.MjModel, kind: mujoco.mjtObj) -> int:
    return {
        mujoco.mjtObj.mjOBJ_JOINT: model.njnt,
        mujoco.mjtObj.mjOBJ_SITE: model.nsite,
        mujoco.mjtObj.mjOBJ_EQUALITY: model.neq,
    }[kind]


def _linear(coefficient: float) -> list[float]:
    """A linear coefficient as the polynomial that MuJoCo keeps for a spring or damper."""
    return [coefficient, 0.0, 0.0]


def _shape(spec: mujoco.MjSpec, door: Door) -> None:
    """Write the sizes and stiffnesses of `door` into our own MJCF."""
    sign = 1.0 if door.side == "right" else -1.0  # the spindle is at y = sign * spindle_radius
    half = np.array([door.panel_thickness, door.spindle_radius + door.edge, door.panel_height]) / 2
    middle = np.array([half[0], sign * half[1], door.handle_height])
    for name in ("panel", "panel_seen"):
        spec.geom(name).size, spec.geom(name).pos = half, middle
    spec.geom("panel").mass = door.mass
    spec.geom("rosette").pos = [-0.006, sign * door.spindle_radius, door.handle_height]
    top = door.handle_height + half[2] + 0.03
    for name, y in (("post_hinge", -0.030), ("post_lock", 2 * half[1] + 0.030)):  # no lintel: the robot stays in view
        spec.geom(name).size, spec.geom(name).pos = [0.035, 0.022, top / 2], [half[0], sign * y, top / 2]
    spec.geom("sill").size, spec.geom("sill").pos = [0.09, half[1] + 0.09, 0.006], [half[0], sign * half[1], 0.006]
    for name, share in (("knuckle_low", -0.7), ("knuckle_high", 0.7)):
        spec.geom(name).pos = [0, 0, door.handle_height + share * half[2]]
    margin = np.array([-0.002, 0.055, 0.055])  # the inlay stands out of the panel's faces
    spec.geom("inlay").size, spec.geom("inlay").pos = np.maximum(half - margin, half / 2), middle

    hinge, lever = spec.joint("hinge"), spec.joint("lever")
    hinge.axis = [0, 0, sign]
    hinge.damping, hinge.frictionloss = _linear(door.hinge_damping), door.hinge_friction
    lever.axis = [-sign, 0, 0]
    lever.stiffness, lever.springref = _linear(door.lever_stiffness), door.lever_preload
    lever.damping, lever.frictionloss, lever.armature = _linear(door.lever_damping), door.lever_friction, 0.002

    spec.body("handle").pos = [0, sign * door.spindle_radius, door.handle_height]
    tip = [-door.stand_off, -sign * door.lever_length, 0]
    spindle, bar = spec.geom("spindle"), spec.geom("bar")
    spindle.fromto, spindle.size = [0, 0, 0, -door.stand_off, 0, 0], [0.011, 0, 0]
    bar.fromto, bar.size = [-door.stand_off, 0, 0, *tip], [0.010, 0, 0]
    spindle.mass, bar.mass = 0.15, 0.15
    end = spec.geom("bar_end")  # what sticks out of the hand
    end.fromto, end.size = [*tip, tip[0], tip[1] - sign * BAR_END, 0], bar.size
    spec.site("grip").pos = tip


def _use_bolt(spec: mujoco.MjSpec, door: Door) -> None:
    """Replace the switched equality by a bolt that the lever draws back from behind a strike plate."""
    sign = 1.0 if door.side == "right" else -1.0
    spec.delete(spec.equality("latch"))
    edge = sign * (door.spindle_radius + door.edge)
    bolt = spec.body("panel").add_body(name="bolt", pos=[door.panel_thickness / 2, edge, door.handle_height])
    bolt.add_joint(
        name="bolt",
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0, sign, 0],
        range=[-1.5 * BOLT_THROW, 0],
        limited=True,
        damping=_linear(2.0),
    )
    solid = {
        "type": mujoco.mjtGeom.mjGEOM_BOX,
        "contype": 4,
        "conaffinity": 4,
        "group": 2,
        "condim": 1,
        "solref": [0.004, 1],
        "solimp": [0.99, 0.999, 0.0005, 0.5, 2],
    }
    bolt.add_geom(name="bolt", size=[0.008, 0.03, 0.015], pos=[0, sign * (BOLT_THROW - 0.03), 0], mass=0.1, **solid)
    gap = 0.003
    spec.worldbody.add_geom(
        name="strike",
        size=[0.006, 0.02, 0.03],
        mass=0,
        pos=[door.panel_thickness / 2 - 0.0145, edge + sign * (0.02 + gap), door.handle_height],
        **solid,
    )
    # The bolt clears the plate when the lever is at the release angle.
    ratio = (BOLT_THROW - gap) / -door.release_angle
    spec.add_equality(
        name="draw",
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1="bolt",
        name2="lever",
        solref=[0.004, 1],
        solimp=[0.99, 0.9999, 0.0001, 0.5, 2],
        data=[0, ratio] + 10 * [0],
    )
