"""Committed notebooks are stripped, readable and short; and the notebook tests themselves can fail."""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import nbclient
import nbformat
import pytest

from tutorialbot import commands, stripping
from tutorialbot.errors import BrokenFile
from tutorialbot.paths import NOTEBOOKS, ROOT

PAGES = sorted(NOTEBOOKS.glob("*.ipynb"))
LONGEST_CELL, MOST_CELLS, BIGGEST = 40, 42, 256 * 1024


def code_cells(path: Path) -> list[dict]:
    return [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]


def source(cell: dict) -> str:
    return "".join(cell["source"])


def output_text(cell: dict) -> str:
    return "".join("".join(out.get("text") or out.get("data", {}).get("text/plain") or "") for out in cell["outputs"])


def untidy(path: Path) -> list[str]:
    """Return what is wrong with the cells of a notebook, one line each."""
    wrong, cells = [], code_cells(path)
    for number, cell in enumerate(cells):
        kept = "keep_output" in cell["metadata"].get("tags", [])
        checked = "# NBVAL_CHECK_OUTPUT" in source(cell)
        if len(source(cell).splitlines()) > LONGEST_CELL:
            wrong.append(f"cell {number} has more than {LONGEST_CELL} lines")
        if kept != checked:
            wrong.append(f"cell {number}: the tag keep_output and the marker NBVAL_CHECK_OUTPUT belong together")
        if checked and not output_text(cell).strip():
            wrong.append(f"cell {number} checks an output that is not stored: it would check nothing")
        if kept and len(output_text(cell)) > 4000:
            wrong.append(f"cell {number} keeps more than a short table")
    taught = [cell for cell in cells if "exercises" not in source(cell)]
    if len(taught) > MOST_CELLS:
        wrong.append(f"{len(taught)} code cells, more than {MOST_CELLS}")
    return wrong


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_notebooks_are_stripped(path):
    assert path.read_text(encoding="utf-8") == stripping.stripped(path), "run `python3 -m tutorialbot strip`"


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_notebooks_are_tidy(path):
    assert untidy(path) == []
    assert path.stat().st_size < BIGGEST


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_links_lead_somewhere(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    text = "\n".join(source(cell) for cell in cells if cell["cell_type"] == "markdown")
    links = [link.partition("#")[0] for link in re.findall(r"\]\((?!https?:|#)([^)\s]+)\)", text)]
    assert [link for link in links if not (path.parent / link).exists()] == []


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_notebooks_begin_with_a_title_and_japanese(path):
    first = json.loads(path.read_text(encoding="utf-8"))["cells"][:4]
    text = "\n".join(source(cell) for cell in first if cell["cell_type"] == "markdown")
    assert text.startswith("# ") and re.search(r"[\u3040-\u30ff\u4e00-\u9fff]{10}", text)


def test_every_notebook_parses_as_python():
    for path in PAGES:
        for cell in code_cells(path):
            ast.parse(re.sub(r"(?m)^(\s*)[%!].*$", r"\1pass", source(cell)))


# --- the tests of the tests ------------------------------------------------------------------------------------------

TABLE = "# NBVAL_CHECK_OUTPUT\nprint('sections 6')"


def a_notebook(path: Path, *cells: tuple[str, str], tags=("keep_output",)) -> Path:
    """Write a notebook of (source, stored output) cells."""
    made = []
    for text, stored in cells:
        cell = nbformat.v4.new_code_cell(text, metadata={"tags": list(tags) if stored else []})
        cell.outputs = [nbformat.v4.new_output("stream", name="stdout", text=stored)] if stored else []
        cell.execution_count = 1 if stored else None
        made.append(cell)
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    nbformat.write(nbformat.v4.new_notebook(cells=made, metadata=kernel), path)
    return path


def nbval(*paths: Path) -> tuple[int, str]:
    command = [sys.executable, "-m", "pytest", "-q", *commands.NBVAL, "-p", "no:cacheprovider", *map(str, paths)]
    done = subprocess.run(command, cwd=paths[0].parent, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    return done.returncode, done.stdout


def test_nbval_sees_a_falsified_table_and_a_failing_assert(tmp_path):
    good = a_notebook(tmp_path / "good.ipynb", (TABLE, "sections 6\n"), ("assert 1 + 1 == 2", ""))
    falsified = a_notebook(tmp_path / "falsified.ipynb", (TABLE, "sections 5\n"))
    failing = a_notebook(tmp_path / "failing.ipynb", ("assert 1 + 1 == 3, 'planted'", ""))
    status, text = nbval(good, falsified, failing)
    assert status == 1 and re.search(r"2 failed, 2 passed", text), text
    assert "falsified.ipynb::Cell 0" in text and "failing.ipynb::Cell 0" in text


@pytest.mark.full
@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_every_stored_table_is_really_compared(path, tmp_path, monkeypatch):
    content = nbformat.read(path, as_version=4)
    tables = [cell for cell in content.cells if "keep_output" in cell.metadata.get("tags", [])]
    for cell in tables:
        cell.outputs[0]["text"] = re.sub(
            r"\d(?=\D*$)", lambda d: str((int(d[0]) + 1) % 10), cell.outputs[0]["text"], count=1
        )
    falsified = tmp_path / path.name
    nbformat.write(content, falsified)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    status, text = nbval(falsified)
    failed = re.findall(r"^FAILED .*::Cell", text, flags=re.MULTILINE)
    assert len(failed) == len(tables) and bool(status) == bool(tables), text


@pytest.mark.full
def test_the_switches_of_notebook_1_break_what_they_say():
    """Committed, they are off. On, each shows its fault, and nothing else in the notebook falls over."""
    page = nbformat.read(NOTEBOOKS / "01_door_opening.ipynb", as_version=4)
    switches = [i for i, cell in enumerate(page.cells) if cell.source.count("BROKEN = False  # the switch")]
    page.cells = page.cells[: switches[-1] + 1]
    for i in switches:
        page.cells[i].source = page.cells[i].source.replace("BROKEN = False", "BROKEN = True")
    nbclient.NotebookClient(page, timeout=600, resources={"metadata": {"path": str(NOTEBOOKS)}}).execute()
    tare, late, alias = (output_text(page.cells[i]) for i in switches)
    assert re.search(r"^not tared .*first \[.* 5\.\d\] N", tare, flags=re.MULTILINE), tare
    stands = [float(angle) for angle in re.findall(r"stands at (-?\d+) deg", late)]
    assert stands[0] > 10 and stands[1] < 1, late
    assert re.findall(r"(.*) PENALTY", alias) == ["psi = d/R           75 ->  90 deg: f_b = +1 s"], alias


def test_the_tidiness_check_sees_planted_faults(tmp_path):
    empty = a_notebook(tmp_path / "empty.ipynb", (TABLE, ""))
    content = nbformat.read(empty, as_version=4)
    content.cells[0].metadata["tags"] = ["keep_output"]
    nbformat.write(content, empty)
    assert untidy(empty) == ["cell 0 checks an output that is not stored: it would check nothing"]
    untagged = a_notebook(tmp_path / "untagged.ipynb", (TABLE, "sections 6\n"), tags=())
    assert "belong together" in untidy(untagged)[0]
    long = a_notebook(tmp_path / "long.ipynb", ("x = 1\n" * (LONGEST_CELL + 1), ""))
    assert untidy(long) == [f"cell 0 has more than {LONGEST_CELL} lines"]
    many = a_notebook(tmp_path / "many.ipynb", *[("x = 1", "")] * (MOST_CELLS + 1))
    assert untidy(many) == [f"{MOST_CELLS + 1} code cells, more than {MOST_CELLS}"]


def test_stripping_removes_an_output_and_keeps_a_table_that_nbval_compares(tmp_path):
    page = a_notebook(tmp_path / "page.ipynb", (TABLE, "sections 6\n"), ("x = 1", ""))
    content = nbformat.read(page, as_version=4)
    content.cells[0].execution_count = 17
    content.cells[1].outputs = [nbformat.v4.new_output("stream", name="stdout", text="left behind")]
    nbformat.write(content, page)
    assert stripping.strip(page) and not stripping.strip(page)
    assert "sections 6" in page.read_text() and "left behind" not in page.read_text() and "17" not in page.read_text()
    assert nbval(page)[0] == 0
    page.write_text(page.read_text().replace("sections 6\\n", "sections 5\\n"))
    assert nbval(page)[0] == 1


def test_a_damaged_notebook_is_named(tmp_path):
    page = a_notebook(tmp_path / "page.ipynb", ("x = 1", ""))
    page.write_text(page.read_text()[:-30])
    with pytest.raises(BrokenFile, match="page.ipynb: no notebook, or a damaged one"):
        stripping.strip(page)
