"""The exercises of notebook 3 (paper 3: from voxels to the C-space), from recall to open design."""

from tutorialbot.checks.cspace_descent import downhill_values
from tutorialbot.checks.cspace_grids import from_own_angles, points_to_voxels
from tutorialbot.checks.cspace_motion import steps_so_fine
from tutorialbot.checks.cspace_numbers import affordable_joints, loss_from_logits, pays_from
from tutorialbot.checks.cspace_rectangles import turned_rectangles_meet
from tutorialbot.checks.mechanism import remember_tools

__all__ = ["EXERCISES"]

EXERCISES = (
    affordable_joints,
    turned_rectangles_meet,
    from_own_angles,
    points_to_voxels,
    loss_from_logits,
    steps_so_fine,
    pays_from,
    downhill_values,
)
remember_tools()
