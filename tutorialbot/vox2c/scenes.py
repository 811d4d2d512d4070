"""Scenes of paper 3: boxes at random around the arm (section 4.1.1), and the same as a MuJoCo model to look at."""

from dataclasses import dataclass

import mujoco
import numpy as np

from tutorialbot import paths
from tutorialbot.errors import InvalidValue, finite_array, whole_number
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c.arm import COLUMN, DOMAIN

SIDES = (0.10, 0.35)  # of a random box [m], section 4.1.1
CLEARANCE = 0.05  # random boxes keep this far from the column, and so from joint 1 [m]; the paper does not say
COLOURS = ((0.30, 0.55, 0.80), (0.45, 0.70, 0.55), (0.80, 0.70, 0.45), (0.70, 0.50, 0.65), (0.55, 0.60, 0.68))
FLOOR = (0.86, 0.87, 0.88, 1.0)
TOUCH = 1e-9  # boxes may stand out of the domain by this much [m]: rounding


@dataclass(frozen=True, eq=False)
class BoxScene:
    """Axis-aligned boxes, (n, 6): centre x, y, z and full sides along x, y, z [m], all inside arm.DOMAIN; read-only.

    Boxes may overlap each other and the column, which stands still. Raises InvalidValue or InvalidType for another
    shape, NaN, a side that is not positive, and a box that is not wholly inside.
    """

    boxes: np.ndarray

    def __post_init__(self):
        boxes = np.array(finite_array("boxes", self.boxes, (-1, 6)))
        low, high = (np.array(corner) for corner in DOMAIN)
        for i, box in enumerate(boxes):
            if (box[3:] <= 0.0).any():
                raise InvalidValue(f"boxes[{i}]", box.tolist(), "sides > 0 (its last three numbers)")
            if (box[:3] - box[3:] / 2 < low - TOUCH).any() or (box[:3] + box[3:] / 2 > high + TOUCH).any():
                raise InvalidValue(f"boxes[{i}]", box.tolist(), f"a box wholly between {DOMAIN[0]} and {DOMAIN[1]}")
        boxes.flags.writeable = False
        object.__setattr__(self, "boxes", boxes)

    @property
    def corners(self) -> tuple[np.ndarray, np.ndarray]:
        """The lowest and the highest corner of each box, each (n, 3) [m]."""
        return self.boxes[:, :3] - self.boxes[:, 3:] / 2, self.boxes[:, :3] + self.boxes[:, 3:] / 2

    def model(self, *, seen: bool = True) -> mujoco.MjModel:
        """Return a MuJoCo model of the floor, the arm (joints joint1, joint2) and the boxes (geoms box0, box1, ...).

        `seen=False` leaves out what is there for the eye alone. The boxes are in geom group 0, the floor in 1.
        """
        return self.spec(seen=seen).compile()

    def spec(self, *, seen: bool = True) -> mujoco.MjSpec:
        """Return what `model` compiles, to add to."""
        spec = mujoco.MjSpec.from_file(str(paths.MODELS / "rrbot" / "robot.xml"))
        if not seen:
            for geom in spec.geoms:
                if not (geom.contype or geom.conaffinity):
                    spec.delete(geom)
        things = {"contype": 2, "conaffinity": 1}
        spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.15, 1.15, 0.1], group=1, rgba=FLOOR, **things
        )
        for i, box in enumerate(self.boxes):
            colour = [*COLOURS[i % len(COLOURS)], 1.0]
            spec.worldbody.add_geom(
                name=f"box{i}", type=mujoco.mjtGeom.mjGEOM_BOX, pos=box[:3], size=box[3:] / 2, rgba=colour, **things
            )
        return spec


def random_scene(seed: int, boxes: int = 15) -> BoxScene:
    """Draw a scene of so many boxes: sides even in SIDES, places even in the domain, clear of the column.

    The same seed gives the same scene. Paper 3, section 4.1.1: 15 boxes with sides between 0.1 and 0.35 m. A box nearer
    to the column than CLEARANCE is drawn again: on joint 1 it would block every configuration.
    """
    rng = make_rng(seed, 3)
    low, high = (np.array(corner) for corner in DOMAIN)
    keep_low, keep_high = np.array(COLUMN[0]) - CLEARANCE, np.array(COLUMN[1]) + CLEARANCE
    found = np.empty((whole_number("boxes", boxes), 6))
    for row in found:
        while True:
            sides = rng.uniform(*SIDES, 3)
            centre = rng.uniform(low + sides / 2, high - sides / 2)
            row[:] = *centre, *sides
            apart = (centre + sides / 2 <= keep_low) | (centre - sides / 2 >= keep_high)
            if apart.any():
                break
    return BoxScene(found)
