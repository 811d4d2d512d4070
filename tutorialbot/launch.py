"""From a bare Python to the environment: find a fitting Python, make `.venv`, install environment.txt, re-run inside.

Standard library only, and nothing newer than Python 3.6 can read: a `python3` that is too old must still get as far as
the line that says so. An environment counts as standing when its stamp matches environment.txt; the stamp is written
last, so whatever was interrupted is made anew by the next run.
"""

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FITTING = ("3.13", "3.12", "3.11")
STAMP = "tutorialbot-stamp.txt"
UNFINISHED = "unfinished\n"
NEEDED_GB = 4.0
BENCHMARKS = ("door", "ga", "vox2c", "sc")  # functions of tutorialbot.bench
AGAIN = "then run the same command again."
PROBE = "import sys; print('%d.%d' % sys.version_info[:2], flush=True); import venv, ensurepip"
LAB_SETTINGS = '{"@jupyterlab/apputils-extension:notification": {"fetchNews": "false", "checkForUpdates": false}}\n'
NO_NETWORK = ("NewConnectionError", "name resolution", "Network is unreachable", "ConnectTimeout", "ReadTimeout",
              "ProxyError", "Connection refused", "Connection reset", "ConnectionError", "Read timed out")  # fmt: skip


class SetupError(Exception):
    """The set-up cannot go on; the message is one line that says why and what to do."""


def wanted_stamp(root: Path) -> str:
    """Return what the stamp of a standing environment of the project at `root` says."""
    return "{}\n{}\n".format(hashlib.sha256((root / "environment.txt").read_bytes()).hexdigest(), root)


def stands(prefix: Path, root: Path) -> bool:
    """Tell whether the environment at `prefix` is whole and belongs to `root` and its environment.txt."""
    try:
        matches = (prefix / STAMP).read_text() == wanted_stamp(root)
    except OSError:
        return False
    python = Path(os.path.realpath(str(prefix / "bin" / "python")))  # an upgraded system may have moved it on
    moved_on = (
        python.name in ["python" + version for version in FITTING] and not (prefix / "lib" / python.name).exists()
    )
    return matches and python.exists() and not moved_on


def probe(python: str) -> "tuple[str, bool]":
    """Return the version ("3.12") of the interpreter `python`, "" if it does not start, and whether it has venv.

    It is really started: a name on the PATH may be a stub that only prints an error.
    """
    try:
        done = subprocess.Popen([python, "-c", PROBE], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.DEVNULL, universal_newlines=True)  # fmt: skip
        version = done.communicate(timeout=30)[0].strip()
    except (OSError, subprocess.TimeoutExpired):
        return "", False
    return version, done.returncode == 0


def candidates(executable: str) -> "list[str]":
    """Return the interpreters to try: `executable`, then python3.13, 3.12, 3.11 beside it, then those on the PATH."""
    names = ["python" + version for version in FITTING]
    beside = [shutil.which(name, path=os.path.dirname(executable)) for name in names]
    found = [executable] + beside + [shutil.which(name) for name in names]
    return list(dict.fromkeys(path for path in found if path))


def find_python(executable: str) -> str:
    """Return the first interpreter that fits and can make environments; raises SetupError."""
    without_venv = ""
    for path in candidates(executable):
        version, has_venv = probe(path)
        if version in FITTING and has_venv:
            return path
        if version in FITTING:
            without_venv = without_venv or version
    if without_venv:
        package = f"sudo apt install python{without_venv}-venv"
        raise SetupError(
            f"Python {without_venv} lacks the venv module: install it (Debian, Ubuntu: {package}), {AGAIN}"
        )
    raise SetupError(
        f"Python {platform.python_version()} does not fit, and no python3.13, python3.12 or python3.11 was found:"
        f" install one of them, {AGAIN}"
    )


def why_pip_failed(output: str, log: Path) -> str:
    """Return the line for the user that fits what pip wrote."""
    if "No space left on device" in output or "Errno 28" in output:
        return f"The disk is full: make room for about {NEEDED_GB:g} GB at {log.parent}, {AGAIN}"
    if any(sign in output for sign in NO_NETWORK):
        return "pip cannot reach the package index: check the network and the proxy, " + AGAIN
    if "No matching distribution" in output:
        return (
            f"A package has no build for {platform.system()} {platform.machine()}: see Platforms in README.md"
            f" (Linux x86_64 and aarch64, macOS 15 on Apple silicon; on Windows use WSL2). pip's own words: {log}"
        )
    errors = [line for line in output.splitlines() if line.startswith("ERROR")] or output.splitlines()[-1:]
    return "pip failed ({}): see {}, {}".format("; ".join(errors)[:300] or "without a word", log, AGAIN)


