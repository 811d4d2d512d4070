"""Paper 2's whole task, from a polygon on the floor to a floor that is clean."""

from tutorialbot.cleaning.task import CleaningRun, plan

__all__ = ["CleaningRun", "plan"]
