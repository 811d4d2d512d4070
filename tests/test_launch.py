"""From a bare Python to the environment. Interpreters and pip are fakes: small shell scripts that act as told."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tutorialbot import launch
from tutorialbot.launch import AGAIN, STAMP, UNFINISHED, SetupError

PINS = "mujoco==4.0.0\n"


def a_python(folder: Path, name: str, version: str, *, venv: bool = True, pip: str = "exit 0") -> Path:
    """Write a fake interpreter: answers the probe, makes a fake environment, and does `pip` when asked to install."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(f"""#!/bin/sh
case "$1 $2" in
"-c "*) echo {version}; exit {0 if venv else 1};;
"-m venv") mkdir -p "$3/bin" "$3/lib/python3.12/site-packages"; cp "$0" "$3/bin/python";;
"-m pip") {pip};;
esac
""")
    path.chmod(0o755)
    return path


@pytest.fixture
def alone(tmp_path, monkeypatch):
    """A project folder whose machine has no Python at all; tests add fakes to `tmp_path / "bin"` and beside it."""
    root = tmp_path / "project"
    root.mkdir()
    (root / "environment.txt").write_text(PINS)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:/usr/bin:/bin")
    monkeypatch.setattr(launch, "candidates", lambda executable: [executable, *map(str, (tmp_path / "bin").glob("*"))])
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "nowhere"))
    return root


def use(monkeypatch, python: Path) -> None:
    monkeypatch.setattr(sys, "_base_executable", str(python))


@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13"])
def test_a_fitting_python_is_taken_as_it_is(tmp_path, version):
    python = a_python(tmp_path, "python3", version)
    assert launch.find_python(str(python)) == str(python)


@pytest.mark.parametrize("version", ["2.7", "3.9", "3.10", "3.14"])
def test_too_old_or_too_new_looks_beside_itself_then_on_the_path(tmp_path, monkeypatch, version):
    python = a_python(tmp_path / "here", "python3", version)
    elsewhere = a_python(tmp_path / "bin", "python3.12", "3.12")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    assert launch.find_python(str(python)) == str(elsewhere)
    beside = a_python(tmp_path / "here", "python3.11", "3.11")
    assert launch.find_python(str(python)) == str(beside)


def test_a_stub_on_the_path_that_does_not_start_is_passed_over(tmp_path, monkeypatch):
    python = a_python(tmp_path / "here", "python3", "3.9")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    stub = a_python(tmp_path / "bin", "python3.13", "3.13")
    stub.write_text("#!/bin/sh\necho 'command not found' >&2; exit 127\n")
    good = a_python(tmp_path / "bin", "python3.11", "3.11")
    assert launch.find_python(str(python)) == str(good)
    good.unlink()
    with pytest.raises(
        SetupError, match="no python3.13, python3.12 or python3.11 was found: install one of them, then"
    ):
        launch.find_python(str(python))


def test_a_python_without_venv_gives_way_or_is_named(tmp_path, monkeypatch):
    python = a_python(tmp_path / "here", "python3", "3.12", venv=False)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    with pytest.raises(SetupError, match=r"Python 3\.12 lacks the venv module: .*apt install python3\.12-venv"):
        launch.find_python(str(python))
    other = a_python(tmp_path / "bin", "python3.11", "3.11")
    assert launch.find_python(str(python)) == str(other)


@pytest.mark.parametrize("version", launch.FITTING)
def test_the_real_pythons_of_this_machine_are_recognised(version):
    installed = (Path.home() / ".pyenv" / "versions").glob(f"{version}*/bin/python{version}")
    found = [*installed, Path(sys.executable)]
    assert launch.probe(str(found[0]))[0] in launch.FITTING
    assert launch.probe(str(found[0]))[1]


def test_set_up_happens_once_and_again_only_when_the_pins_change(alone, tmp_path, monkeypatch, capfd):
    use(monkeypatch, a_python(tmp_path, "python3", "3.12", pip=f"echo install >> {tmp_path}/calls; exit 0"))
    venv, calls = alone / ".venv", tmp_path / "calls"
    assert not launch.stands(venv, alone)
    assert launch.ensure(venv, alone) == venv / "bin" / "python" and launch.stands(venv, alone)
    assert (venv / "lib/python3.12/site-packages/tutorialbot.pth").read_text() == f"{alone}\n"
    json.loads((venv / "share/jupyter/lab/settings/overrides.json").read_text())
    launch.ensure(venv, alone)
    assert calls.read_text().count("install") == 1
    (alone / "environment.txt").write_text(PINS + "pin==4.1.0\n")
    (venv / "leftover").touch()
    assert not launch.stands(venv, alone)
    launch.ensure(venv, alone)
    assert calls.read_text().count("install") == 2 and not (venv / "leftover").exists()


def test_an_environment_of_another_folder_or_with_a_lost_python_does_not_stand(alone, tmp_path, monkeypatch):
    use(monkeypatch, a_python(tmp_path, "python3", "3.12"))
    venv = alone / ".venv"
    launch.ensure(venv, alone)
    moved = tmp_path / "moved"
    alone.rename(moved)
    assert not launch.stands(moved / ".venv", moved)
    moved.rename(alone)
    assert launch.stands(venv, alone)
    (venv / "bin" / "python").unlink()
    (tmp_path / "python3.13").touch()
    (venv / "bin" / "python").symlink_to(tmp_path / "python3.13")
    assert not launch.stands(venv, alone), "the system's Python went from 3.12 to 3.13 below the environment"
    (tmp_path / "python3.13").unlink()
    assert not launch.stands(venv, alone)


def test_an_active_environment_that_stands_is_used(alone, tmp_path, monkeypatch):
    use(monkeypatch, a_python(tmp_path, "python3", "3.12"))
    other = tmp_path / "other"
    launch.ensure(other, alone)
    monkeypatch.setattr(sys, "prefix", str(other))
    assert launch.ensure(alone / ".venv", alone) == Path(sys.executable)
    assert not (alone / ".venv").exists()


def test_somebody_elses_venv_is_never_deleted(alone, tmp_path, monkeypatch):
    use(monkeypatch, a_python(tmp_path, "python3", "3.12"))
    (alone / ".venv").mkdir()
    (alone / ".venv" / "precious").touch()
    with pytest.raises(SetupError, match="was not made by this command: move it away or delete it"):
        launch.ensure(alone / ".venv", alone)
    assert (alone / ".venv" / "precious").exists()


FAILURES = {
    "echo 'WARNING: Retrying after connection broken by NewConnectionError(...)'; "
    "echo 'ERROR: No matching distribution found for mujoco==4.0.0'; exit 1": "check the network and the proxy",
    "echo 'ERROR: Could not install: [Errno 28] No space left on device'; exit 1": "The disk is full: make room",
    "echo 'ERROR: No matching distribution found for ompl==2.0.1'; exit 1": "has no build for .* see Platforms",
    "echo 'ERROR: something odd'; exit 3": r"pip failed \(ERROR: something odd\): see .*install.log",
    "exit 1": "pip failed .without a word",
}


@pytest.mark.parametrize("pip", FAILURES)
def test_each_failure_of_pip_gets_one_line_and_the_next_run_mends_it(alone, tmp_path, monkeypatch, pip):
    use(monkeypatch, a_python(tmp_path, "python3", "3.12", pip=pip))
    with pytest.raises(SetupError, match=FAILURES[pip]) as caught:
        launch.ensure(alone / ".venv", alone)
    assert "\n" not in str(caught.value)
    assert (alone / ".venv" / STAMP).read_text() == UNFINISHED and not launch.stands(alone / ".venv", alone)
    use(monkeypatch, a_python(tmp_path, "python3", "3.12"))
    launch.ensure(alone / ".venv", alone)
    assert launch.stands(alone / ".venv", alone)


def test_no_room_and_no_right_to_write_are_one_line_each(alone, tmp_path, monkeypatch):
    use(monkeypatch, a_python(tmp_path, "python3", "3.12"))
    usage = launch.shutil.disk_usage(alone)
    monkeypatch.setattr(launch.shutil, "disk_usage", lambda _: usage._replace(free=1e9))
    with pytest.raises(SetupError, match=r"Only 1.0 GB free at .*: make room for"):
        launch.ensure(alone / ".venv", alone)
    assert not (alone / ".venv").exists()
    monkeypatch.undo()
    use(monkeypatch, a_python(tmp_path, "python3", "3.12"))
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "nowhere"))
    denied = PermissionError(13, "Permission denied", str(alone / ".venv"))
    monkeypatch.setattr(Path, "mkdir", lambda *_, **__: (_ for _ in ()).throw(denied))
    with pytest.raises(SetupError, match=r"\.venv: Permission denied: mend that, then"):
        launch.ensure(alone / ".venv", alone)


def test_a_broken_venv_module_is_named(alone, tmp_path, monkeypatch):
    python = a_python(tmp_path, "python3", "3.12")
    python.write_text(python.read_text().replace('mkdir -p "$3/bin"', 'echo "no ensurepip here"; exit 1'))
    use(monkeypatch, python)
    with pytest.raises(SetupError, match=r"-m venv failed \(no ensurepip here\): mend that, then"):
        launch.ensure(alone / ".venv", alone)


def test_a_pip_that_outlives_its_killed_parent_is_waited_for(alone, tmp_path, monkeypatch):
    slow = f"touch {tmp_path}/started; sleep 2; touch {tmp_path}/finished; exit 0"
    python = a_python(tmp_path, "python3", "3.12", pip=slow)
    code = (
        "import sys; from pathlib import Path; from tutorialbot import launch\n"
        f"sys.prefix = '/nowhere'; sys._base_executable = {str(python)!r}\n"
        f"launch.ensure(Path({str(alone / '.venv')!r}), Path({str(alone)!r}))"
    )
    with subprocess.Popen([sys.executable, "-c", code], cwd=launch.ROOT, stdout=subprocess.DEVNULL) as first:
        deadline = time.monotonic() + 30
        while not (tmp_path / "started").exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        first.kill()
    assert (alone / ".venv" / STAMP).read_text() == UNFINISHED
    use(monkeypatch, a_python(tmp_path, "python3", "3.12"))
    launch.ensure(alone / ".venv", alone)
    assert (tmp_path / "finished").exists(), "the orphan must not write into the new environment"
    assert launch.stands(alone / ".venv", alone)


def test_the_other_peoples_packages_stay_out(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "/opt/ros/lib/python3.12/site-packages")
    monkeypatch.setenv("KEPT", "1")
    assert "PYTHONPATH" not in launch._clean_environment() and launch._clean_environment()["KEPT"] == "1"


def test_entering_ends_with_one_line_and_a_status(alone, tmp_path, monkeypatch):
    use(monkeypatch, a_python(tmp_path, "python3", "3.9"))
    with pytest.raises(SystemExit) as caught:
        launch.enter(["lab"], alone / ".venv", alone)
    assert str(caught.value).strip().endswith(AGAIN) and str(caught.value).strip().count("\n") == 0
    monkeypatch.setattr(launch, "ensure", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(SystemExit, match="run the same command again"):
        launch.enter(["lab"], alone / ".venv", alone)


def test_entering_starts_the_same_command_inside(alone, tmp_path, monkeypatch):
    use(monkeypatch, a_python(tmp_path, "python3", "3.12"))
    started = []
    monkeypatch.setattr(os, "execve", lambda *arguments: started.append(arguments))
    launch.enter(["test", "--full"], alone / ".venv", alone)
    python = str(alone / ".venv" / "bin" / "python")
    assert started[0][:2] == (python, [python, "-m", "tutorialbot", "test", "--full"])
