"""The exercises of notebook 2 (paper 2: a seven-axis arm, and evolution), from recall to open design."""

from tutorialbot.checks.arm_evolution import expected_children, step_by_difference
from tutorialbot.checks.arm_kinematics import both_tilts, tip_jacobian, turn_all
from tutorialbot.checks.arm_optimum import best_posture, costliest_limit
from tutorialbot.checks.mechanism import remember_tools

__all__ = ["EXERCISES"]

EXERCISES = (
    expected_children,
    turn_all,
    tip_jacobian,
    both_tilts,
    step_by_difference,
    costliest_limit,
    best_posture,
)
remember_tools()
