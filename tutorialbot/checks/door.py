"""The exercises of notebook 1 (paper 1: a door, a hand, and Bayesian optimisation), from recall to open design."""

from tutorialbot.checks.door_motion import Robot, open_the_door
from tutorialbot.checks.door_section import find_direction
from tutorialbot.checks.door_sensing import base_twist, distance_seen_from, mended_cost, time_to_collision
from tutorialbot.checks.door_space import goal, lengths, two_numbers, way_between
from tutorialbot.checks.mechanism import remember_tools

__all__ = ["EXERCISES", "Robot"]

EXERCISES = (
    lengths,
    two_numbers,
    goal,
    way_between,
    time_to_collision,
    mended_cost,
    distance_seen_from,
    base_twist,
    find_direction,
    open_the_door,
)
remember_tools()
