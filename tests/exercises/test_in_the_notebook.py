"""Each notebook asks all its exercises, untouched stubs pass, and each solution in its stub's place is correct."""

import inspect
import re
from functools import cache

import nbformat
import pytest

from tests import marking
from tests.exercises.sets import OF_SET, PLANTED, SOLUTIONS


@cache
def cells(title):
    """Return the source of the code cells of the notebook that holds the exercises `title`."""
    page = nbformat.read(PLANTED[title].page, as_version=4)
    return [cell.source for cell in page.cells if cell.cell_type == "code"]


def stub_and_setup(title, name):
    """Return the exercise's cell and the cell that imports the exercises."""
    stubs = [source for source in cells(title) if f"exercises.{name}.check({name})" in source]
    setup = [source for source in cells(title) if f"import {title} as exercises" in source]
    assert (len(stubs), len(setup)) == (1, 1)
    return stubs[0], setup[0]


def run(setup, cell):
    """Run both cells: the verdict is printed."""
    space = {"__name__": "__main__"}
    exec(compile(setup, "setup", "exec"), space)
    exec(compile(cell, "exercise", "exec"), space)


@pytest.mark.parametrize(("title", "name"), OF_SET)
def test_the_untouched_stub_is_not_attempted(title, name, capsys):
    stub, setup = stub_and_setup(title, name)
    assert "raise NotImplementedError" in stub
    run(setup, stub)
    assert capsys.readouterr().out.startswith(f"{name}: not attempted\n")


@pytest.mark.parametrize(("title", "name"), OF_SET)
def test_the_solution_in_the_stubs_place_is_correct(title, name, capsys):
    stub, setup = stub_and_setup(title, name)
    wanted = re.search(rf"def {name}\((.*)\):", stub)
    assert wanted[1].split(", ") == list(inspect.signature(SOLUTIONS[name]).parameters)
    head, _, tail = stub.partition(f"def {name}(")
    body = tail[tail.index(f"exercises.{name}.check") :]
    run(setup, f"{head}{inspect.getsource(SOLUTIONS[name])}\n\n{body}")
    assert capsys.readouterr().out == f"{name}: correct\n"


@pytest.mark.parametrize(("title", "name"), OF_SET)
def test_no_solution_stands_in_the_notebook(title, name):
    body = inspect.getsource(SOLUTIONS[name]).partition("\n")[2]
    assert body not in "\n".join(cells(title))


def taught_names(cells):
    """Return the global names that the cells of the sections, all but the exercises, define or read."""
    found = [statement for statement, _ in marking.statements([cell for cell in cells if "exercises" not in cell])]
    return set().union(*map(marking.bound, found), *map(marking.used, found))


@pytest.mark.parametrize("title", PLANTED)
def test_no_exercise_takes_a_name_of_the_sections(title):
    """Else a section that is run again after the exercises would call the student's function."""
    taught = taught_names(cells(title))
    assert PLANTED[title].taught <= taught
    assert taught & {exercise.name for exercise in PLANTED[title].exercises} == set()


def test_a_name_that_is_taken_is_seen():
    sections = [
        "def distance(a):\n    return a",
        "for cost in (1, 2):\n    print(later)",
        "use = lambda goal: goal + far",
    ]
    taught = taught_names([*sections, "def lengths(c5): ...\n\n\nexercises.lengths.check(lengths)"])
    assert taught == {"distance", "cost", "print", "later", "use", "far"}
