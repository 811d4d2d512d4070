"""Four Japanese robotics papers, made into notebooks that run on real physics.

This file uses the standard library alone: `python3 -m tutorialbot` must start before anything is installed.
"""

__version__ = "0.1.0"
