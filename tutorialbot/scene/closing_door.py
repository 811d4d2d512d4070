"""The door of paper 4 (section 4): a hinged door that a closer shuts, in a frame in a wall; knob on a vertical pivot.

Frames: z points up, the hinge axis is vertical through the origin. The closed panel lies along +x, x = 0..width, and
its thickness is centred on y = 0. The robot stands at y < 0 and pulls the door toward itself: the angle theta >= 0
opens it, and the panel's frame turns with it about the hinge,

    along (cos theta, -sin theta, 0)    across (sin theta, cos theta, 0)    up (0, 0, 1),

so the robot's side of the panel faces -across. The wall is flush with the panel on the robot's side and goes on toward
+y, so that the door can open a little beyond 90 degrees before it meets its jamb. The opening is `gap` wider than the
panel, half on each side.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from tutorialbot import paths
from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue, finite_array, finite_number
from tutorialbot.seeding import make_rng

LIMITS = {  # of `ClosingDoor`: from the smallest to the largest that is still a door, in the units named there
    "width": (0.3, 2.0), "thickness": (0.01, 0.1), "height": (1.0, 3.0), "knob_from_edge": (0.02, 0.3),
    "knob_stand_off": (0.03, 0.2), "knob_height": (0.3, 1.8), "gap": (0.02, 0.3), "wall_thickness": (0.05, 0.5),
    "mass": (1.0, 200.0), "closer_torque": (0.0, 60.0), "closer_stiffness": (0.0, 60.0), "hold_angle": (0.2, 2.2),
    "open_limit": (0.5, 2.5), "hinge_damping": (0.0, 100.0), "hinge_friction": (0.0, 50.0),
}  # fmt: skip
RANGES = {  # of the random doors
    "width": (0.80, 1.00), "knob_from_edge": (0.05, 0.09), "closer_torque": (4.0, 12.0),
    "hold_angle": (np.deg2rad(75.0), np.deg2rad(95.0)),
}  # fmt: skip
FRAME_NAMES = ("jamb_hinge", "jamb_lock", "lintel", "wall_hinge", "wall_lock", "wall_above")
FLOOR_GAP = 0.01  # under the panel [m]
KNOB_MASS = 0.2  # [kg]
GRIP_RADIUS, GRIP_HALF = 0.014, 0.045  # of the knob's upright bar, which the gripper takes [m]
CASING = (0.06, 0.008)  # of the frame: how wide it is seen beside the opening, how far it stands out of the wall [m]
WALL_BESIDE, WALL_ABOVE = (0.7, 1.1), 0.2  # how far the wall goes on at the hinge, at the lock, above the door [m]


CLOSER_PIVOT, CLOSER_ARM = (0.10, 0.034), 0.26  # along the lintel and before the wall; length of the arm [m]


@dataclass(frozen=True)
class ClosingDoor:
    """A door with a closer. Lengths in m, angles in rad, torques in Nm, masses in kg; frames as in the module's text.

    `knob_from_edge` is from the free edge to the knob's pivot, `knob_stand_off` from the panel's surface to it. The
    closer shuts the door by closer_torque + closer_stiffness * theta while theta < hold_angle, and not at all beyond:
    there the door stays where it is left. The door stops at 0 and at `open_limit`.

    Raises InvalidValue or InvalidType when a number is not finite, outside LIMITS, or out of proportion.
    """

    width: float = 0.85
    thickness: float = 0.04
    height: float = 2.0
    knob_from_edge: float = 0.07
    knob_stand_off: float = 0.06
    knob_height: float = 1.0
    gap: float = 0.05
    wall_thickness: float = 0.14
    mass: float = 20.0
    closer_torque: float = 8.0
    closer_stiffness: float = 6.0
    hold_angle: float = np.deg2rad(85.0)
    open_limit: float = np.deg2rad(98.0)
    hinge_damping: float = 3.0
    hinge_friction: float = 0.3

    def __post_init__(self):
        for name, (low, high) in LIMITS.items():
            finite_number(name, getattr(self, name), low, high)
        if self.knob_from_edge > self.width / 2:
            raise InvalidValue(
                "knob_from_edge", self.knob_from_edge, f"at most half of width = {self.width}: far from the hinge"
            )
        if self.gap < self.thickness:
            raise InvalidValue(
                "gap", self.gap, f"at least thickness = {self.thickness}: the panel turns about the middle of its edge"
            )
        if self.knob_height + GRIP_HALF > self.height:
            raise InvalidValue("knob_height", self.knob_height, f"a knob below the top, height = {self.height}")
        if self.hold_angle > self.open_limit:
            raise InvalidValue("hold_angle", self.hold_angle, f"at most open_limit = {self.open_limit:g}")

    @classmethod
    def random(cls, seed: int) -> "ClosingDoor":
        """Return a door whose RANGES are drawn evenly by `seed` (whole number >= 0); the rest is as by default."""
        rng = make_rng(seed, 21)
        return cls(**{name: float(rng.uniform(low, high)) for name, (low, high) in RANGES.items()})

    # --- the closer --------------------------------------------------------------------------------------------------
    def closer(self, theta: float | np.ndarray) -> float | np.ndarray:
        """Return the torque [Nm] by which the closer shuts the door at `theta` [rad], in the shape of `theta`."""
        angle = finite_array("theta", theta, (-1,) * np.ndim(theta))
        torque = np.where(angle < self.hold_angle, self.closer_torque + self.closer_stiffness * angle.clip(0.0), 0.0)
        return torque if np.ndim(theta) else float(torque)

    @property
    def inertia(self) -> float:
        """Moment of inertia of panel and knob about the hinge [kg m^2]."""
        x, y, _ = self.knob_in_panel
        return self.mass * (self.width**2 / 3.0 + self.thickness**2 / 12.0) + KNOB_MASS * (x * x + y * y)

    # --- geometry ----------------------------------------------------------------------------------------------------
    @property
    def knob_radius(self) -> float:
        """Distance [m] from the hinge to the knob along the panel."""
        return self.width - self.knob_from_edge

    @property
    def knob_in_panel(self) -> np.ndarray:
        """The knob's pivot (3,) [m] in the panel's frame, at the middle of its bar."""
        return np.array([self.knob_radius, -self.thickness / 2 - self.knob_stand_off, self.knob_height])

    @property
    def opening(self) -> tuple[float, float]:
        """Where the opening begins and ends along x [m]."""
        return -self.gap / 2, self.width + self.gap / 2

    @property
    def wall(self) -> tuple[float, float]:
        """Where the wall begins (on the robot's side) and ends along y [m]."""
        return -self.thickness / 2, self.wall_thickness - self.thickness / 2

    def panel_frame(self, theta: float) -> pin.SE3:
        """Return the panel's frame in the world at `theta` [rad]: x along the panel, y away from the robot, z up."""
        return pin.SE3(turn(theta), np.zeros(3))

    def to_world(self, theta: float | np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return `points` (..., 3) [m] of the panel's frame in the world, at `theta` [rad] of shape () or (n,).

        The shape is that of `points`, with (n,) before it when there are n angles.
        """
        rotation = turn(theta)
        return np.einsum("...ij,...j->...i", _widen(rotation, np.ndim(points)), np.asarray(points, dtype=float))

    def to_panel(self, theta: float | np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return `points` (..., 3) [m] of the world in the panel's frame, at `theta` [rad] of shape () or (n,)."""
        rotation = np.swapaxes(turn(theta), -1, -2)
        return np.einsum("...ij,...j->...i", _widen(rotation, np.ndim(points)), np.asarray(points, dtype=float))

    def knob(self, theta: float | np.ndarray) -> np.ndarray:
        """Return the knob's pivot (3,) or (n, 3) [m] in the world, at `theta` [rad] of shape () or (n,)."""
        return self.to_world(theta, self.knob_in_panel)

    def knob_frame(self, theta: float, pivot: float = 0.0) -> pin.SE3:
        """Return the frame in the world that the gripper's tip takes at the knob, both angles in rad.

        Its x axis points up, along the knob's bar, y along the panel away from the hinge, z into the panel. `pivot`
        turns it about the bar, which turns freely: positive is counterclockwise as seen from above.
        """
        grip = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # columns: up, along, into
        return pin.SE3(turn(theta - pivot) @ grip, self.knob(theta))

    def panel_corners(self, theta: float | np.ndarray) -> np.ndarray:
        """Return the panel's corners in plan view, (4, 2) or (n, 4, 2) [m], counterclockwise as seen from above.

        They begin at the hinge on the robot's side and go on to the free edge on that side.
        """
        (x, y, _), (far, high, _) = self.panel_box
        corners = np.array([[x, y, 0.0], [far, y, 0.0], [far, high, 0.0], [x, high, 0.0]])
        return self.to_world(theta, corners)[..., :2]

    @property
    def panel_box(self) -> np.ndarray:
        """Lowest and highest corner (2, 3) [m] of the panel in its own frame."""
        half = self.thickness / 2
        return np.array([[0.0, -half, FLOOR_GAP], [self.width, half, self.height]])

    @property
    def knob_box(self) -> np.ndarray:
        """Lowest and highest corner (2, 3) [m] of the knob in the panel's frame: bar, neck and rosette."""
        middle, half = self.knob_in_panel, np.array([GRIP_RADIUS, GRIP_RADIUS, GRIP_HALF + GRIP_RADIUS])
        low, high = middle - half, middle + half
        high[1] = -self.thickness / 2
        return np.array([low, high])

    @property
    def frame_boxes(self) -> np.ndarray:
        """Lowest and highest corners (n, 2, 3) [m] of what stands still, in the world; FRAME_NAMES names them."""
        (left, right), (front, back), top = self.opening, self.wall, self.height + self.gap / 2
        wide, proud = CASING
        ends, ceiling = (left - WALL_BESIDE[0], right + WALL_BESIDE[1]), top + WALL_ABOVE
        return np.array([
            [[left - wide, front - proud, 0.0], [left, back + proud, top]],
            [[right, front - proud, 0.0], [right + wide, back + proud, top]],
            [[left - wide, front - proud, top], [right + wide, back + proud, top + wide]],
            [[ends[0], front, 0.0], [left - wide, back, ceiling]],
            [[right + wide, front, 0.0], [ends[1], back, ceiling]],
            [[left - wide, front, top + wide], [right + wide, back, ceiling]],
        ])  # fmt: skip

    # --- the model ---------------------------------------------------------------------------------------------------
    def closer_arm(self, theta: float | np.ndarray) -> float | np.ndarray:
        """Return the angle [rad] of the closer's arm (joint "closer_arm"), whose end slides along the panel's middle.

        With the arm's pivot at (a, c) and its length l: sin(theta) (a + l cos phi) + cos(theta) (c + l sin phi) = 0.
        """
        (a, before), angle = CLOSER_PIVOT, np.asarray(theta, dtype=float)
        c = self.wall[0] - before
        return np.arcsin((-a * np.sin(angle) - c * np.cos(angle)) / CLOSER_ARM) - angle

    def spec(self) -> mujoco.MjSpec:
        """Return an editable model of door, frame and wall; raises BrokenFile when its MJCF is missing or damaged.

        Joints "hinge", "knob" (the bar's pivot) and "closer_arm" (for the eye); site "grip" on the knob's pivot, with
        the axes of `knob_frame`; actuator "closer": 1 shuts the door by closer_torque + closer_stiffness * theta.
        """
        path = paths.MODELS / "closing_door" / "door.xml"
        try:
            spec = mujoco.MjSpec.from_file(str(path))
        except ValueError as error:
            raise BrokenFile(f"{path}: not a valid MJCF file: {error}") from None
        _shape_frame(spec, self)
        _shape_panel(spec, self)
        _shape_knob(spec, self)
        closer = spec.actuator("closer")
        closer.gainprm[:2] = -self.closer_torque, -self.closer_stiffness
        hinge = spec.joint("hinge")
        hinge.range = [0.0, self.open_limit]
        hinge.damping, hinge.frictionloss = [self.hinge_damping, 0.0, 0.0], self.hinge_friction
        return spec


def check_closing_door(door: ClosingDoor) -> ClosingDoor:
    """Return the door, or raise InvalidType."""
    if not isinstance(door, ClosingDoor):
        raise InvalidType("door", door, "a ClosingDoor")
    return door


def turn(theta: float | np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) or (n, 3, 3) of the panel at the door's angle `theta` [rad]: by -theta about z."""
    angle = finite_array("theta", theta, (-1,) if np.ndim(theta) == 1 else ())
    cosine, sine, zero = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    rows = [[cosine, sine, zero], [-sine, cosine, zero], [zero, zero, zero + 1.0]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _widen(rotation: np.ndarray, ndim: int) -> np.ndarray:
    """Give n rotations room for the leading axes of points: (n, 3, 3) -> (n, 1, ..., 3, 3)."""
    return rotation if rotation.ndim == 2 else rotation.reshape(len(rotation), *(ndim - 1) * [1], 3, 3)


def _put(spec: mujoco.MjSpec, name: str, low: np.ndarray, high: np.ndarray) -> None:
    """Make the box geom `name` reach from the corner `low` to the corner `high` [m] in its body's frame."""
    low, high = np.asarray(low), np.asarray(high)
    spec.geom(name).pos, spec.geom(name).size = (low + high) / 2, (high - low) / 2


def _shape_frame(spec: mujoco.MjSpec, door: ClosingDoor) -> None:
    for name, (low, high) in zip(FRAME_NAMES, door.frame_boxes, strict=True):
        _put(spec, name, low, high)
        _put(spec, f"{name}_seen", low, high)
    (a, before), front, top = CLOSER_PIVOT, door.wall[0], door.height + door.gap / 2
    _put(spec, "closer", [a - 0.06, front - 0.058, top + 0.004], [a + 0.17, front - CASING[1], top + 0.056])
    spec.body("closer_arm").pos = [a, front - before, (door.height + top) / 2]
    spec.geom("closer_arm").fromto = [0, 0, 0, CLOSER_ARM, 0, 0]


def _shape_panel(spec: mujoco.MjSpec, door: ClosingDoor) -> None:
    low, high = door.panel_box
    for name in ("panel", "panel_seen"):
        _put(spec, name, low, high)
    spec.geom("panel").mass = door.mass
    proud, side = 0.0015, 0.12  # what is let into the panel stands out of it, and ends before its edges [m]
    for name, share in (("inlay_low", (0.16, 0.46)), ("inlay_high", (0.56, 0.94))):
        bottom, top = np.array(share) * door.height
        _put(spec, name, [side, low[1] - proud, bottom], [door.width - side, high[1] + proud, top])
    _put(spec, "kick_plate", [0.02, low[1] - proud, 0.03], [door.width - 0.02, high[1] + proud, 0.22])
    middle = door.knob_radius
    _put(spec, "push_plate", [middle - 0.045, 0.0, door.knob_height - 0.15],
         [min(middle + 0.045, door.width - 0.005), high[1] + 2 * proud, door.knob_height + 0.15])  # fmt: skip
    for name, share in (("knuckle_low", 0.12), ("knuckle_mid", 0.5), ("knuckle_high", 0.88)):
        spec.geom(name).pos = [-0.004, low[1] - 0.004, share * door.height]
    _put(spec, "closer_track", [0.15, -0.008, door.height - 0.01], [0.42, 0.008, door.height + 0.003])


def _shape_knob(spec: mujoco.MjSpec, door: ClosingDoor) -> None:
    x, y, z = door.knob_in_panel
    face = -door.thickness / 2
    spec.body("knob").pos, spec.body("knob").mass = [x, y, z], KNOB_MASS
    for name in ("knob", "knob_seen"):
        spec.geom(name).fromto, spec.geom(name).size = [0, 0, -GRIP_HALF, 0, 0, GRIP_HALF], [GRIP_RADIUS, 0, 0]
    for end, level in (("low", z - GRIP_HALF), ("high", z + GRIP_HALF)):
        spec.geom(f"neck_{end}").fromto = [x, face, level, x, y, level]
        spec.geom(f"rosette_{end}").size, spec.geom(f"rosette_{end}").pos = [0.02, 0.004, 0.0], [x, face - 0.002, level]
    quaternion = pin.Quaternion(door.knob_frame(0.0).rotation).coeffs()
    spec.site("grip").quat = quaternion[[3, 0, 1, 2]]
