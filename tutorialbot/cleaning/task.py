"""Paper 2's whole task: an area on the floor is given, and the robot vacuums it.

`plan` does it all. The steps stand alone too, so that they can be shown one after the other: `reachable_cells`,
`solve_postures`, `prepare`, `choose`, `tour`, `execute`, `judge`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from tutorialbot.cleaning.body import Body, Distances, measure
from tutorialbot.cleaning.cells import Cells, passed_over, reachable_cells
from tutorialbot.cleaning.lanes import HEADINGS, Headed, Lane, choose_lanes
from tutorialbot.cleaning.reach import FORWARD, LEFT, Postures, solve_postures
from tutorialbot.cleaning.route import DRAWN, Router
from tutorialbot.cleaning.simulation import CleaningSimulation, Recording, paced
from tutorialbot.cleaning.tour import SPEED_ON_FLOOR, Motion, tour
from tutorialbot.errors import InvalidType, InvalidValue, whole_number
from tutorialbot.runs import progress
from tutorialbot.scene import outline
from tutorialbot.scene.room import Room, assemble
from tutorialbot.trajectory import Trajectory

AROUND = 1.5  # from an area without a room to the walls that are put around it [m]


@dataclass(frozen=True, eq=False)
class CleaningRun:
    """What was planned and what came of it.

    cells; covered (n,): which of them the nozzle passed over while it lay on the floor in contact with it. coverage: of
    the reachable cells, 0..1. trajectory: of the world's qpos (`world()`), a state every 0.1 s. min_clearance [m]: the
    least distance of robot and vacuum cleaner from walls and furniture in the simulation, the nozzle included, negative
    when they ran into each other; distances from simulation.NOTICED on are not told apart; nearest: between what it
    was. seconds: simulated; distance: how far the base drove [m]. finished: False when Ctrl-C ended it or the
    simulation failed.
    """

    room: Room
    cells: Cells
    lanes: tuple[Lane, ...]
    covered: np.ndarray
    trajectory: Trajectory
    min_clearance: float
    nearest: tuple[str, str]
    seconds: float
    distance: float
    finished: bool
    recording: Recording

    @property
    def coverage(self) -> float:
        """Share of the reachable cells that were covered, 0..1."""
        return float(self.covered[self.cells.reachable].mean())

    @property
    def coverage_within_reach(self) -> float:
        """Share of the cells that were covered of those that the nozzle with pipe and robot could cover, 0..1."""
        return float(self.covered[self.cells.within_reach].mean())

    @property
    def coverage_of_area(self) -> float:
        """Share of all cells of the area, those below furniture included, 0..1."""
        return float(self.covered.mean())

    @property
    def missed(self) -> np.ndarray:
        """Centres (k, 2) [m] of the reachable cells that were not covered."""
        return self.cells.centres[self.cells.reachable & ~self.covered]

    def world(self):
        """Return the MuJoCo model whose qpos `trajectory` holds, with all that is there for the eye."""
        return assemble(self.room)[0]


def checked(area: np.ndarray, room: Room | None) -> tuple[np.ndarray, Room]:
    """Return the area's corners (k, 2) [m], counterclockwise, and its room; an empty one around the area for None.

    Raises InvalidValue or InvalidType for fewer than three corners, edges that cross, and an area outside the room.
    """
    area = outline.checked("area", area)
    if room is None:
        low, high = area.min(axis=0) - AROUND, area.max(axis=0) + AROUND
        floor = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        return area, Room("empty room", floor, start=(low[0] + 0.5, float(area[:, 1].mean()), 0.0))
    if not isinstance(room, Room):
        raise InvalidType("room", room, "a Room, for instance one of ROOMS, or None")
    if not room.polygon.buffer(outline.TOUCH).covers(shapely.Polygon(area)):
        raise InvalidValue("area", area.tolist(), f"a polygon inside the room, whose corners are {room.floor.tolist()}")
    return area, room


@dataclass(frozen=True, eq=False)
class Prepared:
    """What planning needs to know: postures, the robot's body, distances in the room, ways between places."""

    postures: Postures
    body: Body
    distances: Distances
    router: Router


