"""Rooms with furniture, and the world of paper 2's cleaning task: room, robot, and the vacuum cleaner in its hand.

Frames: the room's frame is the world's, z up, the floor at z = 0. The robot's base has its own frame (x forward, y
left) at (base_x, base_y, base_yaw); site "abdomen", the origin of the paper's frame, is `ABDOMEN_HEIGHT` above it. In
the working posture (tilt (0, -pi/2, 0), Table 1) the nozzle is flat on the floor when the thumb's root is
`WORKING_HEIGHT` above the abdomen: there the arm reaches more than at the paper's z = 0 and z = 0.1: x 0.10..0.40 and
y -0.10..0.40 with 5 degrees left to every joint limit (a test measures it).
"""

from dataclasses import dataclass

import mujoco
import numpy as np
import shapely

from tutorialbot import paths
from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, positive
from tutorialbot.scene import furniture, omni, outline
from tutorialbot.scene.furniture import Furniture
from tutorialbot.scene.furniture_kinds import COLOURS

ARM = tuple(f"arm_{i}" for i in range(1, 8))
FINGERS = tuple(f"finger_{i}" for i in range(1, 5))
MOVING = ("base_x", "base_y", "base_yaw", *ARM)
SPEED = np.array([0.4, 0.4, 0.8, *[1.5] * 4, *[2.5] * 3])  # for trapezoids, [m/s] and [rad/s]
ACCELERATION = np.array([1.0, 1.0, 2.0, *[6.0] * 4, *[10.0] * 3])  # [m/s^2] and [rad/s^2]
ABDOMEN_HEIGHT = 0.72  # as in robot.xml [m]
WORKING_HEIGHT = 0.15  # of the thumb's root above the abdomen when the nozzle is on the floor [m]
BASE_RADIUS = 0.25  # of the base and what stands on it, as in robot.xml [m]
BASE_TOP = 0.33  # [m]
NOZZLE_LENGTH, NOZZLE_WIDTH, NOZZLE_HEIGHT = 0.10, 0.26, 0.06  # along x, along y, and how high it stands [m]
WHEELS = tuple(
    omni.OmniWheel(0.2 * np.cos(at), 0.2 * np.sin(at), at + np.pi / 2, 0.06)
    for at in np.pi / 4 + np.pi / 2 * np.arange(4)
)  # as in robot.xml
WHEEL_RATE = 15.0  # [rad/s]
GRASP = 1.75  # set point of the actuator "thumb" that closes the hand around the handle
CLOSED = {"thumb": 0.784, **dict.fromkeys(FINGERS, 0.644)}  # where the hand's joints then come to rest, about [rad]
HANDLE_IN_HAND = (-0.01, -0.032, -0.108)  # middle of the grip in the frame of the body "arm_hand" [m]
NOZZLE_FROM_TIP = np.array([0.608, -0.032, -0.87])  # in the base's axes, in the working posture [m]
SEEN = {"group": 2, "contype": 0, "conaffinity": 0, "mass": 0.0}
SOLID = {"group": 3, "contype": 2, "conaffinity": 1, "mass": 0.0, "rgba": [0.3, 0.3, 0.8, 0.4]}
WALL = 0.06  # thickness [m]
WALL_SOLID = 1.6  # walls are seen cut off low, and felt up to here [m]


