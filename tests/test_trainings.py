"""The verb `train`: from the command line to stored weights, and again from where it was stopped."""

import pytest

from tutorialbot import launch, trainings
from tutorialbot.__main__ import main
from tutorialbot.errors import InvalidValue
from tutorialbot.paths import DATA
from tutorialbot.vox2c import dataset, linkframe, linkframe_data, linkframe_training, network, training


@pytest.fixture(autouse=True)
def small(monkeypatch, tmp_path):
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path))
    monkeypatch.setattr(launch, "enter", lambda _: None)
    for name, value in {"VALIDATED": 4, "EVALUATED": 3}.items():
        monkeypatch.setattr(linkframe_training, name, value)
    design = linkframe.Design(filters=2, maps=1, hidden=(4, 4), along=(0.0, 0.4, 3), across=(-0.05, 0.05, 2))
    presets = {"tiny": linkframe_data.Settings(design, steps=2, scenes=4, fresh=4)}
    monkeypatch.setattr(linkframe_training, "PRESETS", presets)

    def pairs(settings, jobs):
        read = {"train": settings.scenes, "validation": 4, "test": 4}
        return tuple(dataset.read(settings.recipe, split, count, DATA / "vox2c") for split, count in read.items())

    monkeypatch.setattr(training, "pairs", pairs)


def test_a_link_frame_predictor_from_the_command_line(tmp_path, capsys):
    argv = ["linkframe", "--preset", "tiny", "--threads", "1", "--seed", "3"]
    assert main(["train", *argv]) == 0
    printed = capsys.readouterr().out
    assert "step     2" in printed and "tiny.safetensors" in printed
    record = linkframe.load("tiny", tmp_path / "weights").record
    assert record.seed == 3 and record.command == "python3 -m tutorialbot train " + " ".join(argv)


def test_the_papers_network_from_the_command_line_and_on_from_there(tmp_path, capsys):
    argv = [
        "train",
        "vox2c",
        "--resolution",
        "5",
        "--scenes",
        "8",
        "--width",
        "0.02",
        "--epochs",
        "2",
        "--threads",
        "1",
    ]
    assert main([*argv, "--minutes", "0.0001"]) == 0
    assert main(argv) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("epoch")]
    assert [line.split()[1] for line in lines] == ["1.00", "1.00", "2.00"]
    one = network.load("paper-5deg-width0.02", tmp_path / "weights")
    assert one.resolution_deg == 5 and len(one.record.values["curve"]) == 2


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        (["dance"], "'linkframe', 'vox2c'"),
        (["linkframe", "--preset", "x"], "'tiny'"),
        (["linkframe", "--preset", "tiny", "--steps", "0"], "--steps"),
        (["vox2c", "--resolution", "7"], "resolution_deg = 7"),
        (["vox2c", "--minutes", "-1", "--resolution", "5", "--scenes", "8"], "--minutes"),
        (["vox2c", "--threads", "0"], "--threads"),
        (["vox2c", "--labels", "true"], "'octree'"),
    ],
)
def test_bad_options_are_named(argv, named):
    with pytest.raises(InvalidValue, match=named):
        trainings.main(argv)


@pytest.mark.parametrize(
    "option", [("--minutes", "nan"), ("--minutes", "0"), ("--minutes", "-1"), ("--width", "1e9"), ("--width", "nan")]
)
def test_odd_options_are_refused_before_any_data_is_made(monkeypatch, tmp_path, option):
    monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path))
    with pytest.raises(InvalidValue, match=f"^(--)?{option[0][2:]} = "):
        trainings.main(["vox2c", *option])
    assert not list(tmp_path.rglob("*.bits"))
