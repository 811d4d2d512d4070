"""Plain misuse of the public calls: an error of ours that names the argument, never one of a library."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from tutorialbot import paths, report
from tutorialbot.bo.presets import PRESETS
from tutorialbot.errors import BrokenFile, TutorialbotError, finite_array, finite_number, step_count, whole_number
from tutorialbot.pose import so4_distance
from tutorialbot.runs import Journal, RunRecord
from tutorialbot.scene.door import Door
from tutorialbot.scene.world import Settings
from tutorialbot.trajectory import PoseTrajectory

GATE = """<mujoco><worldbody><body><joint name="h" type="{kind}"/><geom size=".1"/><site name="g"/></body></worldbody>
</mujoco>"""


def refused(argument):
    return pytest.raises(TutorialbotError, match=f"^{re.escape(argument)} = ")


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("reject_above", float("nan")),
        ("reject_above", "x"),
        ("ceiling", float("nan")),
        ("ceiling", None),
        ("patience", -5),
        ("make", None),
        ("cost", None),
        ("space", None),
        ("settings", None),
        ("name", None),
    ],
)
def test_a_preset_of_ones_own_is_checked(argument, value):
    with refused(argument):
        replace(PRESETS["improved"], **{argument: value})


@pytest.mark.parametrize(("argument", "value"), [("hinge", 3), ("hinge", None), ("grip", None), ("handle", 3)])
def test_names_in_an_mjcf_are_text(tmp_path, argument, value):
    path = tmp_path / "gate.xml"
    path.write_text(GATE.format(kind="hinge"))
    with refused(argument):
        Door.from_mjcf(path, **{"hinge": "h", "grip": "g", argument: value})
    with refused("path"):
        Door.from_mjcf(None, hinge="h", grip="g")


@pytest.mark.parametrize("kind", ["free", "ball"])
def test_a_hinge_is_one_number(tmp_path, kind):
    path = tmp_path / "gate.xml"
    path.write_text(GATE.format(kind=kind))
    with refused("hinge"):
        Door.from_mjcf(path, hinge="h", grip="g")


def test_odd_values_are_named():
    with refused("side"):
        Door(side=np.array([1, 2]))
    with refused("mass"):
        Door(mass=10**400)
    with refused("paper"):
        report.paper_values(True)
    assert finite_number("x", np.float32(0.5)) == 0.5


class Odd:
    def __array__(self, *_, **__):
        raise RuntimeError("odd")


NO_NUMBERS = [[True, False], ["1", "2"], "12", [1, [2]], [1j, 2], {1, 2}, None, Odd(), [10**400, 1],
              np.array(["2020", "2021"], "M8[Y]")]  # fmt: skip


@pytest.mark.parametrize("value", NO_NUMBERS, ids=lambda value: type(value).__name__)
def test_what_is_no_array_of_numbers(value):
    with refused("x"):
        finite_array("x", value, (2,))
    assert finite_array("x", (1, np.float32(0.5)), (2,)).tolist() == [1.0, 0.5]
    assert finite_array("x", [], (-1,)).shape == (0,)


def test_whole_numbers_have_bounds():
    assert whole_number("n", 5, 5, 5) == 5
    for value in (4, 6, 10**5000, -(10**5000)):
        with pytest.raises(TutorialbotError, match="^n = .*: expected a whole number >= 5 and <= 5"):
            whole_number("n", value, 5, 5)


def test_steps_have_bounds_and_the_odd_one_is_named():
    assert step_count(1.0, 0.1, 0.5) == 2.0 and step_count(1e3, 0.1, 1e-3) == 1e6
    assert step_count(0.0, 0.1, 0.01, least=0.0) == 0.0
    for speed, dt, named in ((1e-9, 1e-3, "speed"), (1e9, 1e-3, "speed"), (0.2, 1e-9, "dt"), (0.2, 1e9, "dt")):
        with refused(named):
            step_count(1.0 / speed, speed, dt)


def test_files_nested_beyond_reason_are_broken(tmp_path):
    path = tmp_path / "deep.json"
    path.write_text("[" * 100_000)
    for load in (PoseTrajectory.load, RunRecord.load):
        with pytest.raises(BrokenFile, match="deep.json"):
            load(path)
    path.write_text("{}\n" + "[" * 100_000 + "\n")
    with pytest.raises(BrokenFile, match="line 2"):
        Journal(path, {})


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(BrokenFile, match="cannot be read"):
        PoseTrajectory.load(tmp_path / "none.json")
    with pytest.raises(BrokenFile, match="cannot be written"):
        Journal(tmp_path, {})
    (tmp_path / "file").write_text("")
    with pytest.raises(BrokenFile, match="cannot be written"):
        Journal(tmp_path / "file" / "journal", {})


def test_the_results_folder_must_be_a_folder(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    for name in ("file", "file/below"):
        monkeypatch.setenv("TUTORIALBOT_RESULTS", str(tmp_path / name))
        with refused("TUTORIALBOT_RESULTS"):
            paths.results()


@pytest.mark.parametrize("stiffness", [0.0, 1e6, float("inf"), "soft"])
def test_an_arm_that_cannot_be_is_refused(stiffness):
    with refused("stiffness"):
        Settings(stiffness=stiffness)


SHEAR = np.array([[1.0, 0.001, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("matrix", [np.zeros((3, 3)), 2 * np.eye(3), np.diag([1.0, 1.0, -1.0]), SHEAR])
def test_a_matrix_that_is_no_rotation_is_no_pose(matrix):
    wrong = pin.SE3(matrix, np.zeros(3))
    with refused("b"):
        so4_distance(pin.SE3.Identity(), wrong)
    with pytest.raises(TutorialbotError, match=r"^poses\[0\] = "):
        PoseTrajectory([0.0], [wrong])


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_a_paper_states_finite_numbers(tmp_path, value):
    path = Path(tmp_path / "values.csv")
    path.write_text(",".join(report.COLUMNS) + f"\n1,section 4,w,{value},m,,reason\n")
    with pytest.raises(BrokenFile, match="row 2"):
        report.paper_values(1, path)


@pytest.mark.parametrize(
    "value", [["1", "2"], [True, False], [1j, 2.0], [10**400, 1], [None, 1.0], [b"1", b"2"], [[1], [2, 3]]]
)
def test_an_array_of_numbers_holds_numbers(value):
    with refused("x"):
        finite_array("x", value, (2,))


def test_large_whole_numbers_are_numbers():
    assert finite_number("x", 10**30) == 1e30
    assert finite_array("x", [10**30, -(2**70)], (2,)).tolist() == [1e30, -(2.0**70)]
    with refused("x"):
        finite_number("x", 10**30, 0.0, 1.0)