def _show(line: str, start: float) -> None:
    """Keep one line of the terminal up to date with what pip does; in a log file print only the long step."""
    words = line.split()
    if line.startswith("Installing collected"):
        print("\r  installing {} packages: a minute or two {}".format(len(words) - 3, " " * 20), flush=True)
    elif line.startswith("Collecting") and sys.stdout.isatty():
        text = f"\r  {time.time() - start:3.0f} s  fetching {words[1]}"
        print(text[:78].ljust(78), end="", flush=True)


def _clean_environment() -> "dict[str, str]":
    """Return the environment without what would mix other people's packages in (a sourced ROS sets PYTHONPATH)."""
    return {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME", "PIP_TARGET", "PIP_PREFIX")}


def _pip_install(venv: Path, root: Path, lock: int) -> None:
    """Install; pip shares the lock, so a pip that outlives a killed parent is waited for and not overtaken."""
    log = venv / "install.log"
    command = [str(venv / "bin" / "python"), "-m", "pip", "install", "--no-input", "--progress-bar", "off"]
    command += ["--disable-pip-version-check", "--only-binary", ":all:", "-r", str(root / "environment.txt")]
    start, lines = time.time(), []
    with open(str(log), "w") as file:
        pip = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                               universal_newlines=True, pass_fds=(lock,),
                               env=dict(_clean_environment(), PIP_USER="0"))  # fmt: skip
        try:
            for line in pip.stdout:
                file.write(line)
                file.flush()
                lines.append(line)
                _show(line, start)
        finally:
            pip.stdout.close()
            code = pip.wait()
    if code:
        raise SetupError(why_pip_failed("".join(lines), log))


def make_environment(venv: Path, root: Path, lock: int) -> None:
    """Make `venv` and install environment.txt into it; what an earlier run left unfinished or outdated goes first."""
    if venv.exists() and not (venv / STAMP).exists():
        raise SetupError(f"{venv} was not made by this command: move it away or delete it, {AGAIN}")
    python = find_python(getattr(sys, "_base_executable", sys.executable))  # never the one inside what goes away
    shutil.rmtree(str(venv), ignore_errors=True)
    free = shutil.disk_usage(str(root)).free / 1e9
    if free < NEEDED_GB:
        raise SetupError(f"Only {free:.1f} GB free at {root}: make room for {NEEDED_GB:g} GB, {AGAIN}")
    print(f"Setting up {venv} (once; a few minutes and some GB)", flush=True)
    start = time.time()
    venv.mkdir()
    (venv / STAMP).write_text(UNFINISHED)
    made = subprocess.Popen([python, "-m", "venv", str(venv)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, universal_newlines=True, env=_clean_environment())  # fmt: skip
    output = made.communicate()[0]
    if made.returncode:
        last = (output.strip().splitlines() or ["without a word"])[-1]
        raise SetupError(f"{python} -m venv failed ({last[:300]}): mend that, {AGAIN}")
    _pip_install(venv, root, lock)
    packages = next((venv / "lib").glob("python3.*")) / "site-packages"
    (packages / "tutorialbot.pth").write_text(str(root) + "\n")
    settings = venv / "share" / "jupyter" / "lab" / "settings"
    settings.mkdir(parents=True, exist_ok=True)
    (settings / "overrides.json").write_text(LAB_SETTINGS)
    (venv / STAMP).write_text(wanted_stamp(root))
    print("\r  the environment stands after {:.0f} s{}".format(time.time() - start, " " * 30), flush=True)


def ensure(venv: Path, root: Path) -> Path:
    """Return the Python of a standing environment, made now if there is none; raises SetupError.

    Two set-ups at the same time wait for each other.
    """
    if stands(Path(sys.prefix), root):
        return Path(sys.executable)
    if platform.system() not in ("Linux", "Darwin"):
        raise SetupError("This needs Linux or macOS: on Windows install WSL2 (wsl --install) and run it in there.")
    import fcntl

    with open(str(root / "environment.txt")) as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            print("Another set-up is under way: waiting for it", flush=True)
            fcntl.flock(lock, fcntl.LOCK_EX)
        if not stands(venv, root):
            try:
                make_environment(venv, root, lock.fileno())
            except OSError as error:
                raise SetupError(f"{error.filename}: {error.strerror}: mend that, {AGAIN}") from None
    return venv / "bin" / "python"


def enter(argv: "list[str]", venv: Path = ROOT / ".venv", root: Path = ROOT) -> None:
    """Return when this process runs in a standing environment; otherwise start `argv` again in one and never return.

    A set-up that cannot be finished ends the process with one line that says what to do.
    """
    try:
        python = ensure(venv, root)
    except SetupError as error:
        sys.exit("\n" + str(error))
    except KeyboardInterrupt:
        sys.exit("\nThe set-up was interrupted: run the same command again, it starts afresh with what was fetched.")
    if python != Path(sys.executable):
        os.execve(str(python), [str(python), "-m", "tutorialbot"] + argv, _clean_environment())
