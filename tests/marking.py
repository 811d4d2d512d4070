"""Mark one submission, in the process that `grading.py` starts for it: grades no one else, trusts nothing outside.

Of a submission only those top-level statements run that its exercises' functions need.
"""

import argparse
import ast
import dis
import json
import linecache
import os
import resource
import sys
from collections.abc import Iterator
from pathlib import Path
from types import CodeType

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parent.parent)  # the project, and not tests/, where the solutions lie
    sys.modules["tests"] = None

from tutorialbot.checks.mechanism import NOT_ATTEMPTED, Exercise
from tutorialbot.checks.sets import SETS

KEPT = 4_000  # characters of a message
LARGEST = 5_000_000  # bytes of a file that a submission may write
SUBMISSION = 20_000_000  # bytes of a submission


def cells(path: Path) -> list[str]:
    """Return the code of each cell, of a .py file as one; raises ValueError, OSError or RecursionError."""
    if path.stat().st_size > SUBMISSION:
        raise ValueError(f"larger than {SUBMISSION // 1_000_000} MB")
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return [text]
    try:
        found = [cell["source"] for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
        return ["".join(source) for source in found]
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"not a notebook: {error!r}") from None


def statements(sources: list[str]) -> Iterator[tuple[ast.stmt, str]]:
    """Yield the top-level statements of all cells that Python can read, and a file name for each cell."""
    for number, source in enumerate(sources, start=1):
        name = f"<cell {number}>"
        lines = ["" if line.lstrip().startswith(("%", "!", "?")) else line for line in source.splitlines()]
        try:
            tree = ast.parse("\n".join(lines), name)
            compile(tree, name, "exec")
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            print(f"{name} cannot be read: {error}")
            continue
        linecache.cache[name] = (len(source), None, [line + "\n" for line in lines], name)
        yield from ((statement, name) for statement in tree.body)


def bound(statement: ast.stmt) -> set[str]:
    """Return the global names that a statement gives a value; {"*"} for a star import."""
    star = isinstance(statement, ast.ImportFrom) and statement.names[0].name == "*"
    stored = {step.argval for step in _steps(statement) if step.opname in ("STORE_NAME", "STORE_GLOBAL")}
    return {"*"} if star else stored


def used(statement: ast.stmt) -> set[str]:
    """Return the global names that a statement reads, at once or in the functions that it defines."""
    return {step.argval for step in _steps(statement) if step.opname in ("LOAD_NAME", "LOAD_GLOBAL")}


def _steps(statement: ast.stmt) -> Iterator[dis.Instruction]:
    """Yield the bytecode of a statement; of the functions and classes in it what they read alone."""
    waiting = [compile(ast.Module([statement], []), "<statement>", "exec")]
    top = waiting[0]
    while waiting:
        code = waiting.pop()
        yield from (step for step in dis.get_instructions(code) if code is top or step.opname != "STORE_NAME")
        waiting += [constant for constant in code.co_consts if isinstance(constant, CodeType)]


def needed(found: list[tuple[ast.stmt, str]], functions: set[str]) -> list[tuple[ast.stmt, str]]:
    """Return the statements that define the `functions`, each by its last definition, and whatever these need."""
    binds, uses = [bound(statement) for statement, _ in found], [used(statement) for statement, _ in found]
    last = {name: i for i, names in enumerate(binds) for name in names & functions}
    chosen = set(last.values())
    while True:
        wanted = set().union({"*"}, *(uses[i] for i in chosen)) - functions
        further = {i for i, names in enumerate(binds) if names & wanted} - chosen
        if not further:
            return [found[i] for i in sorted(chosen)]
        chosen |= further


def mark_one(path: Path, names: list[str], channel: int, memory: float) -> None:
    """Mark the exercises called `names` of one submission; write a JSON line to `channel` for each.

    memory: the largest address space [GB].
    """

    def tell(exercise: str, outcome: str, check: str = "", message: str = "") -> None:
        line = {"exercise": exercise, "outcome": outcome, "check": check, "message": message[:KEPT]}
        os.write(channel, json.dumps(line).encode() + b"\n")

    judge = Exercise.verdict
    exercises = {exercise.name: exercise for those in SETS.values() for exercise in those}
    limits = {resource.RLIMIT_AS: int(memory * 1e9), resource.RLIMIT_FSIZE: LARGEST, resource.RLIMIT_CORE: 0}
    for kind, size in limits.items():
        resource.setrlimit(kind, (size, size))
    os.write(channel, b"{}\n")  # ready: from here on the clock runs
    try:
        sources = cells(path)
    except (OSError, ValueError, RecursionError) as error:
        for name in names:
            tell(name, "error", "can be read", f"{type(error).__name__}: {error}")
        return
    space: dict = {"__name__": "submission"}
    for statement, name in needed(list(statements(sources)), set(exercises)):
        try:
            exec(compile(ast.Module([statement], []), name, "exec"), space)
        except Exception as error:
            print(f"{name}, line {statement.lineno}: {type(error).__name__}: {error}")
    for name in names:
        function = space.get(name)
        if not callable(function):
            tell(name, NOT_ATTEMPTED, "handed in", f"There is no function called {name}.")
            continue
        verdict = judge(exercises[name], function)
        sys.stdout.flush()
        tell(name, verdict.outcome, verdict.check, verdict.message)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("path", type=Path)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--channel", type=int, required=True)
    parser.add_argument("--memory", type=float, required=True)
    options = parser.parse_args()
    mark_one(options.path, options.names, options.channel, options.memory)
