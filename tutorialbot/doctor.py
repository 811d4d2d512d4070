"""`doctor`: is this machine fit? One line each, and what to do. Works with the standard library alone."""

import os
import platform
import re
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterable
from importlib import metadata
from pathlib import Path

from tutorialbot.launch import FITTING, NEEDED_GB, ROOT

GOOD, NOTE, BAD = "ok", "note", "BAD"
Finding = tuple[str, str, str]  # (GOOD, NOTE or BAD; what was looked at; what was found and what to do)
HEAVY = ("mujoco", "pinocchio", "ompl", "torch", "skopt", "meshcat")
EGL = (
    "import mujoco; m = mujoco.MjModel.from_xml_string('<mujoco><worldbody><geom size=\".1\"/></worldbody></mujoco>');"
    "d = mujoco.MjData(m); mujoco.mj_forward(m, d); r = mujoco.Renderer(m, 24, 32); r.update_scene(d); r.render()"
)


def _works(code: str, **environment: str) -> bool:
    """Run `code` in a Python of its own, so that even a crash in a library only costs one line."""
    try:
        done = subprocess.run([sys.executable, "-c", code], env={**os.environ, **environment}, timeout=120,
                              stdin=subprocess.DEVNULL, capture_output=True)  # fmt: skip
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def find_chromium() -> str | None:
    """Return the path of a Chromium-like browser of this machine, or None."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    return next((path for path in map(shutil.which, names) if path), None)


def pins(text: str) -> dict[str, str]:
    """Return name -> version of every line `name==version` of a requirements file that holds for this machine."""
    lines = re.findall(r"^([A-Za-z0-9._-]+)==(\S+)(.*)$", text, flags=re.MULTILINE)
    return {name: version for name, version, rest in lines if "darwin" not in rest or sys.platform == "darwin"}


def check_python() -> Finding:
    """A Python that has builds of all packages."""
    version, fits = platform.python_version(), platform.python_version().rpartition(".")[0] in FITTING
    return GOOD if fits else BAD, "Python", version if fits else f"{version}: install Python 3.12 (or 3.11, 3.13)"


def check_system() -> Finding:
    """An operating system and a processor that have builds of all packages."""
    found = f"{platform.system()} {platform.machine()}"
    if found in ("Linux x86_64", "Linux aarch64", "Darwin arm64"):
        return GOOD, "system", found
    return BAD, "system", f"{found}: use Linux (x86_64, aarch64), macOS 15 on Apple silicon, or WSL2 on Windows"


def check_disk() -> Finding:
    """Room for the environment."""
    free = shutil.disk_usage(ROOT).free / 1e9
    if free >= NEEDED_GB or (ROOT / ".venv").exists():
        return GOOD, "disk", f"{free:.0f} GB free"
    return BAD, "disk", f"{free:.1f} GB free: make room for {NEEDED_GB:g} GB"


def check_memory() -> Finding:
    """Memory for a notebook and the browser beside it."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    if total > 3.5:
        return GOOD, "memory", f"{total:.0f} GB"
    return NOTE, "memory", f"{total:.1f} GB: close other programs; a notebook wants up to 1.5 GB"


def check_threads() -> Finding:
    """How many cores there are, and whether an environment variable holds them back."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    limit = os.environ.get("OMP_NUM_THREADS")
    return GOOD, "threads", f"{cores} cores" + (f", OMP_NUM_THREADS={limit}" if limit else "")


def check_port() -> Finding:
    """Only JupyterLab itself needs a port, on the loopback address; 3-D scenes need none."""
    with socket.socket() as probe:
        try:
            probe.bind(("127.0.0.1", 0))
        except OSError as error:
            return BAD, "port", f"nothing can listen on 127.0.0.1 ({error}): lab cannot start; run and test can"
    return GOOD, "port", "127.0.0.1 is open for JupyterLab; nothing else needs a port"


def check_results() -> Finding:
    """A folder to write to."""
    folder = Path(os.environ.get("TUTORIALBOT_RESULTS") or ROOT / "results")
    parent = next(p for p in (folder, *folder.parents) if p.exists())
    if os.access(parent, os.W_OK):
        return GOOD, "results", str(folder)
    return BAD, "results", f"{folder} cannot be written: set TUTORIALBOT_RESULTS to a folder of yours"


def check_versions() -> Finding:
    """Exactly the packages of environment.txt."""
    wrong = []
    for name, version in pins((ROOT / "environment.txt").read_text()).items():
        try:
            found = metadata.version(name).partition("+")[0]
        except metadata.PackageNotFoundError:
            found = "missing"
        if found != version:
            wrong.append(f"{name} {found} (expected {version})")
    if wrong:
        return BAD, "versions", ", ".join(wrong) + ": delete .venv and run `python3 -m tutorialbot lab`"
    return GOOD, "versions", "every package is the one of environment.txt"


def check_imports() -> Finding:
    """The compiled packages load on this machine."""
    broken = [name for name in HEAVY if not _works(f"import {name}")]
    if broken:
        return BAD, "imports", f"{', '.join(broken)}: try `.venv/bin/python -c 'import {broken[0]}'` and read the error"
    return GOOD, "imports", ", ".join(HEAVY)


def check_egl() -> Finding:
    """MuJoCo's own pictures; no notebook depends on them."""
    if platform.system() == "Darwin" or _works(EGL, MUJOCO_GL="egl"):
        return GOOD, "GL", "MuJoCo can draw without a window"
    return NOTE, "GL", "no EGL: only MuJoCo's own pictures are missing (Debian, Ubuntu: sudo apt install libegl1)"


def check_chromium() -> Finding:
    """The browser of `test --full`."""
    path = find_chromium()
    if path:
        return GOOD, "Chromium", path
    return NOTE, "Chromium", "none: only `test --full` needs it (Debian: sudo apt install chromium)"


def check_fonts() -> Finding:
    """A font with Japanese letters, for each notebook's summary."""
    if platform.system() == "Darwin":
        return GOOD, "fonts", "macOS brings Japanese letters"
    lister = shutil.which("fc-list")
    found = lister and subprocess.run([lister, ":lang=ja", "family"], capture_output=True, text=True).stdout.strip()
    if found:
        return GOOD, "fonts", "Japanese letters: " + found.splitlines()[0]
    return NOTE, "fonts", "no Japanese letters: boxes instead (Debian, Ubuntu: sudo apt install fonts-noto-cjk)"


MACHINE = (check_python, check_system, check_disk, check_memory, check_threads, check_port, check_results)
QUICK = (check_python, check_system, check_memory, check_threads, check_results, check_versions)
EVERYTHING = (*MACHINE, check_versions, check_imports, check_egl, check_fonts, check_chromium)


def examine(checks: Iterable[Callable[[], Finding]]) -> bool:
    """Print what each of `checks` finds, one line each; returns whether nothing must be mended."""
    fit = True
    for check in checks:
        state, what, found = check()
        print(f"{state:<5} {what:<9} {found}", flush=True)
        fit = fit and state != BAD
    return fit
