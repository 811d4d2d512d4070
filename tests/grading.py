"""Mark a folder of submissions: `python3 -m tutorialbot grade FOLDER`.

Each notebook (.ipynb) or .py file is marked in a process of its own (`marking.py`), with limits on time, memory and
output, and in a fresh one again after a function that hung or crashed. A journal, a CSV and one feedback file for each
submission are written as the work goes; the same call goes on where it stopped, and marks again only what has changed.

The checks say which rule was broken also when somebody tampers with them; yet a submission shares a process with its
judge, so look twice at marks that surprise you.

All notebooks' exercises are looked for in each submission; of a notebook that it has nothing of, it says only that.
"""

import argparse
import csv
import hashlib
import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tutorialbot.checks.mechanism import CORRECT, OUTCOMES  # noqa: E402
from tutorialbot.errors import TutorialbotError  # noqa: E402
from tutorialbot.runs import Journal, progress  # noqa: E402

KEPT = 4_000  # characters of a submission's output that its feedback shows
FLOOD = 5_000_000  # bytes of output after which a submission is stopped
SUFFIXES = (".ipynb", ".py")


def run_one(path: Path, names: list[str], seconds: float, memory: float) -> tuple[list[dict], str, str]:
    """Mark in a fresh process; return the verdicts that came, why no more did ("" if all did), and the first output.

    `seconds` is the longest silence between two verdicts; the process and its children are killed after that.
    """
    reading, writing = os.pipe()
    with tempfile.TemporaryDirectory(prefix="tutorialbot_grade_") as folder:
        script = str(Path(__file__).resolve().with_name("marking.py"))
        command = [sys.executable, script, "--channel", str(writing), "--memory", str(memory), str(path), *names]
        env = {**os.environ, "OMP_NUM_THREADS": "1", "TUTORIALBOT_RESULTS": folder, "PYTHONUNBUFFERED": "1"}
        child = subprocess.Popen(command, cwd=folder, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                 stderr=subprocess.STDOUT, pass_fds=(writing,), start_new_session=True)  # fmt: skip
        os.close(writing)
        try:
            lines, stopped, output = _listen(child, reading, seconds, len(names) + 1)
        finally:
            os.close(reading)
            _kill(child)
            child.stdout.close()
    verdicts = [verdict for line, name in zip(lines[1:], names, strict=False) if (verdict := _verdict(line, name))]
    reason = stopped or ("" if len(verdicts) == len(names) else f"the process ended ({_status(child.returncode)})")
    return verdicts, reason, output


def _verdict(line: bytes, name: str) -> dict | None:
    """Return a verdict on the exercise called `name`; None for anything else that a submission may have written."""
    try:
        found = json.loads(line)
        verdict = {key: str(found[key]) for key in ("exercise", "outcome", "check", "message")}
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    return verdict if verdict["exercise"] == name and verdict["outcome"] in OUTCOMES else None


def _listen(child: subprocess.Popen, channel: int, seconds: float, most: int) -> tuple[list[bytes], str, str]:
    """Read up to `most` lines, and the output, until both ends close or a limit is passed (`seconds` of silence)."""
    pending, lines, output, printed = b"", [], b"", 0
    patience = max(seconds, 60.0)  # until it is ready: a slow import is not the submission's fault
    deadline = time.monotonic() + patience
    with selectors.DefaultSelector() as selector:
        selector.register(channel, selectors.EVENT_READ)
        selector.register(child.stdout, selectors.EVENT_READ)
        while selector.get_map():
            ended = child.poll() is not None
            ready = selector.select(min(0.5, max(0.0, deadline - time.monotonic())))
            for key, _ in ready:
                chunk = os.read(key.fd, 65536)
                if not chunk:
                    selector.unregister(key.fileobj)
                elif key.fd == channel:
                    *whole, pending = (pending + chunk).split(b"\n")
                    lines += whole
                    deadline = time.monotonic() + seconds
                else:
                    printed += len(chunk)
                    output += chunk[: KEPT - len(output)]
            if len(lines) > most or len(pending) > FLOOD:
                return lines, "it wrote where only verdicts belong", output.decode(errors="replace")
            if printed > FLOOD:
                return lines, f"it printed more than {FLOOD // 1_000_000} MB", output.decode(errors="replace")
            if time.monotonic() > deadline:
                return lines, f"nothing came for {seconds:g} s", output.decode(errors="replace")
            if ended and not ready:
                break  # a child of its own may keep both ends open for ever
    return lines, "", output.decode(errors="replace")


