"""The grader: right marks, a limit on everything, no submission harms another, and it goes on where it stopped."""

import ast
import csv
import inspect
import json
import os
import signal
import subprocess
import sys
import time

import nbformat
import pytest

from tests import grading, marking
from tests.exercises.sets import PLANTED, SOLUTIONS
from tutorialbot.paths import ROOT

NAMES = list(SOLUTIONS)
IMPORTS = [inspect.getsource(planted.solutions).partition("\n\n\ndef ")[0] for planted in PLANTED.values()]


def solved(*names):
    return "\n\n\n".join([*IMPORTS, *(inspect.getsource(SOLUTIONS[name]) for name in names)])


def notebook(path, *sources):
    cells = [nbformat.v4.new_code_cell(source) for source in sources]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), path)


def command(folder, *options):
    return [sys.executable, str(ROOT / "tests" / "grading.py"), str(folder), *options]


def grade(folder, *options):
    return subprocess.run(command(folder, *options), capture_output=True, text=True)


def marks(folder):
    with (folder / "marks" / "marks.csv").open(newline="") as file:
        return {row["submission"]: row for row in csv.DictReader(file)}


def test_good_stub_and_broken_submissions_get_their_marks(tmp_path):
    heavy = "result = [sum(range(10**9)) for _ in range(10**6)]"  # nothing needs it: it never runs
    mine = [solved("lengths"), f"%matplotlib inline\n{solved('mended_cost')}", "exercises.lengths.check(lengths)"]
    stub = "def base_twist(*_):\n    raise NotImplementedError"
    notebook(tmp_path / "good.ipynb", *mine, heavy, stub, "def goal(start: broken")
    (tmp_path / "broken.ipynb").write_text('{"cells": [')
    done = grade(tmp_path)
    assert done.returncode == 0, done.stderr
    rows = marks(tmp_path)
    right = {name for name in NAMES if rows["good.ipynb"][name] == "correct"}
    assert right == {"lengths", "mended_cost"}
    assert rows["good.ipynb"]["correct"] == "2"
    assert rows["good.ipynb"]["base_twist"] == "not attempted"
    assert {rows["broken.ipynb"][name] for name in NAMES} == {"error"}
    text = (tmp_path / "marks" / "good.ipynb.md").read_text()
    assert "2 of 10 exercises `door` are correct" in text and "Nothing of the exercises `arm`" in text
    assert "2 of 10  good.ipynb" in done.stdout
    assert "<cell 6> cannot be read" in text
    assert "JSONDecodeError" in (tmp_path / "marks" / "broken.ipynb.md").read_text()


def test_one_submission_may_hold_the_exercises_of_both_notebooks(tmp_path):
    mine = [solved("lengths"), solved("expected_children", "both_tilts"), "def turn_all(q, v):\n    return v"]
    notebook(tmp_path / "both.ipynb", *mine)
    notebook(tmp_path / "second.ipynb", *mine[1:])
    done = grade(tmp_path)
    assert "3 of 17  both.ipynb" in done.stdout and "2 of 7  second.ipynb" in done.stdout
    rows = marks(tmp_path)
    assert {name for name in NAMES if rows["both.ipynb"][name] == "correct"} == {
        "lengths", "expected_children", "both_tilts"
    }  # fmt: skip
    assert rows["both.ipynb"]["turn_all"] == "incorrect"
    text = (tmp_path / "marks" / "second.ipynb.md").read_text()
    assert "Nothing of the exercises `door`" in text and "turn_all: incorrect (one turn)" in text


def test_only_what_is_needed_runs():
    wanted = ["import numpy as np", "n = 2", "m = n * 2", "def f(x):\n    return m * np.abs(x)"]
    source = "\n".join([wanted[0], "import os", wanted[1], "print('loud')", "np.pi = 3", *wanted[2:], "z = 1 / 0"])
    chosen = marking.needed(list(marking.statements([source])), {"f"})
    assert [ast.unparse(statement) for statement, _ in chosen] == wanted


def test_a_name_used_twice_drags_nothing_along():
    source = "f = slow()\nx = slow()\ndef f(x):\n    y = x\n    return y\ny = slow()"
    chosen = marking.needed(list(marking.statements([source])), {"f"})
    assert [ast.unparse(statement) for statement, _ in chosen] == ["def f(x):\n    y = x\n    return y"]


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ("for i in x: y = i", {"i", "y"}),
        ("import a.b as c, d.e", {"c", "d"}),
        ("a, (b, *c) = x", {"a", "b", "c"}),
        ("try:\n    import q\nexcept ImportError:\n    q = None", {"q"}),
        ("from m import *", {"*"}),
    ],
)
def test_names_are_found_wherever_a_statement_binds_them(source, names):
    assert marking.bound(ast.parse(source).body[0]) == names