@dataclass(frozen=True, eq=False)
class Room:
    """A floor with walls around it and furniture on it. Lengths in m, angles in rad.

    `floor`: corners (k, 2) of a polygon that need not be convex, kept counterclockwise. `start`: pose (x, y, yaw) in
    which the robot's base begins. `wall_height` is how high the walls are drawn; they stop the robot higher up too.

    Raises InvalidValue or InvalidType for a polygon with fewer than three corners or that crosses itself, for furniture
    that is not wholly inside or shares a name, and for a start that is outside or less than the base's radius away
    from a wall or a piece.
    """

    name: str
    floor: np.ndarray
    furniture: tuple[Furniture, ...] = ()
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    wall_height: float = 0.24

    def __post_init__(self):
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidType("name", self.name, "a name such as 'kitchen'")
        object.__setattr__(self, "floor", outline.checked("floor", self.floor))
        self.floor.setflags(write=False)
        finite_number("wall_height", self.wall_height, 0.02, WALL_SOLID)
        if not isinstance(self.furniture, tuple | list) or not all(isinstance(p, Furniture) for p in self.furniture):
            raise InvalidType("furniture", self.furniture, "a tuple of Furniture")
        object.__setattr__(self, "furniture", tuple(self.furniture))
        names, inside = [piece.name for piece in self.furniture], self.polygon.buffer(outline.TOUCH)
        for piece in self.furniture:
            if names.count(piece.name) > 1:
                raise InvalidValue("furniture", piece.name, "a name of its own for every piece")
            if not inside.covers(shapely.Polygon(piece.footprint)):
                corners = piece.footprint.round(3).tolist()
                raise InvalidValue("furniture", piece.name, f"a piece inside the room; its corners are {corners}")
        start = finite_array("start", self.start, (3,))
        object.__setattr__(self, "start", tuple(start.tolist()))
        place = shapely.Point(start[:2])
        if not inside.covers(place):
            raise InvalidValue("start", self.start, "a place inside the room")
        solid = shapely.union_all([shapely.Polygon(part) for part in self.obstacles(0.0, BASE_TOP)])
        walls = self.polygon.exterior
        if place.distance(shapely.union(walls, solid)) < BASE_RADIUS:
            raise InvalidValue("start", self.start, f"a place with {BASE_RADIUS} m around it that is free")

    @property
    def polygon(self) -> shapely.Polygon:
        """The floor, furniture included."""
        return shapely.Polygon(self.floor)

    @property
    def area(self) -> float:
        """Area of the floor [m^2], furniture included."""
        return self.polygon.area

    def obstacles(self, low: float, high: float) -> list[np.ndarray]:
        """Return the outlines (k, 2) [m], convex and counterclockwise, of solid parts in the heights low..high [m].

        For the nozzle the heights are 0..NOZZLE_HEIGHT, for the base 0..BASE_TOP; the walls are not among them.
        """
        return [outline for piece in self.furniture for outline in piece.solids(low, high)]

    def spec(self, *, seen: bool = True) -> mujoco.MjSpec:
        """Return an editable model of the room; `seen=False` leaves out what is there for the eye alone.

        The floor is a plane that only a nozzle feels; walls are called wall_0, wall_1, ... in the order of the corners.
        """
        spec = mujoco.MjSpec()
        spec.modelname = self.name
        if seen:
            for name, colour in COLOURS.items():
                spec.add_material(name=name, rgba=[*colour, 1.0], specular=0.15, shininess=0.2)
            _draw_floor(spec, self.floor)
        spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], **{**SOLID, "contype": 4, "conaffinity": 4}
        )
        for i in range(len(self.floor)):
            _add_wall(spec, i, self.floor, self.wall_height, seen)
        for piece in self.furniture:
            furniture.add(spec, piece, SEEN if seen else None, SOLID)
        return spec


def _draw_floor(spec: mujoco.MjSpec, corners: np.ndarray) -> None:
    """Add a slab below the floor, and the seams of its planks."""
    k, depth = len(corners), 0.03
    cut = outline.triangles(corners)
    side = np.arange(k)
    after = (side + 1) % k
    faces = np.concatenate(
        [cut, cut[:, ::-1] + k, np.stack([side, side + k, after], 1), np.stack([after, side + k, after + k], 1)]
    )
    levels = [np.column_stack([corners, np.full(k, z)]) for z in (0.0, -depth)]
    mesh = spec.add_mesh(name="slab", uservert=np.concatenate(levels).ravel(), userface=faces.ravel())
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="slab", material="floor", **SEEN)
    low, high = corners.min(0), corners.max(0)
    for y in np.arange(low[1] + 0.2, high[1] - 1e-6, 0.2):
        crossings = []
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if (a[1] > y) != (b[1] > y):
                crossings.append(a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
        crossings.sort()
        for left, right in zip(crossings[::2], crossings[1::2], strict=True):
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[(left + right) / 2, y, 0],
                size=[(right - left) / 2, 0.003, 0.0005],
                material="seam",
                **SEEN,
            )


def _add_wall(spec: mujoco.MjSpec, number: int, corners: np.ndarray, height: float, seen: bool) -> None:
    """Add the wall along edge `number`, outside the room; where corners jut out it reaches around them."""
    before, a, b, after = corners[(number + np.arange(-1, 3)) % len(corners)]
    along = b - a
    length, yaw = float(np.hypot(*along)), float(np.arctan2(along[1], along[0]))
    outward = np.array([along[1], -along[0]]) / length
    juts = (shapely.LinearRing(three).is_ccw for three in ((before, a, b), (a, b, after)))
    back, front = (0.999 * WALL if out else 0.0 for out in juts)
    middle = (a + b) / 2 + 0.5 * (front - back) * along / length
    turn = {"type": mujoco.mjtGeom.mjGEOM_BOX, "quat": [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]}

    def upright(low: float, high: float, thickness: float) -> dict:
        place = [*(middle + thickness / 2 * outward), (low + high) / 2]
        return {**turn, "pos": place, "size": [(length + back + front) / 2, abs(thickness) / 2, (high - low) / 2]}

    if seen:
        spec.worldbody.add_geom(**upright(-0.03, height, WALL), material="wall", **SEEN)
        strip = {**upright(0.0, min(0.06, height), -0.008), "pos": [*((a + b) / 2 - 0.004 * outward), 0.03]}
        strip["size"][0] = length / 2
        spec.worldbody.add_geom(**strip, material="skirting", **SEEN)
    spec.worldbody.add_geom(name=f"wall_{number}", **upright(0.0, WALL_SOLID, WALL), **SOLID)


