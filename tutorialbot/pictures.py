"""Pictures for readers who run nothing: `python3 -m tutorialbot.pictures` writes them to data/pictures/."""

import io

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from tutorialbot import plots_cspace
from tutorialbot.bo.objective import DoorTask
from tutorialbot.bo.search import DoorRun, open_door
from tutorialbot.cleaning import CleaningRun, plan
from tutorialbot.errors import InvalidValue, finite_array, finite_number
from tutorialbot.ik.passage import Passage, run_passage
from tutorialbot.paths import DATA
from tutorialbot.scene import passage_world
from tutorialbot.scene.door import Door
from tutorialbot.scene.room import ROOMS
from tutorialbot.scene.simulation import Settings
from tutorialbot.viewers import MujocoView, Scene
from tutorialbot.vox2c import experiments, labels, motions, planning
from tutorialbot.vox2c.arm import forward_kinematics
from tutorialbot.vox2c.scenes import BoxScene

CLEANED = [[0.2, 0.2], [1.7, 0.2], [1.7, 1.4], [0.2, 1.4]]  # of the spare room [m]
CLEANING_VIEW = (-1.3, -1.7, 2.6), (1.4, 1.2, 0.25)
SCENE = 27  # the one that notebook 3 looks at
ARM_VIEW = (1.6, -2.3, 2.1), (0.0, 0.0, 1.2)
CAMERA, TARGET = (1.9, -0.9, 2.0), (-0.24, -0.25, 0.68)
PASSAGE_VIEW = (3.2, -3.3, 2.9), (0.5, -0.3, 0.8)
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


def cleaning(run: CleaningRun, width: int = 960, height: int = 540) -> Image.Image:
    """Return the room with the robot where it ended, and the way of the nozzle on the floor in green."""
    camera, target = CLEANING_VIEW
    view = MujocoView(run.world(), Scene(camera=camera, target=target))
    view.update(run.trajectory.positions[-1])
    nozzle = np.array(run.recording.nozzle)[np.array(run.recording.on_floor, dtype=bool)][::20]
    nozzle[:, 2] = 0.01
    view.scene.add_path(nozzle, 0x33AA55, radius=0.012)
    drawn = Image.open(io.BytesIO(view.scene.png(width=SMOOTHING * width, height=SMOOTHING * height)))
    return drawn.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)


def cspace(scene: BoxScene, path: np.ndarray, width: int = 960, height: int = 540) -> Image.Image:
    """Return an arm of paper 3 among its boxes and its C-space side by side, with one path (k, 2) [rad] in both.

    Raises InvalidType or InvalidValue when there is no path.
    """
    path = finite_array("path", path, (-1, 2))
    if not len(path):
        raise InvalidValue("path", path, "at least one configuration: an unsolved plan has none")
    camera, target = ARM_VIEW
    stage, model = Scene(camera=camera, target=target), scene.model()
    fine, _ = motions.densify(path, 0.01)
    for i, share in enumerate((0.0, 0.35, 0.65, 1.0)):
        view = MujocoView(model, stage, prefix=f"arm_{i}", opacity=1.0 if share in (0.0, 1.0) else 0.35)
        view.update(fine[round(share * (len(fine) - 1))])
    stage.add_path(forward_kinematics(fine)[:, 2], 0xD62728, radius=0.008)
    left = Image.open(io.BytesIO(stage.png(width=SMOOTHING * (width - height), height=SMOOTHING * height)))
    figure = Figure(figsize=(height / 100, height / 100), dpi=100 * SMOOTHING, layout="constrained")
    ax = figure.add_subplot()
    plots_cspace.plot_cspace(ax, labels.exact_cspace(scene, 1))
    plots_cspace.plot_path(ax, path, colour="#d62728")
    right = io.BytesIO()
    figure.savefig(right)
    both = Image.new("RGB", (SMOOTHING * width, SMOOTHING * height), "white")
    both.paste(left.convert("RGB"), (0, 0)), both.paste(Image.open(right).convert("RGB"), (left.width, 0))
    return both.resize((width, height), Image.Resampling.LANCZOS)


def through(run: Passage, share: float = 0.55, width: int = 960, height: int = 540) -> Image.Image:
    """Return the robot of paper 4 in the doorway, holding the door behind it, with the way of its base in light blue.

    share: of the time of phases (g) and (h) together that has passed. Raises InvalidValue for a passage that failed.
    """
    if not run.passed:
        raise InvalidValue("run", run.failure, "a passage that has passed the door")
    camera, target = PASSAGE_VIEW
    view = MujocoView(passage_world.world(run.door, wall_opacity=0.35), Scene(camera=camera, target=target))
    last = np.flatnonzero([run.phases[k][0] in "gh" for k in run.phase])
    i = last[int(finite_number("share", share, 0.0, 1.0) * (len(last) - 1))]
    view.update(passage_world.configuration(view.model, run.door, run.base[i], run.q[i], run.door_angle[i]))
    view.scene.add_path(np.column_stack([run.base[:, :2], np.full(len(run.base), 0.02)]), 0x33AAFF, radius=0.012)
    drawn = Image.open(io.BytesIO(view.scene.png(width=SMOOTHING * width, height=SMOOTHING * height)))
    return drawn.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)


def main() -> None:
    """Search a door, clean a part of a room, plan among boxes, pass a door, and write the pictures of all four."""
    ours = Door()
    folder = DATA / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    picture = door(open_door(ours, seed=1, resume=False), ours)
    picture.save(folder / "door.png", optimize=True)
    cleaned = plan(CLEANED, room=ROOMS["spare room"], seed=1)
    cleaning(cleaned).save(folder / "cleaning.png", optimize=True)
    (problem,) = experiments.pairs(SCENE, 1)
    planned = planning.plan(problem.scene, problem.start, problem.goal, planner="RRTstar", seed=1)
    cspace(problem.scene, planned.path).save(folder / "cspace.png", optimize=True)
    through(run_passage()).save(folder / "passage.png", optimize=True)


if __name__ == "__main__":
    main()
