"""Committed notebooks carry no outputs, except the short tables that nbval compares."""

from pathlib import Path

import nbformat
import nbstripout

from tutorialbot.errors import BrokenFile

KEEP = "keep_output"  # the tag of a cell whose stored table is checked (# NBVAL_CHECK_OUTPUT)
EXTRA = ["metadata.language_info", "cell.metadata.execution", "cell.metadata.collapsed", "cell.metadata.scrolled"]


def stripped(path: Path) -> str:
    """Return the text of the notebook at `path` as it should be committed; raises BrokenFile when it is none.

    Outputs go, except those of cells tagged keep_output, which also keep a count: nbval refuses a table without one.
    """
    try:
        notebook = nbformat.read(path, as_version=4)
    except Exception as error:  # nbformat raises whatever its JSON reader and its validator raise
        raise BrokenFile(f"{path}: no notebook, or a damaged one: {error}") from None
    notebook = nbstripout.strip_output(notebook, keep_output=False, keep_count=False, keep_id=False, extra_keys=EXTRA)
    for cell in notebook.cells:
        if cell.cell_type == "code" and cell.outputs and KEEP in cell.metadata.get("tags", []):
            cell.execution_count = 1
    return nbformat.writes(notebook) + "\n"


def strip(path: Path) -> bool:
    """Strip the notebook at `path` in place; returns whether that changed it."""
    text = stripped(path)
    changed = text != path.read_text(encoding="utf-8")
    if changed:
        path.write_text(text, encoding="utf-8")
    return changed
