"""A verdict and a hint are shown once, wherever their line stands: in a notebook, in a script, at a prompt."""

import subprocess
import sys

import nbformat
import pytest
from nbclient import NotebookClient

from tutorialbot.paths import ROOT

SETUP = "from tutorialbot.checks import door as exercises\ndef lengths(c5): raise NotImplementedError"
CHECK = "exercises.lengths.check(lengths)"
CELLS = {
    "last line": CHECK,
    "not the last line": f"{CHECK}\nafter = 1",
    "in a loop": f"for _ in range(1):\n    {CHECK}",
    "kept in a name": f"kept = {CHECK}",
    "semicolon": f"{CHECK};",
}


def test_a_notebook_shows_the_verdict_once_wherever_the_check_stands():
    cells = [nbformat.v4.new_code_cell(source) for source in (SETUP, *CELLS.values(), "exercises.lengths.hint()\n1;")]
    page = nbformat.v4.new_notebook(cells=cells)
    NotebookClient(page, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(ROOT)}}).execute()
    _, *checked, hinted = page.cells
    for where, cell in zip(CELLS, checked, strict=True):
        pictures = [output["data"] for output in cell.outputs]
        assert len(pictures) == 1, where
        assert "<b>lengths</b>" in pictures[0]["text/html"] and "not attempted" in pictures[0]["text/html"], where
    assert [output["data"]["text/plain"].splitlines()[-1] for output in hinted.outputs] == ["(2 more)"]


@pytest.mark.parametrize("how", [["-"], ["-i", "-q"], ["-m", "IPython", "--simple-prompt", "--no-banner", "--quick"]])
def test_a_terminal_shows_the_verdict_once(how, tmp_path):
    lines = f"{SETUP.splitlines()[0]}\nlengths = lambda c5: exec('raise NotImplementedError')\n{CHECK}\nafter = 1\n"
    env = {"PYTHONPATH": str(ROOT), "IPYTHONDIR": str(tmp_path), "PATH": "", "OMP_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, *how], input=lines, capture_output=True, text=True, cwd=tmp_path, env=env)
    assert done.stdout.count("lengths: not attempted") == 1, done.stdout + done.stderr
