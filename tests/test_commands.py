"""The command line: verbs, totals that count every failure, headless runs that go on, a JupyterLab that answers."""

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from contextlib import suppress
from pathlib import Path

import nbformat
import pytest

from tutorialbot import commands, doctor, headless, launch
from tutorialbot.__main__ import VERBS, main, make_parser
from tutorialbot.commands import Tally
from tutorialbot.paths import ROOT


def test_every_verb_has_help_and_something_behind_it(capsys):
    for verb in VERBS:
        with pytest.raises(SystemExit) as caught:
            make_parser().parse_args([verb, "--help"])
        assert caught.value.code == 0 and len(capsys.readouterr().out) > 60
        assert callable(getattr(commands, verb))


@pytest.mark.parametrize(
    ("argv", "message"),
    [(["dance"], "invalid choice: 'dance'"), ([], "VERB"), (["test", "--ful1"], "unknown option for test: --ful1"),
     (["bench"], "NAME"), (["grade"], "FOLDER")],
)  # fmt: skip
def test_a_wrong_command_line_is_explained(argv, message, capsys):
    with pytest.raises(SystemExit) as caught:
        main(argv)
    assert caught.value.code == 2 and message in capsys.readouterr().err


def test_what_follows_a_benchmarks_name_goes_to_the_benchmark(monkeypatch):
    seen = []
    monkeypatch.setattr(launch, "enter", lambda _: None)
    monkeypatch.setattr(commands, "run_verb", lambda options, further: seen.append((options.name, further)) or 0)
    assert main(["bench", "door", "--seeds", "3", "--help"]) == 0
    assert seen == [("door", ["--seeds", "3", "--help"])]


def test_the_help_names_all_benchmarks(capsys):
    from tutorialbot import bench

    with pytest.raises(SystemExit):
        make_parser().parse_args(["bench", "--help"])
    said = capsys.readouterr().out
    assert set(bench.SEEDS) == set(bench.BENCHMARKS) and all(name in said for name in bench.BENCHMARKS)


def test_the_command_line_starts_on_a_bare_python():
    """No site-packages at all, as on a fresh machine."""
    for argv in (["--help"], ["lab", "--help"]):
        command = [sys.executable, "-I", "-S", "-c", f"import sys; sys.path.insert(0, {str(ROOT)!r}); "
                   f"from tutorialbot.__main__ import main; main({argv!r})"]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0 and "tutorialbot" in done.stdout, done.stderr


OLD = sorted((Path.home() / ".pyenv" / "versions").glob("3.[6-9].*/bin/python"))


