"""The only place that knows where models, data and results lie, and which code makes results."""

import hashlib
import os
from pathlib import Path

from tutorialbot.errors import InvalidValue

ROOT = Path(__file__).resolve().parent.parent
MODELS = ROOT / "models"
DATA = ROOT / "data"
REFERENCE = DATA / "reference"
NOTEBOOKS = ROOT / "notebooks"
METHODS = ("bo", "ik", "scene", "pose.py", "robots.py", "seeding.py", "trajectory.py")  # what `source_digest` reads


def results() -> Path:
    """Folder, made when missing, for what a user makes (git-ignored): $TUTORIALBOT_RESULTS, else `results/`.

    Raises InvalidValue when it cannot be made.
    """
    folder = Path(os.environ.get("TUTORIALBOT_RESULTS") or ROOT / "results")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidValue("TUTORIALBOT_RESULTS", str(folder), f"a folder ({error.strerror})") from None
    return folder


def source_digest(methods: tuple[str, ...] | None = None) -> str:
    """Return a hash of all that decides what a search finds: the methods' code (METHODS unless given) and the models.

    It stands in the headers of journals, so that what other code has measured is never mixed in. What only draws,
    prints or checks is left out.
    """
    rooms = [ROOT / "tutorialbot" / room for room in (METHODS if methods is None else methods)]
    files = [file for room in rooms for file in ([room] if room.is_file() else room.rglob("*.py"))]
    digest = hashlib.sha256()
    for file in sorted([*files, *MODELS.rglob("*.xml")]):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