def test_what_is_no_verdict_is_dropped():
    good = {"exercise": "mended_cost", "outcome": "correct", "check": "", "message": ""}
    assert grading._verdict(json.dumps(good).encode(), "mended_cost") == good
    for line in (b"\xff", b"[]", b"{}", b"3", b"[" * 100_000, json.dumps({**good, "outcome": "best"}).encode()):
        assert grading._verdict(line, "mended_cost") is None
    assert grading._verdict(json.dumps(good).encode(), "goal") is None


def test_marks_are_safe_to_open_in_a_spreadsheet(tmp_path):
    verdicts = [{"outcome": "correct"}]
    grading.write_csv(tmp_path / "marks.csv", [{"submission": "=cmd.py", "verdicts": verdicts}], ["x"])
    assert (tmp_path / "marks.csv").read_text().splitlines()[1] == "'=cmd.py,1,correct"


@pytest.mark.parametrize("folder", ["nowhere", "."])
def test_nothing_to_mark_is_said_in_one_line(tmp_path, folder):
    done = grade(tmp_path / folder)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1


HANGS = """
import signal, time
def lengths(c5):
    signal.setitimer(signal.ITIMER_REAL, 0)
    while True:
        time.sleep(1)
"""
FORKS = """
import os, time
def lengths(c5):
    if os.fork() == 0:
        time.sleep(1000)
    os._exit(0)
"""
PATCHES = """
from tutorialbot.checks import mechanism
def lengths(c5):
    mechanism.Exercise.verdict = lambda self, f: mechanism.Verdict(self.name, "correct")
    return 0, 0
def two_numbers(v):
    return 0, 0
"""
COPIES = """
def lengths(c5):
    from tests.exercises import solutions_door
    return solutions_door.lengths(c5)
"""
CRASHES = "import os\ndef lengths(c5): os.kill(os.getpid(), 11)\n"
PRINTS = "import os\ndef lengths(c5):\n    while True: os.write(1, b'x' * 65536)\n"
EATS = "import numpy as np\ndef lengths(c5): return np.ones(10**10)\n"
LEAVES = "import sys\nstop = sys.exit(0)\ndef lengths(c5): return stop\n"
FORGES = """
import os
def lengths(c5):
    while True:
        for channel in range(3, 20):
            try:
                os.write(channel, b"{}\\n")
            except OSError:
                pass
"""
BAD = {
    "forges.py": (FORGES, "lengths", "stays alive"),
    "hangs.py": (HANGS, "lengths", "time limit"),
    "crashes.py": (CRASHES, "lengths", "stays alive"),
    "prints.py": (PRINTS, "lengths", "little output"),
    "eats.py": (EATS, "lengths", "runs without an error"),
    "forks.py": (FORKS, "lengths", "stays alive"),
    "patches.py": (PATCHES, "two_numbers", "tools left alone"),
    "copies.py": (COPIES, "lengths", "runs without an error"),
    "leaves.py": (LEAVES, "lengths", "stays alive"),
}


@pytest.mark.full
def test_a_submission_that_harms_harms_no_other(tmp_path):
    for name, (source, *_) in BAD.items():
        (tmp_path / name).write_text(source + solved("base_twist"))
    (tmp_path / "zz_good.py").write_text(solved(*NAMES))
    done = grade(tmp_path, "--seconds", "40")
    assert done.returncode == 0, done.stderr
    rows = marks(tmp_path)
    assert rows["zz_good.py"]["correct"] == str(len(NAMES))
    for name, (_, exercise, check) in BAD.items():
        text = (tmp_path / "marks" / f"{name}.md").read_text()
        assert f"## {exercise}: {'incorrect' if 'left' in check else 'error'} ({check})" in text, name
        assert rows[name][exercise] != "correct"
        assert len(text) < 60_000
    assert {rows[name]["base_twist"] for name in BAD} - {"correct"} <= {"incorrect", "error"}
    assert [rows[name]["base_twist"] for name in ("hangs.py", "crashes.py", "prints.py", "eats.py", "forks.py")] == [
        "correct"
    ] * 5


@pytest.mark.full
def test_a_killed_grader_goes_on_where_it_stopped(tmp_path):
    for i in range(3):
        (tmp_path / f"s{i}.py").write_text(solved("lengths") + f"\n# {i}\n")
    first = subprocess.Popen(
        command(tmp_path), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    limit = time.monotonic() + 120
    while not (tmp_path / "marks" / "s0.py.md").exists() and time.monotonic() < limit:
        time.sleep(0.05)
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    journal = tmp_path / "marks" / "journal.jsonl"
    before = journal.read_text().splitlines()
    assert 2 <= len(before) < 4
    (tmp_path / "s0.py").write_text(solved("lengths", "base_twist"))
    assert grade(tmp_path).returncode == 0
    after = journal.read_text().splitlines()
    assert after[: len(before)] == before
    assert [marks(tmp_path)[f"s{i}.py"]["correct"] for i in range(3)] == ["2", "1", "1"]
    assert sum('"s1.py"' in line for line in after) == 1
