"""The exercises of notebook 1 (paper 1: a door, a hand, and Bayesian optimisation), from recall to open design."""

from tutorialbot.checks.door_motion import Robot, open_the_door
from tutorialbot.checks.door_section import find_direction
from tutorialbot.checks.door_sensing import caster, cost, distance, time_to_collision
from tutorialbot.checks.door_space import direction, goal, lengths, way_between
from tutorialbot.checks.mechanism import remember_tools

__all__ = [
    "EXERCISES",
    "Robot",
    "caster",
    "cost",
    "direction",
    "distance",
    "find_direction",
    "goal",
    "lengths",
    "open_the_door",
    "time_to_collision",
    "way_between",
]

EXERCISES = (
    lengths,
    direction,
    goal,
    way_between,
    time_to_collision,
    cost,
    distance,
    caster,
    find_direction,
    open_the_door,
)
remember_tools()
