"""Weights on disk: numbers only (safetensors, never pickle), each file with a JSON record that holds its checksum."""

import hashlib
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load as parse
from safetensors.numpy import save as serialize

from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue, one_of
from tutorialbot.paths import DATA
from tutorialbot.runs import RunRecord, versions, write_then_rename

FOLDER = DATA / "weights"
PACKAGES = ("torch", "numba", "safetensors")


@dataclass(frozen=True)
class Weights:
    """What a weights file holds: its tensors, float32, by name, and the record of the run that made them."""

    tensors: dict[str, np.ndarray]
    record: RunRecord


def names(folder: Path = FOLDER) -> list[str]:
    """Return the names of the weights that lie in `folder`."""
    return sorted(path.stem for path in folder.glob("*.safetensors"))


def training_versions() -> dict[str, str]:
    """Return `runs.versions()` with the packages that training depends on."""
    return versions() | {package: metadata.version(package) for package in PACKAGES}


def save(tensors: dict[str, np.ndarray], record: RunRecord, folder: Path = FOLDER, *, half: bool = True) -> Path:
    """Write `tensors` (float16 when `half`, else float32) and `record` with their checksum; return the weights' path.

    Both files carry the record's name. Raises InvalidValue for tensors that are not finite once stored.
    """
    kind = np.float16 if half else np.float32
    with np.errstate(over="ignore"):
        stored = {name: np.ascontiguousarray(tensor, kind) for name, tensor in tensors.items()}
    for name, tensor in stored.items():
        if not np.isfinite(tensor).all():
            raise InvalidValue("tensors", name, f"finite numbers within the range of {kind.__name__}")
    content = serialize(stored)
    path = folder / f"{record.name}.safetensors"
    values = record.values | {"sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)}
    write_then_rename(path, lambda part: part.write_bytes(content))
    replace(record, values=values).save(path.with_suffix(".json"))
    return path


def load(name: str, folder: Path = FOLDER) -> Weights:
    """Read the weights called `name`.

    Raises InvalidValue for a name that is not there, BrokenFile when the file is damaged, cut short, not what its
    record promises, or holds numbers that are not finite.
    """
    if not isinstance(name, str):
        raise InvalidType("name", name, "the name of stored weights")
    one_of("name", name, names(folder))
    path = folder / f"{name}.safetensors"
    record = RunRecord.load(path.with_suffix(".json"))
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BrokenFile(f"{path}: cannot be read: {error.strerror}") from None
    if hashlib.sha256(content).hexdigest() != record.values.get("sha256"):
        raise BrokenFile(
            f"{path}: damaged or cut short: {len(content)} bytes whose checksum is not that of {path.stem}.json"
            f" ({record.values.get('bytes')} bytes)"
        )
    try:
        stored = parse(content)
        tensors = {key: value.astype(np.float32) for key, value in stored.items()}
    except (SafetensorError, ValueError, KeyError) as error:
        raise BrokenFile(f"{path}: no safetensors file: {error}") from None
    for key, tensor in tensors.items():
        if stored[key].dtype.kind != "f":
            raise BrokenFile(f"{path}: {key} holds {stored[key].dtype}, expected floating-point numbers")
        if not np.isfinite(tensor).all():
            raise BrokenFile(f"{path}: {key} holds numbers that are not finite")
    return Weights(tensors, record)


def check_shapes(name: str, tensors: dict[str, np.ndarray], expected: dict[str, tuple[int, ...]]) -> None:
    """Raise BrokenFile unless `tensors` has exactly the names and shapes of `expected`."""
    found = {key: tuple(tensor.shape) for key, tensor in tensors.items()}
    wrong = sorted(key for key in expected.keys() | found.keys() if expected.get(key) != found.get(key))
    if wrong:
        key = wrong[0]
        shapes = [found.get(key, "nothing"), expected.get(key, "nothing")]
        raise BrokenFile(f"weights {name!r}: tensor {key} has shape {shapes[0]}, expected {shapes[1]}")
