"""Files of bit-packed rows that are whole or are noticed: a JSON line (what they are, checksum), then packed bytes."""

import hashlib
import json
import zlib
from pathlib import Path

import numpy as np
import psutil

from tutorialbot.errors import BrokenFile
from tutorialbot.runs import write_then_rename

HEADER = 1000  # bytes at most


def write(path: Path, about: dict, rows: np.ndarray) -> None:
    """Write uint8 rows (k, m) and what they are: to a temporary file first, then renamed, so `path` is never half.

    Raises BrokenFile when it cannot be written.
    """
    body = zlib.compress(np.ascontiguousarray(rows).data, 6)
    header = {**about, "shape": list(rows.shape), "sha256": hashlib.sha256(body).hexdigest()}
    write_then_rename(path, lambda part: part.write_bytes(json.dumps(header).encode() + b"\n" + body))


def read(path: Path, about: dict, width: int) -> np.ndarray:
    """Return the rows (k, width), uint8, of the file at `path`.

    Raises BrokenFile when it is missing, cut short, damaged, or says that it holds something else than `about`.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BrokenFile(f"{path}: cannot be read: {error.strerror}") from None
    line, _, body = content.partition(b"\n")
    try:
        header = json.loads(line) if len(line) < HEADER else None
    except (ValueError, RecursionError):
        header = None
    if not isinstance(header, dict) or not isinstance(header.get("shape"), list):
        raise BrokenFile(f"{path}: damaged: it does not begin with a line that says what it holds")
    found = {name: header.get(name) for name in about}
    if found != about or header["shape"][1:] != [width]:
        raise BrokenFile(f"{path}: holds {found} in rows of shape {header['shape']}, expected {about}, {width} wide")
    if hashlib.sha256(body).hexdigest() != header.get("sha256"):
        raise BrokenFile(f"{path}: damaged or cut short: its checksum is another")
    try:
        rows = np.frombuffer(zlib.decompress(body), dtype=np.uint8).reshape(header["shape"])
    except (zlib.error, ValueError, TypeError) as error:
        raise BrokenFile(f"{path}: damaged: {error}") from None
    return rows


def sweep(folder: Path) -> None:
    """Remove the temporary files that killed processes left in `folder`."""
    for part in folder.glob(".*.part"):
        pid = part.name.split(".")[-2]
        if pid.isdecimal() and not psutil.pid_exists(int(pid)):
            part.unlink(missing_ok=True)
