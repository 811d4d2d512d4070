"""Journals and records must survive kills, and must refuse what is damaged."""

import errno
import json
import os
import resource
import signal
import subprocess
import sys

import numpy as np
import pytest

from tutorialbot import paths
from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue
from tutorialbot.paths import ROOT
from tutorialbot.runs import Journal, Profile, RunRecord, profile, progress

HEADER = {"task": "door", "seed": 3, "size": (1.0, 2.0)}


def test_profile_comes_from_the_argument_then_the_environment(monkeypatch):
    monkeypatch.delenv("TUTORIALBOT_PROFILE", raising=False)
    assert profile() == Profile("quick")
    monkeypatch.setenv("TUTORIALBOT_PROFILE", "paper")
    assert profile() == Profile("paper") and profile("quick").pick(quick=1, paper=2) == 1
    assert profile().pick(quick=1, paper=2) == 2
    with pytest.raises(InvalidValue, match="name = 'fast': expected one of 'paper', 'quick'"):
        profile("fast")
    monkeypatch.setenv("TUTORIALBOT_PROFILE", "slow")
    with pytest.raises(InvalidValue, match="TUTORIALBOT_PROFILE = 'slow'"):
        profile()


def test_progress_passes_everything_through():
    assert list(progress(range(3), description="counting")) == [0, 1, 2]
    with progress(total=2) as bar:
        bar.update(2)
        assert bar.n == 2


def test_journal_resumes_with_what_was_written(tmp_path):
    path = tmp_path / "deep" / "run.jsonl"
    with Journal(path, HEADER) as journal:
        assert journal.entries == []
        journal.append({"x": np.array([0.1, 1 / 3]), "n": np.int64(4), "pair": (1, 2)})
        journal.append({"t": float("inf")})
        written = list(journal.entries)
    with Journal(path, HEADER) as journal:
        assert journal.entries == written == [{"x": [0.1, 1 / 3], "n": 4, "pair": [1, 2]}, {"t": float("inf")}]
        journal.append({"k": 3})
    assert len(path.read_text().splitlines()) == 4


@pytest.mark.parametrize("cut", [1, 2, 7])
def test_torn_last_line_is_dropped_and_overwritten(tmp_path, cut):
    path = tmp_path / "run.jsonl"
    with Journal(path, HEADER) as journal:
        journal.append({"k": 1})
        journal.append({"k": 22222})
    path.write_bytes(path.read_bytes()[:-cut])
    with Journal(path, HEADER) as journal:
        assert journal.entries == [{"k": 1}]
        journal.append({"k": 3})
    with Journal(path, HEADER) as journal:
        assert journal.entries == [{"k": 1}, {"k": 3}]


def test_torn_header_starts_again_but_a_foreign_file_is_left_alone(tmp_path):
    path = tmp_path / "run.jsonl"
    Journal(path, HEADER).close()
    path.write_bytes(path.read_bytes()[:-5])
    with Journal(path, HEADER) as journal:
        assert journal.entries == []
    assert json.loads(path.read_text())["task"] == "door"
    path.write_text("my precious notes")
    with pytest.raises(BrokenFile, match="not a journal"):
        Journal(path, HEADER)
    assert path.read_text() == "my precious notes"


def test_damage_in_the_middle_names_the_line(tmp_path):
    path = tmp_path / "run.jsonl"
    with Journal(path, HEADER) as journal:
        for k in range(4):
            journal.append({"k": k})
    lines = path.read_text().splitlines(keepends=True)
    for bad in ['{"k": \n', "17\n", "\0\0\0\0\n"]:
        path.write_text("".join([*lines[:2], bad, *lines[3:]]))
        with pytest.raises(BrokenFile, match="line 3 is damaged"):
            Journal(path, HEADER)


def test_another_header_is_refused_unless_fresh(tmp_path):
    path = tmp_path / "run.jsonl"
    with Journal(path, HEADER) as journal:
        journal.append({"k": 1})
    other = HEADER | {"seed": 4}
    with pytest.raises(BrokenFile, match=r"'seed': 3.*'seed': 4"):
        Journal(path, other)
    with Journal(path, HEADER) as journal:
        assert journal.entries == [{"k": 1}]
    with Journal(path, other, fresh=True) as journal:
        assert journal.entries == []
    with Journal(path, other) as journal:
        assert journal.entries == []


def test_two_writers_are_refused(tmp_path):
    path = tmp_path / "run.jsonl"
    code = f"from tutorialbot.runs import Journal; Journal({str(path)!r}, {HEADER!r}, fresh=True)"
    with Journal(path, HEADER) as journal:
        journal.append({"k": 1})
        with pytest.raises(InvalidValue, match="nobody else is writing"):
            Journal(path, HEADER)
        other = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
        assert other.returncode != 0 and "nobody else is writing" in other.stderr
    with Journal(path, HEADER) as journal:
        assert journal.entries == [{"k": 1}], "a refused writer must not touch the file"


def test_a_killed_writer_loses_no_finished_entry(tmp_path):
    path = tmp_path / "run.jsonl"
    code = (
        "from tutorialbot.runs import Journal\n"
        f"journal = Journal({str(path)!r}, {HEADER!r})\n"
        "for k in range(10**9):\n"
        "    journal.append({'k': k})\n"
        "    if k == 100: print('go', flush=True)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE) as writer:
        assert writer.stdout.readline() == b"go\n"
        os.kill(writer.pid, signal.SIGKILL)
        writer.wait()
    with Journal(path, HEADER) as journal:
        assert len(journal.entries) > 100
        assert [entry["k"] for entry in journal.entries] == list(range(len(journal.entries)))


def test_a_full_disk_is_named_and_leaves_no_half_line(tmp_path):
    """A limit on the size of files stands for the disk: the kernel takes half of the line and refuses the rest."""
    path = tmp_path / "run.jsonl"
    with Journal(path, HEADER) as journal:
        journal.append({"k": 1})
        before, (soft, hard) = path.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 10, hard))
        try:
            for _ in range(2):
                with pytest.raises(BrokenFile, match="run.jsonl: cannot be written"):
                    journal.append({"k": "x" * 100})
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        assert path.read_bytes() == before
        journal.append({"k": 2})
    with Journal(path, HEADER) as journal:
        assert journal.entries == [{"k": 1}, {"k": 2}]