@pytest.mark.skipif(not OLD, reason="no Python 3.6 to 3.9 here to try: the syntax is checked by the next test")
def test_an_old_python_gets_as_far_as_the_help():
    for python in OLD:
        done = subprocess.run([python, "-m", "tutorialbot", "--help"], cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == 0, f"{python}: {done.stderr}"


def test_what_starts_first_uses_no_new_syntax():
    for name in ("__init__.py", "__main__.py", "launch.py"):
        text = (ROOT / "tutorialbot" / name).read_text(encoding="utf-8")
        compile(text, name, "exec", dont_inherit=True)
        assert not re.search(r"(?m)^\s*match .*:$|:=|-> \w+ \||: \w+ \| |-> (list|tuple|dict)\[", text)


JUNIT = """<testsuites><testsuite name="pytest">
<testcase name="a"/>
<testcase name="b"><failure message="no"/></testcase>
<testcase name="c"><error message="no"/></testcase>
<testcase name="d"><skipped type="pytest.skip" message="no EGL"/></testcase>
<testcase name="e"><skipped type="pytest.xfail"/></testcase>
</testsuite></testsuites>"""


def test_totals_count_failures_errors_and_skips(tmp_path):
    junit = tmp_path / "junit.xml"
    junit.write_text(JUNIT)
    tally = commands.read_tally("pytest", junit, 1, 2.0)
    assert (tally.passed, tally.failed, tally.skipped) == (2, 2, ["no EGL"])


@pytest.mark.parametrize("content", [None, "", "<testsuites><testsuite></testsuite></testsuites>"])
def test_a_run_that_died_is_a_failure(tmp_path, content):
    junit = tmp_path / "junit.xml"
    if content is not None:
        junit.write_text(content)
    assert commands.read_tally("pytest", junit, 3, 1.0).failed == 1


def test_the_summary_lists_skips_and_full_forbids_them():
    tallies = [Tally("ruff", 1), Tally("pytest", 7, 0, ["no EGL", "no EGL", "no Chromium"])]
    text, status = commands.summary(tallies, full=False)
    assert status == 0 and "  2 x no EGL\n  1 x no Chromium\n" in text and text.endswith("\n8 passed, 0 failed")
    text, status = commands.summary(tallies, full=True)
    assert status == 1 and text.endswith("\n8 passed, 3 failed") and "skips nothing" in text
    text, status = commands.summary([Tally("ruff", 0, 1), Tally("pytest", 7)], full=False)
    assert status == 1 and text.endswith("7 passed, 1 failed") and "Skipped" not in text


def test_an_unknown_benchmark_and_a_bad_value_end_with_status_2(monkeypatch, capsys):
    from tutorialbot.errors import InvalidValue

    def refuse(*_):
        raise InvalidValue("name", "dance", "one of 'door'")

    monkeypatch.setattr(commands, "bench", refuse)
    refuse.__name__ = "bench"
    assert commands.run_verb(make_parser().parse_args(["bench", "dance"]), []) == 2
    assert "name = 'dance': expected one of 'door'" in capsys.readouterr().err


def test_a_disk_that_is_full_ends_a_verb_with_one_line(monkeypatch, capsys):
    def full(options, further):
        raise OSError(28, "No space left on device", "page.html")

    full.__name__ = "run"
    monkeypatch.setattr(commands, "run", full)
    assert commands.run_verb(make_parser().parse_args(["run"]), []) == 2
    assert capsys.readouterr().err == "page.html: No space left on device\n"


@pytest.fixture
def pages(tmp_path, monkeypatch):
    """A folder of notebooks in place of ours; `pages(name, *cells)` writes one."""
    folder = tmp_path / "notebooks"
    folder.mkdir()
    monkeypatch.setattr(commands, "NOTEBOOKS", folder)
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path / "results"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))

    def write(name, *cells):
        made = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
        nbformat.write(made, folder / name)

    return write


def test_a_page_carries_its_pictures(tmp_path):
    (tmp_path / "dot.png").write_bytes((ROOT / "data" / "pictures" / "door.png").read_bytes())
    cells = [nbformat.v4.new_markdown_cell("![a](dot.png)")]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), tmp_path / "a.ipynb")
    headless.execute(tmp_path / "a.ipynb", tmp_path / "a.html", "source")
    page = (tmp_path / "a.html").read_text()
    assert "data:image/png;base64" in page and 'src="dot.png"' not in page


def test_run_writes_pages_goes_on_after_a_failure_and_skips_what_is_done(pages, tmp_path, capsys):
    pages("1_good.ipynb", "print('six' + 'teen')")
    pages("2_bad.ipynb", "print('before')", "1 / 0")
    pages("3_good.ipynb", "print(2)")
    options = make_parser().parse_args(["run"])
    assert commands.run(options, []) == 1
    out = capsys.readouterr().out
    assert "2_bad.ipynb: FAILED" in out and "ZeroDivisionError" in out and re.search(r"3_good.ipynb: \d+ s", out)
    assert "sixteen" in (tmp_path / "results/html/1_good.html").read_text()
    assert not (tmp_path / "results/html/2_bad.html").exists()
    assert sorted(p.suffix for p in (tmp_path / "results/html").iterdir()) == [".html", ".html"]
    pages("2_bad.ipynb", "print('mended')")
    assert commands.run(options, []) == 0
    assert capsys.readouterr().out.count("done before") == 2
    pages("1_good.ipynb", "print('changed')")
    assert commands.run(options, []) == 0
    assert capsys.readouterr().out.count("done before") == 2
    assert commands.run(make_parser().parse_args(["run", "--fresh"]), []) == 0
    assert "done before" not in capsys.readouterr().out


