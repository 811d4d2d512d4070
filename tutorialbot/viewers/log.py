"""The recorder that stands where meshcat-python has its socket: it keeps the last command of each kind and path.

meshcat-python's own objects make the commands (msgpack); here they are kept, not sent. What is kept is always enough
to draw the whole scene again, for a second view, for a reloaded page or for a file, and it does not grow while a
robot moves: a later command of the same kind on the same path takes the place of the earlier one.
"""

import gzip
import json
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import umsgpack

Key = tuple[str, str, str]  # kind of command, path in the scene, property (or "")


def normal_path(path: str) -> str:
    """Return `path` with one leading slash and no empty part."""
    return "/" + "/".join(part for part in path.split("/") if part)


def pack(header: dict, commands: dict[Key, bytes]) -> bytes:
    """Return header and commands as one gzipped block: length of the header, header as JSON, commands in a row.

    The header gets the entries `keys` and `sizes` (bytes), in the order of the commands.
    """
    head = {**header, "keys": list(commands), "sizes": [len(body) for body in commands.values()]}
    text = json.dumps(head, separators=(",", ":")).encode()
    return gzip.compress(b"".join([struct.pack("<I", len(text)), text, *commands.values()]), 6, mtime=0)


class CommandLog:
    """The last command for each key. `send` has the name and the argument of meshcat's window, so it can replace it.

    `on_change` is called (inside the lock, without arguments) after each command; `pending` holds the commands that
    came since `take` was called last, for whoever passes them on.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.entries: dict[Key, bytes] = {}
        self.pending: dict[Key, bytes] = {}
        self.on_change: Callable[[], None] = lambda: None

    def send(self, command) -> None:
        """Keep one of meshcat's commands (anything with a `lower()` that returns meshcat's dictionary)."""
        lowered = command.lower()
        path = normal_path(lowered.get("path", ""))
        key = (lowered["type"], path, str(lowered.get("property", "")))
        body = umsgpack.packb(lowered)
        with self.lock:
            for store in (self.entries, self.pending):
                if key[0] == "delete":
                    drop_below(store, path)
                store.pop(key, None)  # the newest goes to the end: colours set after an object stay after it
                if not (store is self.entries and key[0] == "delete" and path.startswith("/meshcat")):
                    store[key] = body
            self.on_change()

    @contextmanager
    def batch(self) -> Iterator[None]:
        """Hold back whoever passes commands on, so that one pose of a robot is never shown by halves."""
        with self.lock:
            yield

    def take(self) -> dict[Key, bytes]:
        """Return and forget the pending commands."""
        with self.lock:
            pending, self.pending = self.pending, {}
            return pending


def drop_below(store: dict[Key, bytes], path: str) -> None:
    """Remove every command on `path` and below it from `store`."""
    for key in [k for k in store if k[1] == path or k[1].startswith(path + "/")]:
        del store[key]