def assemble(
    room: Room, *, timestep: float = 0.002, seen: bool = True, tool: bool = True
) -> tuple[mujoco.MjModel, np.ndarray]:
    """Return the compiled world and the lead (10,) [s] of the joints MOVING.

    The world is the room (its names prefixed "room/"), the robot, and the vacuum cleaner (prefixed "vacuum/") held
    rigidly by the left hand; `tool=False` leaves the hand empty. The lead is the ratio of damping to stiffness of each
    joint's controller: a set point that runs ahead by lead * speed is not dragged by damping.

    `seen=False` leaves out the geoms that are there for the eye alone: no number of the state changes and qpos is laid
    out alike, but a step costs less.
    """
    if not isinstance(room, Room):
        raise InvalidType("room", room, "a Room, for instance one of ROOMS")
    spec = mujoco.MjSpec.from_file(str(paths.MODELS / "life_support_robot" / "robot.xml"))
    spec.option.timestep = positive("timestep", timestep)
    if tool:
        vacuum = mujoco.MjSpec.from_file(str(paths.MODELS / "vacuum" / "vacuum.xml"))
        half = np.sqrt(0.5)  # in the working posture the hand's x points up and its z back
        frame = spec.body("arm_hand").add_frame(pos=HANDLE_IN_HAND, quat=[half, 0, half, 0])
        spec.attach(vacuum, prefix="vacuum/", frame=frame)
        spec.add_pair(geomname1="thumb_pad", geomname2="vacuum/grip", condim=1)  # else: parts of one hand never touch
    spec.attach(room.spec(seen=seen), prefix="room/", frame=spec.worldbody.add_frame())
    if not seen:
        for geom in spec.geoms:
            if geom.group == SEEN["group"] and geom.mass == 0.0 and not (geom.contype or geom.conaffinity):
                spec.delete(geom)
    lead = []
    for name in MOVING:
        actuator = spec.actuator(name)
        if name in ARM:
            gains = {key: float(value) for key, value in actuator.plugin.config.items()}
            lead.append(gains["kd"] / gains["kp"])
        else:
            lead.append(-actuator.biasprm[2] / actuator.gainprm[0])
    return spec.compile(), np.array(lead)


def place(model: mujoco.MjModel, data: mujoco.MjData, base: np.ndarray, arm: np.ndarray) -> None:
    """Put the robot of an assembled world at rest: base (3,) x, y [m] and yaw [rad], arm (7,) [rad], the hand closed.

    Every set point is where its joint is, integrals are empty, time is 0.
    """
    goal = np.concatenate([finite_array("base", base, (3,)), finite_array("arm", arm, (len(ARM),))])
    mujoco.mj_resetData(model, data)
    for name, value in [*zip(MOVING, goal, strict=True), *CLOSED.items()]:
        data.joint(name).qpos[:] = value
    for name, value in zip(MOVING, goal, strict=True):
        data.actuator(name).ctrl[:] = value
    data.actuator("thumb").ctrl[:] = GRASP
    mujoco.mj_forward(model, data)


def _rectangle(width: float, depth: float) -> np.ndarray:
    return np.array([[0.0, 0.0], [width, 0.0], [width, depth], [0.0, depth]])


QUARTER = np.pi / 2
ROOMS = {
    "spare room": Room(
        "spare room",
        _rectangle(3.0, 2.6),
        (
            Furniture("cupboard", "cupboard", 1.9, 2.375),
            Furniture("plant", "plant", 2.72, 0.28),
            Furniture("carton", "carton", 0.26, 2.4, 0.15),
            Furniture("carpet", "carpet", 1.5, 1.2),
        ),
        start=(0.6, 0.6, 0.0),
    ),
    "living room": Room(
        "living room",
        _rectangle(4.6, 3.8),
        (
            Furniture("sofa", "sofa", 2.1, 3.4),
            Furniture("table", "coffee table", 2.1, 2.1, length=0.9, width=0.5, height=0.42),
            Furniture("television", "television", 2.1, 0.2, np.pi),
            Furniture("bookcase", "bookcase", 4.46, 2.3, -QUARTER, length=1.2),
            Furniture("table", "dining table", 0.45, 1.3, QUARTER, length=1.1),
            Furniture("chair", "chair", 1.02, 1.3, -QUARTER),
            Furniture("lamp", "lamp", 0.85, 3.55),
            Furniture("plant", "plant", 4.36, 3.56),
            Furniture("carpet", "carpet", 2.1, 2.1, length=2.0, width=1.3),
        ),
        start=(3.6, 0.8, QUARTER),
    ),
    "bedroom with a narrow passage": Room(
        "bedroom with a narrow passage",
        np.array([[0.0, 0.0], [4.4, 0.0], [4.4, 3.2], [1.5, 3.2], [1.5, 2.3], [0.0, 2.3]]),
        (
            Furniture("bed", "bed", 3.38, 0.55, np.pi),
            Furniture("cupboard", "wardrobe", 2.9, 2.12, length=1.4, width=0.55, height=1.5),
            Furniture("table", "desk", 1.87, 2.78, -QUARTER, length=0.8, width=0.6),
            Furniture("lamp", "lamp", 0.22, 2.08),
            Furniture("plant", "plant", 0.25, 0.25),
            Furniture("carpet", "carpet", 1.0, 1.2, length=1.1, width=0.9),
        ),
        start=(0.8, 1.2, 0.0),
    ),
}