@pytest.mark.parametrize("bad", [None, 3])
def test_a_journal_needs_a_path(bad):
    with pytest.raises(InvalidType, match=f"path = {bad}"):
        Journal(bad, HEADER)


@pytest.mark.parametrize("bad", [None, [1], {(1, 2): 3}])
def test_a_header_is_a_dict(tmp_path, bad):
    with pytest.raises(InvalidType, match="header"):
        Journal(tmp_path / "run.jsonl", bad)
    assert not list(tmp_path.iterdir())


def test_only_dicts_of_plain_things_are_entries(tmp_path):
    journal = Journal(tmp_path / "run.jsonl", HEADER)
    for bad in ([1], {"f": print}, {(1, 2): 3}):
        with pytest.raises(InvalidType, match="entry"):
            journal.append(bad)
    assert journal.entries == []
    journal.close()
    journal.close()
    with pytest.raises(InvalidValue, match="still open"):
        journal.append({"k": 1})


def a_record(**changes) -> RunRecord:
    return RunRecord(**{"name": "door", "command": "bench door", "seed": 1, "profile": "quick", "seconds": 2.5,
                        "values": {"opened": np.float64(0.95), "curve": np.arange(3)}} | changes)  # fmt: skip


def test_record_comes_back_with_its_provenance(tmp_path):
    path = a_record().save(tmp_path / "new" / "door.json")
    record = RunRecord.load(path)
    assert record.values == {"opened": 0.95, "curve": [0, 1, 2]} and record.command == "bench door"
    assert record.versions["numpy"] == np.__version__ and record.versions["python"]
    assert len(record.date) == 10
    assert os.listdir(path.parent) == ["door.json"], "no temporary file stays behind"


def test_a_failing_save_leaves_the_old_record_whole(tmp_path):
    path = a_record().save(tmp_path / "door.json")
    before = path.read_bytes()
    with pytest.raises(InvalidType):
        a_record(values={"bad": object()}).save(path)
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["door.json"]


def test_a_save_that_is_cut_off_before_the_end_leaves_the_old_record(tmp_path, monkeypatch):
    path = a_record().save(tmp_path / "door.json")
    before = path.read_bytes()

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(BrokenFile, match="door.json: cannot be written: No space left"):
        a_record(seed=2).save(path)
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["door.json"]


def test_a_record_cannot_be_saved_below_a_file(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(BrokenFile, match="door.json: cannot be written"):
        a_record().save(tmp_path / "file" / "door.json")


@pytest.mark.parametrize(("field", "value"), [("values", [1]), ("seconds", "long"), ("seed", None), ("date", 3)])
def test_a_record_with_a_field_of_another_type_is_named(tmp_path, field, value):
    path = a_record().save(tmp_path / "door.json")
    path.write_text(json.dumps({**json.loads(path.read_text()), field: value}))
    with pytest.raises(BrokenFile, match=f"door.json: {field} = "):
        RunRecord.load(path)


@pytest.mark.parametrize("keep", [0, 1, 40, -3])
def test_truncated_record_is_named(tmp_path, keep):
    path = a_record().save(tmp_path / "door.json")
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(BrokenFile, match="door.json.*cut short"):
        RunRecord.load(path)


def test_wrong_or_missing_record(tmp_path):
    path = tmp_path / "door.json"
    with pytest.raises(BrokenFile, match="cannot be read: No such file"):
        RunRecord.load(path)
    for content, found in (([1], "list"), ({"name": "door"}, "'name'")):
        path.write_text(json.dumps(content))
        with pytest.raises(BrokenFile, match=f"expected a record with the fields.*found.*{found}"):
            RunRecord.load(path)


def test_the_digest_of_the_sources_sees_methods_and_models_and_nothing_else(tmp_path, monkeypatch):
    for name in ("bo/search.py", "scene/door.py", "pose.py", "plots.py"):
        path = tmp_path / "tutorialbot" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x = 1\n")
    (tmp_path / "models").mkdir()
    monkeypatch.setattr(paths, "ROOT", tmp_path)
    monkeypatch.setattr(paths, "MODELS", tmp_path / "models")
    monkeypatch.setattr(paths, "METHODS", ("bo", "scene", "pose.py"))
    digests = [paths.source_digest()]
    for name in ("tutorialbot/plots.py", "tutorialbot/bo/search.py", "tutorialbot/pose.py", "models/door.xml"):
        (tmp_path / name).write_text("x = 2\n")
        digests.append(paths.source_digest())
    assert digests[0] == digests[1] and len(set(digests)) == 4


def test_every_method_room_is_there():
    assert all((paths.ROOT / "tutorialbot" / room).exists() for room in paths.METHODS)


def test_the_digest_reads_all_that_a_search_imports():
    """But for checks of arguments, files and bars, which decide no number."""
    code = (
        "import sys, tutorialbot.bo.search\n"
        "print(*(m.partition('.')[2] for m in sys.modules if m.startswith('tutorialbot.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    rooms = {name.partition(".")[0] for name in done.stdout.split()} - {"errors", "paths", "runs"}
    assert rooms == {room.removesuffix(".py") for room in paths.METHODS}
