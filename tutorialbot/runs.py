"""Budgets, progress bars, journals that survive an interrupt, and records of finished runs.

A `Journal` is written *during* a run, one line an entry, so that a killed run goes on where it stopped. A `RunRecord`
is written once, *after* a run, with everything needed to make it again.
"""

import errno
import fcntl
import json
import os
import platform
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from tqdm.auto import tqdm

from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue, one_of

T = TypeVar("T")
PROFILES = ("quick", "paper")
PACKAGES = ("mujoco", "pin", "numpy", "scipy", "scikit-optimize", "scikit-learn", "deap", "optuna")


@dataclass(frozen=True)
class Profile:
    """How much a notebook or a study computes: "quick" (two minutes) or "paper" (the paper's budgets)."""

    name: str

    def pick(self, *, quick: T, paper: T) -> T:
        """Return the one of the two values that belongs to this profile."""
        return paper if self.name == "paper" else quick


def profile(name: str | None = None) -> Profile:
    """Return the profile called `name`; by default what $TUTORIALBOT_PROFILE says, else "quick".

    Raises InvalidValue for any other name, and says whether the argument or the variable was wrong.
    """
    argument = "name" if name is not None else "TUTORIALBOT_PROFILE"
    return Profile(one_of(argument, name if name is not None else os.environ.get(argument) or "quick", PROFILES))


def progress(iterable=None, *, total: int | None = None, description: str = "") -> tqdm:
    """Wrap `iterable` (or count to `total` by `.update()`) in a bar: a widget in a notebook, text in a terminal."""
    return tqdm(iterable, total=total, desc=description or None, leave=False)


def versions() -> dict[str, str]:
    """Return the versions of Python, the machine and the packages that results depend on."""
    found = {"python": platform.python_version(), "machine": f"{platform.system()} {platform.machine()}"}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def _plain(value: Any) -> Any:
    """Turn numpy's scalars and arrays and paths into what JSON knows."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise InvalidType("entry", value, "numbers, text, lists, dicts and numpy arrays only")


class Journal:
    """An append-only file of JSON lines: the header first, then one entry a line, each on disk as soon as it is made.

    Opening an existing file with an equal header gives its `entries`; a last line without its line end (the writer was
    killed) is dropped. The file is locked: a second writer is refused, also from another process.

    Raises BrokenFile when the file has another header (unless `fresh`, which starts it anew) or is damaged in the
    middle or cannot be written, and InvalidValue when somebody else is writing it.
    """

    def __init__(self, path: str | os.PathLike, header: dict, *, fresh: bool = False):
        if not isinstance(path, str | os.PathLike):
            raise InvalidType("path", path, "a path")
        if not isinstance(header, dict) or not all(isinstance(key, str) for key in header):
            raise InvalidType("header", header, "a dict whose keys are text")
        self.path = Path(path)
        self.header: dict = json.loads(json.dumps(header, default=_plain))
        self.entries: list[dict] = []
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = open(self.path, "a+b", buffering=0)  # noqa: SIM115 - stays open until close()
        except OSError as error:
            raise BrokenFile(f"{self.path}: cannot be written: {error.strerror}") from None
        try:
            self._open(fresh)
        except BaseException:
            self._file.close()
            raise

    def _open(self, fresh: bool) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InvalidValue("path", str(self.path), "a journal that nobody else is writing just now") from None
        if fresh:
            self._file.truncate(0)
        self._file.seek(0)
        content = self._file.read()
        whole = content[: content.rfind(b"\n") + 1]
        if not whole and not self._line(self.header).startswith(content):
            raise BrokenFile(f"{self.path}: not a journal: it holds no whole line and does not begin like its header")
        lines = [self._parse(number, line) for number, line in enumerate(whole.splitlines(), start=1)]
        if lines and lines[0] != self.header:
            raise BrokenFile(
                f"{self.path}: belongs to another run: its header is {lines[0]}, expected {self.header}"
                " (fresh=True starts the file anew and loses it)"
            )
        self.entries = lines[1:]
        self._file.truncate(len(whole))
        if not lines:
            self._write(self.header)

    def _parse(self, number: int, line: bytes) -> dict:
        try:
            value = json.loads(line)
        except (ValueError, RecursionError):
            value = None
        if not isinstance(value, dict):
            raise BrokenFile(f"{self.path}: line {number} is damaged: expected a JSON object, found {line[:60]!r}")
        return value

    @staticmethod
    def _line(entry: dict) -> bytes:
        return json.dumps(entry, default=_plain).encode() + b"\n"

    def _write(self, entry: dict) -> dict:
        line, before = self._line(entry), self._file.seek(0, os.SEEK_END)
        try:
            if self._file.write(line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            self._file.truncate(before)  # no half line stays
            raise BrokenFile(f"{self.path}: cannot be written: {error.strerror}") from None
        return json.loads(line)

    def append(self, entry: dict) -> None:
        """Write `entry` to disk and add it to `entries`, as a later run will read it (tuples and arrays as lists)."""
        if not isinstance(entry, dict) or not all(isinstance(key, str) for key in entry):
            raise InvalidType("entry", entry, "a dict whose keys are text")
        if self._file.closed:
            raise InvalidValue("journal", str(self.path), "a journal that is still open")
        self.entries.append(self._write(entry))

    def close(self) -> None:
        """Close the file and let others write it; closing twice does no harm."""
        self._file.close()

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_) -> None:
        self.close()


def write_then_rename(path: Path, write: Callable[[Path], object]) -> Path:
    """Let `write` make a file that is then renamed, so `path`, which is returned, is never half a file.

    Raises BrokenFile when it cannot be written.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(part)
        os.replace(part, path)
    except OSError as error:
        raise BrokenFile(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
    return path


@dataclass(frozen=True)
class RunRecord:
    """What a finished run found (`values`), and all that is needed to make it again.

    seconds: wall time of the last call; a run that was interrupted and went on took longer in all.
    """

    name: str
    command: str
    seed: int
    profile: str
    seconds: float
    values: dict
    versions: dict = field(default_factory=versions)
    date: str = field(default_factory=lambda: datetime.now(UTC).date().isoformat())

    def save(self, path: str | os.PathLike) -> Path:
        """Write the record as JSON: to a temporary file first, then renamed, so `path` is never half a record.

        Raises BrokenFile when it cannot be written.
        """
        text = json.dumps(asdict(self), default=_plain, indent=1, ensure_ascii=False) + "\n"
        return write_then_rename(Path(path), lambda part: part.write_text(text, encoding="utf-8"))

    @classmethod
    def load(cls, path: str | os.PathLike) -> "RunRecord":
        """Read a record; raises BrokenFile when it is missing, cut short, or lacks a field, or holds another type."""
        path = Path(path)
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise BrokenFile(f"{path}: cannot be read: {error.strerror}") from None
        except (ValueError, RecursionError) as error:
            raise BrokenFile(f"{path}: no whole JSON record (cut short or damaged): {error}") from None
        names = {f.name for f in fields(cls)}
        if not isinstance(content, dict) or set(content) != names:
            found = sorted(content) if isinstance(content, dict) else type(content).__name__
            raise BrokenFile(f"{path}: expected a record with the fields {sorted(names)}, found {found}")
        kinds = {"seed": int, "seconds": int | float, "values": dict, "versions": dict}
        wrong = [name for name in sorted(names) if not isinstance(content[name], kinds.get(name, str))]
        if wrong:
            raise BrokenFile(f"{path}: {wrong[0]} = {content[wrong[0]]!r}: expected what `save` writes there")
        return cls(**content)