def prepare(room: Room, postures: Postures) -> Prepared:
    """Measure the robot and the room. Raises InvalidValue when the robot cannot lift its arm at the room's start."""
    body, distances = measure(assemble(room, seen=False)[0], postures), Distances(room)
    start = np.array(room.start)
    raised = body.clearance(distances, np.tile(start, (2, 1)), np.array([[FORWARD[0], LEFT[-1]], DRAWN]))
    router = Router(body, distances, start)
    if min(raised.min(), body.rest.clearance(distances, start[None]).min()) < 0.0 or router.home is None:
        raise InvalidValue("room", room.start, "a start where the robot can lift its arm and drive away")
    return Prepared(postures, body, distances, router)


def choose(cells: Cells, room: Room, prepared: Prepared) -> Iterator[tuple[Lane, float]]:
    """Yield the lanes one by one, and what share of the cells within reach they cover together by plan."""
    headed = [Headed(heading, room, prepared.body, prepared.distances, cells) for heading in HEADINGS]
    yield from choose_lanes(headed, cells, prepared.router.accessible)


def execute(simulation: CleaningSimulation, motions: Sequence[Motion], postures: Postures) -> Iterator[Motion]:
    """Raise the arm, then drive the motions in the simulation, yielding each when it is done."""
    base = simulation.reference[:3]
    raising = np.column_stack([np.tile(base, (len(postures.raising), 1)), postures.raising])
    aside = Motion(np.tile(base, (2, 1)), np.array([[FORWARD[0], LEFT[-1]], DRAWN]), np.ones(2))
    for samples in (raising, *aside.samples(postures)):
        simulation.follow(paced(samples, 0.5))
    for motion in motions:
        for samples, start, end in zip(motion.samples(postures), motion.nozzle[:-1], motion.nozzle[1:], strict=True):
            way = np.linalg.norm(samples[-1, :2] - samples[0, :2] + end - start)  # at most this far goes the nozzle
            floor = motion.lane is not None
            simulation.follow(paced(samples, SPEED_ON_FLOOR / max(way, 1e-3) if floor else np.inf), press=floor)
            if simulation.failed:
                return
        yield motion


def judge(
    simulation: CleaningSimulation, cells: Cells, room: Room, lanes: Sequence[Lane], finished: bool
) -> CleaningRun:
    """Return what the recording tells: cells count as covered by contact in the simulation, never by plan."""
    record = simulation.record
    nozzle, base = np.array(record.nozzle).reshape(-1, 3), np.array(record.base).reshape(-1, 3)
    covered = passed_over(cells, nozzle[np.array(record.on_floor, dtype=bool)])
    distance = float(np.hypot(*np.diff(base[:, :2], axis=0).T).sum())
    trajectory = Trajectory(np.array(record.film_times), np.array(record.film))
    return CleaningRun(
        room, cells, tuple(lanes), covered, trajectory, float(record.clearance), record.nearest,
        float(simulation.data.time), distance, finished, record,
    )  # fmt: skip


def plan(area: np.ndarray, *, room: Room | None = None, seed: int) -> CleaningRun:
    """Let the robot vacuum `area`, corners (k, 2) [m] in the room's frame, and return what it covered.

    room: None puts an empty one around the area. seed: of the genetic algorithm that finds the arm's postures; the same
    seed gives the same run. Ctrl-C during the drive ends it, and the run holds what was covered so far, `finished`
    False. Raises InvalidValue or InvalidType for an area with fewer than three corners, that crosses itself, is outside
    the room or has no cell within reach.
    """
    area, room = checked(area, room)
    seed = whole_number("seed", seed, 0)
    cells = reachable_cells(area, room)
    if not cells.within_reach.any():
        raise InvalidValue("area", area.tolist(), "a polygon into which the nozzle fits somewhere")
    *_, postures = progress(solve_postures(seed), description="postures")
    prepared = prepare(room, postures)
    lanes = [lane for lane, _ in progress(choose(cells, room, prepared), description="lanes")]
    motions = tour(lanes, prepared.router)
    simulation = CleaningSimulation(room, np.array(room.start), postures.raising[0])
    finished = False
    try:
        for _ in progress(execute(simulation, motions, postures), total=len(motions), description="cleaning"):
            pass
        finished = not simulation.failed
    except KeyboardInterrupt:
        if not simulation.record.times:
            raise
    return judge(simulation, cells, room, lanes, finished)