def test_a_torn_page_is_not_done(tmp_path):
    page = tmp_path / "page.html"
    assert not headless.is_done(page, "abc")
    page.write_text("<html></html>\n" + headless.MARK.format("abc"))
    assert headless.is_done(page, "abc") and not headless.is_done(page, "def")
    page.write_text(page.read_text()[:-4])
    assert not headless.is_done(page, "abc")


def test_an_interrupted_run_keeps_what_is_done_and_leaves_no_kernel(pages, tmp_path):
    import psutil

    pages("1_quick.ipynb", "print(1)")
    pages("2_slow.ipynb", f"open({str(tmp_path / 'begun')!r}, 'w').close(); import time; time.sleep(300)")
    code = (
        "from pathlib import Path; from tutorialbot import commands; from tutorialbot.__main__ import make_parser\n"
        f"commands.NOTEBOOKS = Path({str(tmp_path / 'notebooks')!r})\n"
        "raise SystemExit(commands.run_verb(make_parser().parse_args(['run']), []))"
    )
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 120
        while not (tmp_path / "begun").exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        family = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=60)
    assert process.returncode == 130 and "2_slow.ipynb: interrupted; run again to go on from here" in out
    assert [p.name for p in (tmp_path / "results/html").iterdir()] == ["1_quick.html"]
    assert family and psutil.wait_procs(family, timeout=20)[1] == []


def test_doctor_finds_faults(monkeypatch, capsys):
    monkeypatch.setattr(doctor.platform, "python_version", lambda: "3.14.1")
    monkeypatch.setattr(doctor.platform, "machine", lambda: "riscv64")
    monkeypatch.setattr(doctor, "_works", lambda code, **_: "ompl" not in code and "Renderer" not in code)
    monkeypatch.setattr(doctor, "find_chromium", lambda: None)
    monkeypatch.setattr(doctor.platform, "system", lambda: "Linux")
    monkeypatch.setattr(doctor.shutil, "which", lambda name: None)
    checks = (doctor.check_python, doctor.check_system, doctor.check_imports, doctor.check_egl, doctor.check_chromium,
              doctor.check_fonts)  # fmt: skip
    assert doctor.examine(checks) is False
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["BAD", "BAD", "BAD", "note", "note", "note"]
    assert "ompl" in lines[2] and "sudo apt install libegl1" in lines[3] and "sudo apt install chromium" in lines[4]


def test_doctor_compares_versions_with_the_pins(tmp_path, monkeypatch):
    monkeypatch.setattr(doctor, "ROOT", tmp_path)
    import numpy

    (tmp_path / "environment.txt").write_text(f"numpy=={numpy.__version__}  # arrays\n")
    assert doctor.check_versions()[0] == doctor.GOOD
    (tmp_path / "environment.txt").write_text('numpy==0.1\nno-such-thing==1.0\nother==1 ; sys_platform == "darwin"\n')
    state, _, found = doctor.check_versions()
    assert state == doctor.BAD and f"numpy {numpy.__version__} (expected 0.1), no-such-thing missing" in found


@pytest.mark.full
def test_jupyterlab_answers_on_the_loopback_address_with_its_token_only(tmp_path):
    env = {**os.environ, "JUPYTER_RUNTIME_DIR": str(tmp_path), "JUPYTER_CONFIG_DIR": str(tmp_path / "config")}
    command = commands.lab_command(["--no-browser", "--ServerApp.port=0"])
    with subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server:
        try:
            deadline, status = time.monotonic() + 90, None
            while status is None and time.monotonic() < deadline:
                time.sleep(0.2)
                with suppress(OSError, ValueError, StopIteration):  # not written yet, or not listening yet
                    found = json.loads(next(iter(tmp_path.glob("jpserver-*.json"))).read_text())
                    page = f"{found['url']}api/contents/notebooks/{commands.FIRST_PAGE}?content=0"
                    with urllib.request.urlopen(f"{page}&token={found['token']}", timeout=30) as answer:
                        status = answer.status
            assert status == 200
            assert found["hostname"] == "127.0.0.1" and len(found["token"]) > 20 and found["root_dir"] == str(ROOT)
            with pytest.raises(urllib.error.HTTPError, match="403"):
                urllib.request.urlopen(page, timeout=30)
        finally:
            server.terminate()
