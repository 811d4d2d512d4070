"""The verbs of the command line, inside the environment. Each imports what it needs when it is called."""

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path

from tutorialbot.paths import NOTEBOOKS, ROOT, results

FIRST_PAGE = "00_start_here.ipynb"
NBVAL = ["--nbval-lax", "--nbval-current-env", "--nbval-cell-timeout=600"]


def notebooks() -> list[Path]:
    """Return the notebooks in reading order."""
    return sorted(NOTEBOOKS.glob("*.ipynb"))


def lab_command(further: list[str]) -> list[str]:
    """Return the command that starts JupyterLab on the loopback address, with its token, at the first page."""
    command = [sys.executable, "-m", "jupyterlab", "--ServerApp.ip=127.0.0.1", f"--ServerApp.root_dir={ROOT}"]
    command += [f"--LabApp.default_url=/lab/tree/notebooks/{FIRST_PAGE}"]
    as_root = ["--ServerApp.allow_root=True"] if os.geteuid() == 0 else []
    return command + as_root + further


@dataclass
class Tally:
    """What one step of the tests came to."""

    name: str
    passed: int = 0
    failed: int = 0
    skipped: list[str] = field(default_factory=list)  # one reason for each skipped test
    seconds: float = 0.0

    def line(self) -> str:
        """Return one line for the summary."""
        counts = f"{self.passed} passed, {self.failed} failed, {len(self.skipped)} skipped"
        return f"{self.name:<10} {'ok' if not self.failed else 'FAILED':<7} {self.seconds:6.1f} s   {counts}"


def read_tally(name: str, junit: Path, status: int, seconds: float) -> Tally:
    """Count what pytest wrote to `junit`; a run that ended badly without a failed test counts as one failure."""
    tally = Tally(name, seconds=seconds)
    try:
        cases = list(ElementTree.parse(junit).iter("testcase"))
    except (OSError, ElementTree.ParseError):
        cases = []
    for case in cases:
        skip = case.find("skipped")
        if case.find("failure") is not None or case.find("error") is not None:
            tally.failed += 1
        elif skip is not None and skip.get("type") == "pytest.skip":
            tally.skipped.append(skip.get("message") or "no reason given")
        else:
            tally.passed += 1
    if status and not tally.failed:
        tally.failed = 1
    return tally


def _pytest(name: str, folder: Path, *arguments: str) -> Tally:
    """Run pytest on two processes, with the results folder and the threads of a test."""
    junit, start = folder / f"{name}.xml", time.monotonic()
    env = {**os.environ, "OMP_NUM_THREADS": "1", "TUTORIALBOT_RESULTS": str(folder), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "--dist", "loadfile", f"--junitxml={junit}", *arguments]
    status = subprocess.run(command, cwd=ROOT, env=env, stdin=subprocess.DEVNULL).returncode
    return read_tally(name, junit, status, time.monotonic() - start)


def summary(tallies: list[Tally], full: bool) -> tuple[str, int]:
    """Return the closing text and the exit status; with `full` whatever was skipped counts as failed."""
    lines = ["", *(tally.line() for tally in tallies)]
    reasons = [reason for tally in tallies for reason in tally.skipped]
    if reasons:
        lines += ["", "Skipped, and therefore failed, for --full skips nothing:" if full else "Skipped:"]
        lines += [f"  {reasons.count(reason)} x {reason}" for reason in dict.fromkeys(reasons)]
    passed = sum(tally.passed for tally in tallies)
    failed = sum(tally.failed for tally in tallies) + (len(reasons) if full else 0)
    lines += ["", f"{passed} passed, {failed} failed"]
    return "\n".join(lines), int(failed > 0)


