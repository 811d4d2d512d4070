"""Trajectories: sampling, and files that come back whole or say what is wrong."""

import json

import numpy as np
import pinocchio as pin
import pytest

from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue
from tutorialbot.pose import interpolate
from tutorialbot.trajectory import PoseTrajectory, Trajectory


def some_poses(n: int = 4) -> PoseTrajectory:
    rng = np.random.default_rng(3)
    poses = [pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3)) for _ in range(n)]
    return PoseTrajectory(np.arange(n) * 0.5 + 1.0, poses)


def test_joint_samples():
    line = Trajectory(np.array([0.0, 1.0, 3.0]), np.array([[0.0, 5.0], [1.0, 5.0], [-1.0, 7.0]]))
    np.testing.assert_allclose(line.sample(0.25), [0.25, 5.0])
    np.testing.assert_allclose(line.sample(2.0), [0.0, 6.0])
    np.testing.assert_allclose(line.sample(-1.0), [0.0, 5.0])
    np.testing.assert_allclose(line.sample(9.0), [-1.0, 7.0])
    assert line.sample(np.linspace(0, 3, 7)).shape == (7, 2)
    assert line.duration == 3.0


def test_pose_samples_pass_through_the_poses_and_hold_at_the_ends():
    path = some_poses()
    for t, pose in zip(path.times, path.poses, strict=True):
        assert path.sample(t).isApprox(pose, 1e-12)
    assert path.sample(0.0) == path.poses[0] and path.sample(99.0) == path.poses[-1]
    assert path.sample(1.7).isApprox(interpolate(path.poses[1], path.poses[2], 0.4), 1e-9)
    assert path.duration == 1.5


def test_samples_are_copies():
    path = some_poses(1)
    path.sample(0.0).translation[:] = 9.0
    assert not np.allclose(path.poses[0].translation, 9.0)


def test_file_round_trip(tmp_path):
    path = some_poses()
    path.save(tmp_path / "door.json")
    again = PoseTrajectory.load(tmp_path / "door.json")
    np.testing.assert_array_equal(again.times, path.times)
    assert all(a.isApprox(b, 1e-12) for a, b in zip(again.poses, path.poses, strict=True))
    assert [p.name for p in tmp_path.iterdir()] == ["door.json"]


def break_length(content):
    content["positions"].pop()


def break_number(content):
    content["times"][1] = float("nan")


def break_quaternion(content):
    content["quaternions_wxyz"][0] = [0, 0, 0, 0]


def break_format(content):
    content["format"] = "another"


def break_key(content):
    del content["times"]


@pytest.mark.parametrize("fault", [break_length, break_number, break_quaternion, break_format, break_key])
def test_damaged_files_are_named(tmp_path, fault):
    file = tmp_path / "door.json"
    some_poses().save(file)
    content = json.loads(file.read_text())
    fault(content)
    file.write_text(json.dumps(content))
    with pytest.raises(BrokenFile, match="door.json"):
        PoseTrajectory.load(file)


@pytest.mark.parametrize("text", ["", "[]", "3", '{"format": ', "\x00\x01"])
def test_files_cut_short_or_foreign(tmp_path, text):
    file = tmp_path / "door.json"
    file.write_text(text)
    with pytest.raises(BrokenFile, match="door.json"):
        PoseTrajectory.load(file)


def test_a_save_that_fails_is_named_and_leaves_the_old_file(tmp_path, monkeypatch):
    file = tmp_path / "door.json"
    some_poses().save(file)
    before = file.read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(type(file), "replace", full)
    with pytest.raises(BrokenFile, match="door.json: cannot be written: No space left"):
        some_poses(2).save(file)
    assert file.read_bytes() == before
    with pytest.raises(BrokenFile, match="door.json: cannot be written"):
        some_poses().save(tmp_path / "none" / "door.json")


def test_bad_arguments():
    with pytest.raises(InvalidValue, match="times"):
        Trajectory(np.array([0.0, 0.0]), np.zeros((2, 1)))
    with pytest.raises(InvalidValue, match="times"):
        Trajectory(np.zeros(0), np.zeros((0, 1)))
    with pytest.raises(InvalidValue, match="positions"):
        Trajectory(np.array([0.0, 1.0]), np.zeros((3, 1)))
    with pytest.raises(InvalidValue, match="finite"):
        Trajectory(np.array([0.0, 1.0]), np.array([[0.0], [np.nan]]))
    with pytest.raises(InvalidValue, match="2, one for each instant"):
        PoseTrajectory(np.array([0.0, 1.0]), [pin.SE3.Identity()])
    with pytest.raises(InvalidType, match=r"poses\[0\]"):
        PoseTrajectory(np.array([0.0]), [np.eye(4)])
    with pytest.raises(InvalidValue, match="t = nan"):
        some_poses().sample(np.nan)
