"""Exercise 8 of notebook 4: open design, a state machine that passes a door whose closer is not what was said."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tutorialbot.checks.counting import ByHand
from tutorialbot.checks.guard import Student, Wrong, show
from tutorialbot.checks.mechanism import Exercise
from tutorialbot.checks.passage_elbow import SEED
from tutorialbot.seeding import make_rng

BUDGET = 100  # actions for one door
ROOM, HIT, ROUND = 60.0, 45.0, 40.0  # door angles [deg]: to drive through, to be hit by it, to reach round its edge
ARM, FALL = 82.0, 15.0  # as far as the knob can be pulled; how far a door that nobody holds shuts in one action [deg]
PLACES = ("before", "doorway 1", "doorway 2", "behind")
ACTIONS = ("grasp", "open", "lean", "release", "reach", "push", "ease", "forward", "wait")


@dataclass(frozen=True)
class Seen:
    """What the robot knows: the door's angle [deg], to one degree; pull [Nm] of the closer where the robot touches the
    door, to 1 Nm, nan where it does not; hand: "free", "knob" or "face"; base: "before", "leaning", "doorway 1",
    "doorway 2" or "behind"; last: what became of the last action, "done", "slipped" or "refused", "" at first; said:
    the hold angle [deg] by the maker's word; left: so many actions are left.
    """

    angle: float
    pull: float
    hand: str
    base: str
    last: str
    said: float
    left: int


@dataclass(frozen=True)
class Closer:
    """A door: it stays open from `hold` on [deg], opens up to `limit` [deg], and shuts by torque + 6 angle [Nm].

    slips, lost: how likely a hand slips, and a reading of the pull is lost; neither happens twice in a row.
    """

    said: float = 85.0
    hold: float = 85.0
    limit: float = 110.0
    torque: float = 8.0
    slips: float = 0.0
    lost: float = 0.0


class Scene:
    """One robot at one door; `act` does an action, `seen` is what the robot knows after it."""

    def __init__(self, door: Closer, rng: np.random.Generator):
        self.door, self.rng = door, rng
        self.angle, self.hand, self.base, self.last = 0.0, "free", "before", ""
        self.done: list[str] = []
        self._slipped = self._was_lost = False

    @property
    def stays(self) -> bool:
        """Whether the door would stay open by itself."""
        return self.angle >= self.door.hold

    @property
    def held(self) -> bool:
        """Whether somebody holds the door."""
        return self.hand != "free" or self.base == "leaning"

    @property
    def over(self) -> bool:
        """Whether the robot is through and the door is shut behind it."""
        return self.base == "behind" and self.hand == "free" and self.angle == 0.0

    def seen(self) -> Seen:
        """Return what the robot knows now."""
        noise, chance = self.rng.uniform(-1.0, 1.0, 2), self.rng.random()
        self._was_lost = chance < self.door.lost and not self._was_lost
        torque = 0.0 if self.stays or self._was_lost else self.door.torque + 6.0 * math.radians(self.angle)
        pull = torque + float(noise[1]) if self.held else math.nan
        angle, left = self.angle + float(noise[0]), BUDGET - len(self.done)
        return Seen(angle, pull, self.hand, self.base, self.last, self.door.said, left)

    def act(self, action: str) -> None:
        """Do one action; raises Wrong by the rule that it breaks."""
        self.done.append(action)
        before = self.hand, self.base, self.angle
        time = getattr(self, f"_{action}")()
        self.last = "done" if self.last == "" else self.last
        if time == 0 and action != "wait":
            self.hand, self.base, self.angle = before
            self.last = "refused"
        for _ in range(max(time, 1)):
            if not self.held and not self.stays:
                self.angle = max(0.0, self.angle - FALL)
            if self.base.startswith("doorway") and self.angle < HIT:
                told = f"the door shuts on the robot, at {show(self.angle)} degrees"
                raise Wrong("nobody is hit", told + self.story())

    def story(self) -> str:
        """Return the door and the last actions as text."""
        door, few = self.door, ", ".join(self.done[-8:])
        told = f"said {show(door.said)} degrees, stays from {show(door.hold)} on, opens up to {show(door.limit)}"
        return f"\nfor a door: {told}; closer {show(door.torque)} Nm. The last of {len(self.done)} actions: {few}"

    # --- actions: how long they take, 0 when they are refused ---------------------------------------------------------
    def _slips(self) -> bool:
        """Whether a hand slips now: it is free then."""
        self._slipped = self.rng.random() < self.door.slips and not self._slipped
        self.last = "slipped" if self._slipped else "done"
        if self._slipped:
            self.hand = "free"
        return self._slipped

    def _move(self, by: float, most: float) -> int:
        """Turn the door, as far as it goes."""
        before, self.last = self.angle, "done"
        self.angle = min(max(0.0, self.angle + by), max(most, self.angle) if by > 0.0 else self.angle)
        return int(self.angle != before)

    def _wait(self) -> int:
        self.last = "done"
        return 1

    def _grasp(self) -> int:
        if self.hand != "free" or self.base not in ("before", "leaning") or self.angle > ARM:
            return 0
        if not self._slips():
            self.hand = "knob"
        return 1

    def _open(self) -> int:
        if self.hand != "knob" or self.base != "before":
            return 0
        return 1 if self._slips() else self._move(float(self.rng.uniform(8.0, 12.0)), min(ARM, self.door.limit))

    def _lean(self) -> int:
        self.last = "done"
        fine = self.base == "before" and self.angle >= ROOM and (self.hand == "knob" or self.stays)
        self.base = "leaning" if fine else self.base
        return int(fine)

    def _release(self) -> int:
        free, self.hand, self.last = self.hand == "free", "free", "done"
        return int(not free)

    def _reach(self) -> int:
        falling = self.base == "before" and not self.stays
        if self.hand != "free" or self.angle < ROUND or falling:
            return 0
        self.hand, self.last = "face", "done"
        return 1

    def _push(self) -> int:
        return self._move(float(self.rng.uniform(8.0, 12.0)), self.door.limit) if self.hand == "face" else 0

    def _ease(self) -> int:
        return self._move(-float(self.rng.uniform(8.0, 12.0)), 0.0) if self.hand != "free" else 0

    def _forward(self) -> int:
        if self.hand == "knob" or self.base == "behind":
            return 0
        if self.angle < ROOM:
            told = f"the way through is too narrow at {show(self.angle)} degrees: the base touches the door"
            raise Wrong("room", told + self.story())
        here = 0 if self.base == "leaning" else PLACES.index(self.base)
        self.base = PLACES[here + 1]
        if self.hand == "face":
            self._slips()
        else:
            self.last = "done"
        return 1


def pass_door(answer: Callable, door: Closer, rng: np.random.Generator) -> Scene:
    """Let `answer(seen, memory)` pass one door; raises Wrong by the rule that was broken."""
    scene, memory = Scene(door, rng), {}
    while not scene.over:
        if len(scene.done) == BUDGET:
            rule = "shut behind" if scene.base == "behind" else "through"
            raise Wrong(rule, f"after {BUDGET} actions the base is {scene.base!r}, the door open by "
                        f"{show(scene.angle)} degrees{scene.story()}")  # fmt: skip
        action = answer(scene.seen(), memory)
        if not isinstance(action, str) or action not in ACTIONS:
            raise Wrong("known action", f"{show(action)} is none of {', '.join(ACTIONS)}")
        scene.act(action)
    return scene


TRIALS = (
    ("as said", "The door is what was said, and no hand slips.", {}),
    ("stays later", "It was said to stay from 70 on, and does later. Feel the pull instead of trusting.",
     {"said": (70.0, 70.0), "hold": (72.0, 108.0)}),
    ("never stays", "It stays nowhere: somebody has to hold it all the way.", {"hold": (200.0, 200.0)}),
    ("stays earlier", "It stays from less than what was said on: to let go behind it is not enough to shut it.",
     {"hold": (40.0, 80.0)}),
    ("opens little", "It opens less far than most, yet far enough.", {"limit": (63.0, 70.0), "hold": (60.0, 100.0)}),
    ("lost readings", "A reading of the pull may be lost and says zero, but never twice in a row.",
     {"lost": (0.4, 0.4), "hold": (60.0, 120.0)}),
    ("slips", "A hand may slip, on the knob or on the push face; the door then begins to shut.",
     {"slips": (0.15, 0.15), "hold": (75.0, 120.0)}),
    ("any door", "Any door: all of this together.",
     {"said": (65.0, 95.0), "hold": (40.0, 120.0), "limit": (63.0, 115.0), "torque": (4.0, 12.0),
      "slips": (0.0, 0.12), "lost": (0.0, 0.3)}),
    ("slips behind", "A hand may slip just as the robot gets behind. If the door stays open there, nobody shuts it.",
     {"slips": (0.2, 0.2), "hold": (40.0, 58.0)}),
)  # fmt: skip
DOORS = 20  # of each kind


def _judge_passing(student: Student) -> None:
    rng, ask = make_rng(SEED, 8), ByHand(student)
    for name, reason, ranges in TRIALS:
        for _ in range(DOORS):
            door = Closer(**{key: float(rng.uniform(*ends)) for key, ends in ranges.items()})
            try:
                pass_door(ask, door, rng)
            except Wrong as wrong:
                if wrong.check in ("nobody is hit", "room", "through", "shut behind"):
                    raise Wrong(f"{name}: {wrong.check}", f"{reason}\n{wrong.reason}") from None
                raise


next_action = Exercise(
    "next_action",
    "a state machine that passes a door whose closer, limits and hands are not what was said.",
    (
        "Begin with a door that never stays: grasp, open to 61 or more, lean, release, reach, forward three times,"
        " release, wait. `seen` tells in which state you are; what has to be true before you go on from it?",
        "Recovery: a hand that is free where it ought not to be. Before the door: grasp again. In the doorway: reach at"
        " once, then push to 61 or more before the next forward. An `open` that is refused means: no further.",
        "Leaning and reaching is right for every door, so the pull need not be known before you are behind. There a"
        " door may stay open: ease until you feel it pull, then release. A pull of zero may be a lost reading, one of"
        " three is none. And if you slipped behind it, look whether the angle falls: memory['angle'] = seen.angle.",
    ),
    _judge_passing,
    limit=5.0,
)
