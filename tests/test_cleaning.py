"""The cleaning task of paper 2, end to end on a small area; more of it is tested room by room elsewhere."""

import numpy as np
import pytest

from tutorialbot import cleaning
from tutorialbot.cleaning import task
from tutorialbot.cleaning.cells import reachable_cells
from tutorialbot.cleaning.reach import FORWARD, LEFT, TILT, solve_postures, tip
from tutorialbot.errors import TutorialbotError
from tutorialbot.ik import genetic
from tutorialbot.scene.room import ROOMS, Room
from tutorialbot.seeding import make_rng

SPARE = ROOMS["spare room"]
CORNER = np.array([[0.2, 0.2], [1.7, 0.2], [1.7, 1.4], [0.2, 1.4]])


@pytest.fixture(scope="module")
def run():
    return cleaning.plan(CORNER, room=SPARE, seed=3)


def test_a_corner_of_a_room_gets_clean_and_nothing_is_touched(run):
    assert run.finished and run.coverage >= 0.98
    assert run.min_clearance > 0.0
    assert run.coverage == pytest.approx(run.covered[run.cells.reachable].mean())
    assert len(run.missed) == (run.cells.reachable & ~run.covered).sum()


def test_ctrl_c_in_the_drive_keeps_what_was_covered(run, monkeypatch):
    def ended(*arguments):
        for count, motion in enumerate(execute(*arguments)):
            yield motion
            if count == 4:
                raise KeyboardInterrupt

    execute = task.execute
    monkeypatch.setattr(task, "execute", ended)
    part = cleaning.plan(CORNER, room=SPARE, seed=3)
    assert not part.finished and 0.0 < part.coverage < run.coverage
    assert (run.covered | ~part.covered).mean() > 0.999  # the same way so far


def test_between_solved_postures_the_hand_is_where_it_should_be():
    *_, postures = solve_postures(3)
    nozzle = make_rng(31).uniform((FORWARD[0], LEFT[0]), (FORWARD[-1], LEFT[-1]), (200, 2))
    position, tilt = genetic.forward_kinematics(postures.arm(nozzle, np.zeros(200)))
    wanted = np.moveaxis(np.array(tip(*nozzle.T, np.zeros(200))), 0, -1)
    assert np.abs(position - wanted).max() < 1e-3
    assert np.abs(tilt - TILT).max() < 1e-2


def test_the_film_is_one_of_the_world(run):
    world = run.world()
    assert run.trajectory.positions.shape[1] == world.nq
    start = run.trajectory.positions[0][[world.joint(name).qposadr[0] for name in ("base_x", "base_y", "base_yaw")]]
    assert start == pytest.approx(SPARE.start, abs=0.02)
    assert run.trajectory.duration == pytest.approx(run.seconds, abs=0.3)


def test_what_was_covered_lies_under_the_nozzles_way(run):
    nozzle = np.array(run.recording.nozzle)[np.array(run.recording.on_floor, dtype=bool)][:, :2]
    far = np.linalg.norm(run.cells.centres[run.covered][:, None] - nozzle[None, ::5], axis=2).min(axis=1)
    assert far.max() < np.hypot(0.13, 0.05) + 0.02


def test_a_nozzle_in_the_air_cleans_nothing(run):
    """Planted fault: the same way, but the nozzle never touched."""
    from tutorialbot.cleaning.cells import passed_over

    touched = np.zeros(len(run.recording.nozzle), dtype=bool)
    assert not passed_over(run.cells, np.array(run.recording.nozzle)[touched].reshape(-1, 3)).any()


def test_cells_that_the_nozzle_cannot_cover_are_not_reachable():
    hall = Room("hall", [[0, 0], [3, 0], [3, 3], [0, 3]], start=(1.5, 1.5, 0.0))
    assert reachable_cells(np.array([[0.5, 0.5], [1.5, 0.5], [1.5, 1.5], [0.5, 1.5]]), hall).reachable.all()
    assert not reachable_cells(np.array([[0.5, 0.5], [1.5, 0.5], [1.5, 0.58], [0.5, 0.58]]), hall).reachable.any()


@pytest.mark.parametrize(
    "area",
    [
        [[0, 0], [1, 0]],
        [[0, 0], [1, 1], [1, 0], [0, 1]],
        [[0, 0], [9, 0], [9, 1], [0, 1]],
        [[0.5, 0.5], [1.5, 0.5], [1.5, 0.55], [0.5, 0.55]],
        [[0, 0], [1, 0], [np.nan, 1]],
        "floor",
    ],
    ids=["two corners", "crossing", "outside", "too narrow", "nan", "text"],
)
def test_areas_that_cannot_be_cleaned_are_refused(area):
    with pytest.raises(TutorialbotError, match="^area"):
        cleaning.plan(area, room=SPARE, seed=1)


@pytest.mark.full
@pytest.mark.parametrize("name", ROOMS)
def test_whole_rooms_get_clean(name):
    """A seed on which nothing was tuned. What is reachable and what is open is found without the planner."""
    room = ROOMS[name]
    run = cleaning.plan(room.floor, room=room, seed=303)
    shares = f"{run.coverage_within_reach:.4f} within reach, {run.coverage:.4f} of reachable"
    print(f"\n{name}: {shares}, {run.coverage_of_area:.4f} of all; clearance {1e3 * run.min_clearance:.2f} mm")
    assert run.finished
    assert run.min_clearance > 0.0
    assert run.coverage_within_reach >= 0.98
    assert run.coverage >= 0.98
