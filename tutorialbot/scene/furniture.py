"""Furniture of a room: what stands where, which places on the floor it takes, and its geoms."""

from dataclasses import dataclass

import mujoco
import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, finite_number, one_of
from tutorialbot.scene.furniture_kinds import KINDS, Part

SMALLEST, LARGEST = 0.02, 6.0  # of length, width and height [m]
ROUNDNESS = {"cushion": 0.4, "mattress": 0.12}  # exponents of superellipsoids: 0 is a box, 1 an egg
SHAPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "egg": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
}


@dataclass(frozen=True)
class Furniture:
    """One piece: its kind, a name, where its middle stands [m] and how it is turned [rad]; None: its kind's usual size.

    `length`, `width` and `height` [m] are along its own x, y and z. Raises InvalidValue or InvalidType.
    """

    kind: str
    name: str
    x: float
    y: float
    yaw: float = 0.0
    length: float | None = None
    width: float | None = None
    height: float | None = None

    def __post_init__(self):
        one_of("kind", self.kind, KINDS)
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidType("name", self.name, "a name such as 'table'")
        if self.name == "world":
            raise InvalidValue("name", self.name, "another name: MuJoCo's root is called so")
        for name in ("x", "y", "yaw"):
            finite_number(name, getattr(self, name))
        for name, usual in zip(("length", "width", "height"), KINDS[self.kind][0], strict=True):
            if getattr(self, name) is None:
                object.__setattr__(self, name, usual)
            finite_number(name, getattr(self, name), 0.004 if self.kind == "carpet" else SMALLEST, LARGEST)

    @property
    def parts(self) -> list[Part]:
        """Its parts, in its own frame."""
        return KINDS[self.kind][1](self.length, self.width, self.height)

    @property
    def footprint(self) -> np.ndarray:
        """Corners (4, 2) [m] of the rectangle on the floor that it takes, counterclockwise, in the room's frame."""
        return self.placed(0.5 * np.array([self.length, self.width]) * [[-1, -1], [1, -1], [1, 1], [-1, 1]])

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Return points (n, 2) [m] of its own frame in the room's."""
        cosine, sine = np.cos(self.yaw), np.sin(self.yaw)
        return points @ np.array([[cosine, sine], [-sine, cosine]]) + [self.x, self.y]

    def solids(self, low: float, high: float) -> list[np.ndarray]:
        """Return outlines (k, 2) [m] in the room of its solid parts that reach into the heights low..high [m].

        A cylinder gives a polygon of 16 corners around it.
        """
        found = []
        for part in self.parts:
            if part.solid and part.centre[2] - part.half[2] < high and part.centre[2] + part.half[2] > low:
                found.append(self.placed(_outline(part)))
        return found


def _outline(part: Part) -> np.ndarray:
    middle = np.array(part.centre[:2])
    if part.shape == "cylinder":
        angle = 2 * np.pi * np.arange(16) / 16
        return middle + part.half[0] / np.cos(np.pi / 16) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return middle + np.array(part.half[:2]) * [[-1, -1], [1, -1], [1, 1], [-1, 1]]


def add(spec: mujoco.MjSpec, piece: Furniture, seen: dict | None, solid: dict) -> None:
    """Put `piece` into `spec` as a body of its name; the spec has the materials COLOURS.

    `seen` (None: not drawn) and `solid` are the attributes of the geoms to look at and of those that stop the robot.
    """
    body = spec.worldbody.add_body(name=piece.name, pos=[piece.x, piece.y, 0])
    body.quat = [np.cos(piece.yaw / 2), 0, 0, np.sin(piece.yaw / 2)]
    for number, part in enumerate(piece.parts):
        if not (part.solid or seen and part.material):
            continue
        place = {"pos": part.centre}
        if part.shape in ROUNDNESS:
            mesh = spec.add_mesh(name=f"{piece.name}_{number}")
            mesh.make_supersphere(resolution=14, e=ROUNDNESS[part.shape], n=ROUNDNESS[part.shape])
            mesh.scale = part.half
            place |= {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": mesh.name}
        elif part.shape == "cylinder":
            place |= {"type": SHAPES["cylinder"], "size": [part.half[0], part.half[2], 0]}
        else:
            place |= {"type": SHAPES[part.shape], "size": part.half}
        if seen and part.material:
            body.add_geom(**place, **seen, material=part.material)
        if part.solid:
            body.add_geom(**place, **solid)
