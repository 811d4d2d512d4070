"""The only place that knows where models, data and results lie."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MODELS = ROOT / "models"
DATA = ROOT / "data"
REFERENCE = DATA / "reference"
NOTEBOOKS = ROOT / "notebooks"


def results() -> Path:
    """Folder, made when missing, for what a user makes (git-ignored): $TUTORIALBOT_RESULTS, else `results/`."""
    folder = Path(os.environ.get("TUTORIALBOT_RESULTS") or ROOT / "results")
    folder.mkdir(parents=True, exist_ok=True)
    return folder