def test(options: argparse.Namespace, _further: list[str]) -> int:
    """Run ruff, pytest and nbval; print what was skipped and why, and the totals."""
    with tempfile.TemporaryDirectory(prefix="tutorialbot_test_") as name:
        folder, start = Path(name), time.monotonic()
        status = subprocess.run([sys.executable, "-m", "ruff", "check", "--quiet"], cwd=ROOT).returncode
        tallies = [Tally("ruff", int(not status), int(bool(status)), seconds=time.monotonic() - start)]
        tallies.append(_pytest("pytest", folder, "tests", *(["--full"] if options.full else [])))
        pages = [str(path) for path in notebooks()]
        tallies.append(_pytest("notebooks", folder, *NBVAL, *pages))
    text, status = summary(tallies, options.full)
    print(text, flush=True)
    return status


def lab(_options: argparse.Namespace, further: list[str]) -> int:
    """Become JupyterLab: this process ends with it."""
    command = lab_command(further)
    os.chdir(ROOT)
    os.execv(command[0], command)


def source_hash(notebook: Path) -> str:
    """Return a hash of the notebook and of everything below it that can change what it shows."""
    digest = hashlib.sha256(os.environ.get("TUTORIALBOT_PROFILE", "").encode())
    below = [p for folder in ("tutorialbot", "models", "data") for p in (ROOT / folder).rglob("*") if p.is_file()]
    for path in [notebook, *sorted(p for p in below if "__pycache__" not in p.parts)]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def run(options: argparse.Namespace, _further: list[str]) -> int:
    """Run the notebooks one after the other and write HTML; what is done and unchanged is not run again."""
    from tutorialbot import headless

    status, folder = 0, results() / "html"
    for notebook in notebooks():
        page = folder / f"{notebook.stem}.html"
        source = source_hash(notebook)
        if not options.fresh and headless.is_done(page, source):
            print(f"{notebook.name}: done before, {page}", flush=True)
            continue
        start = time.monotonic()
        try:
            headless.execute(notebook, page, source)
        except headless.CellFailed as error:
            print(f"{notebook.name}: FAILED after {time.monotonic() - start:.0f} s\n{error}", flush=True)
            status = 1
        except KeyboardInterrupt:
            print(f"\n{notebook.name}: interrupted; run again to go on from here", flush=True)
            return 130
        else:
            print(f"{notebook.name}: {time.monotonic() - start:.0f} s, {page}", flush=True)
    return status


def doctor(_options: argparse.Namespace, _further: list[str]) -> int:
    """Print the findings about this machine."""
    from tutorialbot.doctor import EVERYTHING, examine

    return int(not examine(EVERYTHING))


def report(options: argparse.Namespace, _further: list[str]) -> int:
    """Print the table of the README; with --write put it there."""
    from tutorialbot import report

    if options.write:
        report.write_readme()
    print(report.readme_table())
    return 0


def bench(options: argparse.Namespace, further: list[str]) -> int:
    """Hand over to the benchmark called `options.name`; tutorialbot.bench knows which exist."""
    from tutorialbot import bench

    return bench.main([options.name, *further]) or 0


def train(options: argparse.Namespace, further: list[str]) -> int:
    """Hand over to the training called `options.name`; tutorialbot.trainings knows which exist."""
    from tutorialbot import trainings

    return trainings.main([options.name, *further])


def grade(options: argparse.Namespace, further: list[str]) -> int:
    """Hand over to the grader, which lies with the exercises' solutions under tests/."""
    command = [sys.executable, str(ROOT / "tests" / "grading.py"), options.folder, *further]
    return subprocess.run(command).returncode


def strip(_options: argparse.Namespace, _further: list[str]) -> int:
    """Strip all notebooks in place, and name those that changed."""
    from tutorialbot import stripping

    for path in notebooks():
        if stripping.strip(path):
            print(f"{path.name}: stripped")
    return 0


def run_verb(options: argparse.Namespace, further: list[str]) -> int:
    """Do what was asked; returns the exit status."""
    from tutorialbot.errors import TutorialbotError

    verbs = {f.__name__: f for f in (lab, test, run, doctor, report, bench, train, grade, strip)}
    try:
        return verbs[options.verb](options, further)
    except TutorialbotError as error:
        print(error, file=sys.stderr)
        return 2
    except OSError as error:
        print(f"{error.filename or options.verb}: {error.strerror or error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\ninterrupted", file=sys.stderr)
        return 130
