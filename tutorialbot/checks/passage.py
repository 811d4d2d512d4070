"""The exercises of notebook 4 (paper 4: through the door and through the singularity), from recall to open design."""

from tutorialbot.checks.mechanism import remember_tools
from tutorialbot.checks.passage_door import next_action
from tutorialbot.checks.passage_elbow import offset_elbow, orders_for_phases, smooth_scale
from tutorialbot.checks.passage_paths import fate_on_arc, follow_twist
from tutorialbot.checks.passage_sharing import least_share
from tutorialbot.checks.passage_swap import swap_signs

__all__ = ["EXERCISES"]

EXERCISES = (
    orders_for_phases,
    offset_elbow,
    smooth_scale,
    fate_on_arc,
    follow_twist,
    least_share,
    swap_signs,
    next_action,
)
remember_tools()
