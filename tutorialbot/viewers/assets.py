"""The JavaScript that draws: meshcat's own viewer, from the installed package, and ours beside it."""

from functools import cache
from gzip import compress
from json import dumps
from pathlib import Path

import meshcat


def script(name: str) -> str:
    """Return one of this package's JavaScript files."""
    return (Path(__file__).parent / f"{name}.js").read_text(encoding="utf-8")


@cache
def front_end() -> bytes:
    """Return, gzipped, the JavaScript that draws: meshcat's own viewer from the installed package, and our part."""
    bundle = Path(meshcat.viewer_assets_path()) / "dist" / "main.min.js"
    ours = {name: script(name) for name in ("store", "stage", "core")}
    parts = {"meshcat": bundle.read_text(encoding="utf-8"), **ours}
    return compress(dumps(parts, ensure_ascii=False).encode(), 9, mtime=0)
