"""Pictures for readers who run nothing: `python3 -m tutorialbot.pictures` writes them to data/pictures/."""

import io

import numpy as np
from PIL import Image

from tutorialbot.bo.objective import DoorTask
from tutorialbot.bo.search import DoorRun, open_door
from tutorialbot.paths import DATA
from tutorialbot.scene.door import Door
from tutorialbot.scene.simulation import Settings
from tutorialbot.viewers import MujocoView, Scene

CAMERA, TARGET = (1.9, -0.9, 2.0), (-0.24, -0.25, 0.68)
SMOOTHING = 2  # drawn this many times larger, then averaged


def door(run: DoorRun, door: Door, width: int = 960, height: int = 540) -> Image.Image:
    """Return the robot at the end of the path that opened `door`: path in light blue, a frame at each section's end."""
    task = DoorTask(door, settings=Settings(stiffness=1.0))
    period = task.simulation.settings.control_period
    instants = np.arange(period, run.trajectory.duration + 0.5, period)
    way = task.track(task.simulation.joints, map(run.trajectory.sample, instants))
    task.simulation.follow(way, stop=False)
    view = MujocoView(task.simulation.model, Scene(camera=CAMERA, target=TARGET))
    view.update(task.simulation.data)
    points = [run.trajectory.sample(t).translation for t in np.linspace(0.0, run.trajectory.duration, 200)]
    view.scene.add_path(np.array(points), 0x33AAFF, radius=0.009)
    for i, pose in enumerate(run.trajectory.poses):
        view.scene.add_frame(pose, 0.13, name=f"section_{i}")
    drawn = Image.open(io.BytesIO(view.scene.png(width=SMOOTHING * width, height=SMOOTHING * height)))
    return drawn.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)


def main() -> None:
    """Search a door and write the README's picture of it."""
    ours = Door()
    folder = DATA / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    picture = door(open_door(ours, seed=1, resume=False), ours)
    picture.save(folder / "door.png", optimize=True)


if __name__ == "__main__":
    main()