def _kill(child: subprocess.Popen) -> None:
    """End the process and everything in its session."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def _status(code: int) -> str:
    return f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"


def mark(path: Path, names: list[str], seconds: float, memory: float) -> tuple[list[dict], str]:
    """Return one verdict for each exercise, and the first output; after a hang or crash the rest gets a new process."""
    verdicts: list[dict] = []
    output = ""
    while len(verdicts) < len(names):
        left = names[len(verdicts) :]
        came, reason, printed = run_one(path, left, seconds, memory)
        verdicts += came[: len(left)]
        output = (output + printed)[:KEPT]
        if reason and len(verdicts) < len(names):
            check = (
                "time limit" if reason.startswith("nothing") else "little output" if "MB" in reason else "stays alive"
            )
            message = f"Your function was stopped: {reason}."
            verdicts.append({"exercise": names[len(verdicts)], "outcome": "error", "check": check, "message": message})
    return verdicts, output


def sets() -> dict[str, list[str]]:
    """Return the names of the exercises, by notebook; the first call loads everything that they need."""
    from tutorialbot.checks.sets import SETS

    return {title: [exercise.name for exercise in exercises] for title, exercises in SETS.items()}


def handed_in(verdicts: list[dict]) -> bool:
    """Whether the submission has any of these exercises."""
    return any(verdict["check"] != "handed in" for verdict in verdicts)


def count(verdicts: list[dict]) -> str:
    """Return how many are correct, of how many of the notebooks that the submission has something of."""
    by_name = {verdict["exercise"]: verdict for verdict in verdicts}
    seen = [[by_name[name] for name in names if name in by_name] for names in sets().values()]
    counted = [verdict for its in seen if handed_in(its) for verdict in its]
    return f"{sum(verdict['outcome'] == CORRECT for verdict in counted)} of {len(counted)}"


def feedback(name: str, verdicts: list[dict], output: str) -> str:
    """Return the text of the feedback file."""
    lines, by_name = [f"# {name}", ""], {verdict["exercise"]: verdict for verdict in verdicts}
    for title, names in sets().items():
        its = [by_name[name] for name in names if name in by_name]
        if not handed_in(its):
            lines += [f"Nothing of the exercises `{title}`.", ""]
            continue
        lines += [f"{count(its)} exercises `{title}` are correct.", ""]
        for verdict in its:
            check = f" ({verdict['check']})" if verdict["check"] else ""
            lines += [f"## {verdict['exercise']}: {verdict['outcome']}{check}", ""]
            lines += [*(f"    {line}" for line in verdict["message"].splitlines()), ""] if verdict["message"] else []
    if output.strip():
        lines += ["## What was printed (the beginning)", "", *(f"    {line}" for line in output.splitlines()), ""]
    return "\n".join(lines)


def write_csv(path: Path, entries: list[dict], names: list[str]) -> None:
    """Write all marks so far: one row a submission, one column an exercise; renamed into place."""
    part = path.with_suffix(".part")
    with part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["submission", "correct", *names])
        for entry in sorted(entries, key=lambda entry: entry["submission"]):
            outcomes = [verdict["outcome"] for verdict in entry["verdicts"]]
            safe = entry["submission"] if entry["submission"][0] not in "=+-@\t" else "'" + entry["submission"]
            writer.writerow([safe, outcomes.count("correct"), *outcomes])
    part.replace(path)


def submissions(folder: Path, out: Path) -> list[Path]:
    """Return the notebooks and .py files below `folder`, hidden ones and our own output left out."""
    found = (
        path for path in folder.rglob("*") if path.suffix in SUFFIXES and path.is_file() and out not in path.parents
    )
    return sorted(path for path in found if not any(part.startswith(".") for part in path.relative_to(folder).parts))


def digest_of(path: Path) -> str:
    """Return what tells a changed submission from an unchanged one; "" when it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def grade(folder: Path, out: Path, seconds: float, memory: float, fresh: bool) -> int:
    """Mark everything in `folder` that is new or changed; returns the exit status."""
    names = [name for those in sets().values() for name in those]
    found = submissions(folder, out)
    if not found:
        print(f"{folder}: no notebook and no .py file in it", file=sys.stderr)
        return 2
    rules = hashlib.sha256()
    for source in sorted((ROOT / "tutorialbot").rglob("*.py")):
        rules.update(source.read_bytes())
    with Journal(out / "journal.jsonl", {"rules": rules.hexdigest()}, fresh=fresh) as journal:
        marks = {entry["submission"]: entry for entry in journal.entries}
        for path in progress(found, description="marking"):
            name = path.relative_to(folder).as_posix()
            digest = digest_of(path)
            if marks.get(name, {}).get("digest") != digest:
                verdicts, output = mark(path, names, seconds, memory)
                journal.append({"submission": name, "digest": digest, "verdicts": verdicts, "output": output})
                marks[name] = journal.entries[-1]
            entry = marks[name]
            text = feedback(name, entry["verdicts"], entry["output"])
            (out / f"{name.replace('/', '__')}.md").write_text(text, encoding="utf-8", errors="replace")
            write_csv(out / "marks.csv", [marks[n] for n in marks if (folder / n).exists()], names)
    for name in sorted(marks):
        print(f"{count(marks[name]['verdicts']):>8}  {name}")
    print(f"{out / 'marks.csv'}")
    return 0


def main(argv: list[str]) -> int:
    """Read the command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python3 -m tutorialbot grade", description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="the folder with one notebook or .py file a student")
    parser.add_argument("--out", type=Path, help="where marks and feedback go (default: FOLDER/marks)")
    parser.add_argument(
        "--seconds", type=float, default=120.0, help="the longest that one exercise may take (default 120)"
    )
    parser.add_argument("--memory", type=float, default=6.0, help="GB of address space of one submission (default 6)")
    parser.add_argument(
        "--fresh", action="store_true", help="mark everything anew (needed when the checks have changed)"
    )
    options = parser.parse_args(argv)
    folder = options.folder.resolve()
    if not folder.is_dir():
        print(f"{options.folder}: no such folder", file=sys.stderr)
        return 2
    try:
        return grade(
            folder, (options.out or folder / "marks").resolve(), options.seconds, options.memory, options.fresh
        )
    except TutorialbotError as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\ninterrupted: run again to go on from here", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
