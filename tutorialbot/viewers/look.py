"""How a recorded scene is looked at: size, camera, and the ways to show it that need no kernel."""

import os
from dataclasses import dataclass, field

import numpy as np

from tutorialbot.errors import one_of
from tutorialbot.viewers import page, picture
from tutorialbot.viewers.log import CommandLog
from tutorialbot.viewers.solids import boxes

DIRECTION = np.array([1.0, -1.05, 0.55])  # from the scene's middle to the camera, where no camera is given
FIELD_OF_VIEW = np.deg2rad(32.0)  # vertical
NARROWEST = 1.6  # width over height of a view that still shows everything
MARGIN = 1.16  # room left around the content
VARIABLE, SHOWN_AS = "TUTORIALBOT_VIEWER", ("live", "html", "png")


@dataclass
class Look:
    """A log with what a view needs besides: height [px], and camera and target, None for a camera that fits."""

    log: CommandLog
    height: int
    camera: tuple[float, ...] | None
    target: tuple[float, ...] | None
    _fitted: np.ndarray | None = None  # boxes that the camera was last fitted to, (n, 2, 3) [m]
    _content: frozenset = frozenset()  # what there was to see then
    _known: dict = field(default_factory=dict)

    def _boxes(self, now: bool) -> np.ndarray:
        """Return the boxes to fit the camera to: as it is `now`, or, for a live view, without following each motion.

        A live view keeps its camera until there is more to see than it shows, or much less.
        """
        with self.log.lock:
            if now:
                return boxes(self.log.entries, self._known)
            content = frozenset((k, v if k[0] == "set_animation" else b"") for k, v in self.log.entries.items()
                                if k[0] in ("set_object", "set_animation"))  # fmt: skip
            if self._fitted is None or content != self._content:
                new, old = boxes(self.log.entries, self._known), self._fitted
                if old is None or not self._content or _outgrown(old, new):
                    self._fitted = new
                self._content = content
            return self._fitted

    def header(self, now: bool = False) -> dict:
        """Return height [px], radius, floor, and camera, target, center, directions to key and fill light, (3,) each.

        Lengths are metres in the world. The lights stand beside the first camera, so that what it sees is lit.
        """
        content = self._boxes(now)
        low, high = content[:, 0].min(0), content[:, 1].max(0)
        center, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 0.05)
        target = center if self.target is None else np.array(self.target)
        camera = fitting_eye(content, target) if self.camera is None else np.array(self.camera)
        key, fill = (_light(camera - target, *angles) for angles in ((-35.0, 52.0), (70.0, 25.0)))
        places = {"camera": camera, "target": target, "center": center, "key": key, "fill": fill}
        rounded = {name: [round(float(x), 4) for x in place] for name, place in places.items()}
        floor = min(0.0, round(float(low[2]), 4))
        return {"height": self.height, "radius": round(radius, 4), "floor": floor, **rounded}

    def html(self, title: str) -> str:
        """Return the offline page."""
        return page.build(self.header(now=True), self.log.entries, title)

    def png(self, width: int, height: int) -> bytes:
        """Return the still picture."""
        return picture.png(self.log.entries, self.header(now=True), width, height, FIELD_OF_VIEW)

    def still(self) -> dict | None:
        """Return what a notebook shows when $TUTORIALBOT_VIEWER asks for "html" or "png"; None for a live view."""
        shown_as = one_of(VARIABLE, os.environ.get(VARIABLE) or "live", SHOWN_AS)
        if shown_as == "live":
            return None
        if shown_as == "html":
            return {"text/plain": "Scene()", "text/html": page.frame(self.html("Scene"), self.height)}
        return {"text/plain": "Scene()", "image/png": self.png(960, self.height)}


def _light(back: np.ndarray, beside_deg: float, above_deg: float) -> np.ndarray:
    """Return the unit vector (3,) to a light beside the direction `back` to the eye, and so high above the floor."""
    around, above = np.arctan2(back[1], back[0]) + np.deg2rad(beside_deg), np.deg2rad(above_deg)
    return np.array([np.cos(above) * np.cos(around), np.cos(above) * np.sin(around), np.sin(above)])


def _outgrown(old: np.ndarray, new: np.ndarray) -> bool:
    """Return whether the boxes `new` leave the room that `old` took, or need less than half of it."""
    low, high = old[:, 0].min(0), old[:, 1].max(0)
    size, room = float(np.linalg.norm(high - low)), 0.05 * float(np.linalg.norm(high - low))
    left = (new[:, 0].min(0) < low - room).any() or (new[:, 1].max(0) > high + room).any()
    return bool(left or np.linalg.norm(new[:, 1].max(0) - new[:, 0].min(0)) < 0.5 * size)


def fitting_eye(boxes: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the nearest place (3,) in DIRECTION from `target` (3,) that sees all `boxes` (n, 2, 3) and some margin."""
    corners = np.stack([boxes[:, [i, j, k], [0, 1, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]).reshape(-1, 3)
    back = DIRECTION / np.linalg.norm(DIRECTION)
    side = np.cross([0.0, 0.0, 1.0], back) / np.linalg.norm(back[:2])
    x, y, z = ((corners - target) @ np.stack([side, np.cross(back, side), back], -1)).T
    steep = np.tan(FIELD_OF_VIEW / 2)
    return target + back * max(0.1, float((z + MARGIN * np.maximum(abs(y), abs(x) / NARROWEST) / steep).max()))
