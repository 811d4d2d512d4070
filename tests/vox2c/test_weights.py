"""Weights on disk: what is written comes back; what is damaged, cut short or of another shape is refused by name."""

import numpy as np
import pytest
from safetensors.numpy import save as serialize

from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue
from tutorialbot.runs import RunRecord
from tutorialbot.vox2c import weights

TENSORS = {"a": np.arange(6, dtype=np.float32).reshape(2, 3) / 8, "b": np.array([0.5], dtype=np.float32)}


def record(name="one"):
    return RunRecord(name, "train it", 3, "paper", 1.5, {"threshold": 0.5}, weights.training_versions())


@pytest.mark.parametrize("half", [True, False])
def test_what_is_saved_comes_back_with_its_record(tmp_path, half):
    path = weights.save(TENSORS, record(), tmp_path, half=half)
    found = weights.load("one", tmp_path)
    assert weights.names(tmp_path) == ["one"] and path.stat().st_size == found.record.values["bytes"]
    assert found.record.seed == 3 and {"torch", "numba", "safetensors"} <= found.record.versions.keys()
    for name, tensor in TENSORS.items():
        assert found.tensors[name].dtype == np.float32 and np.array_equal(found.tensors[name], tensor)
    assert [file.name for file in sorted(tmp_path.iterdir())] == ["one.json", "one.safetensors"]


@pytest.mark.parametrize("damage", ["cut", "bit", "empty", "gone"])
def test_a_damaged_file_is_refused(tmp_path, damage):
    path = weights.save(TENSORS, record(), tmp_path)
    content = bytearray(path.read_bytes())
    if damage == "bit":
        content[-1] ^= 1
    path.write_bytes({"cut": content[:-2], "bit": content, "empty": b"", "gone": b""}[damage])
    if damage == "gone":
        path.with_suffix(".json").unlink()
    with pytest.raises(BrokenFile, match=r"one\.json" if damage == "gone" else "damaged or cut short"):
        weights.load("one", tmp_path)


def test_a_file_that_is_no_safetensors_is_refused_even_with_a_fitting_checksum(tmp_path, monkeypatch):
    monkeypatch.setattr(weights, "serialize", lambda _: b"pickled")
    weights.save(TENSORS, record(), tmp_path)
    with pytest.raises(BrokenFile, match="no safetensors file"):
        weights.load("one", tmp_path)


def test_numbers_that_are_not_finite_are_neither_written_nor_read(tmp_path, monkeypatch):
    for bad in (np.nan, np.inf, 1e6):  # the last is beyond float16
        with pytest.raises(InvalidValue, match="float16"):
            weights.save({"a": np.array([bad])}, record(), tmp_path)
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(weights, "serialize", lambda _: serialize({"a": np.array([np.nan], dtype=np.float16)}))
    weights.save(TENSORS, record(), tmp_path)
    with pytest.raises(BrokenFile, match="not finite"):
        weights.load("one", tmp_path)


@pytest.mark.parametrize("kind", [np.int64, bool, np.uint8])
def test_numbers_of_another_kind_are_refused(tmp_path, monkeypatch, kind):
    monkeypatch.setattr(weights, "serialize", lambda _: serialize({"a": np.ones(3, dtype=kind)}))
    weights.save(TENSORS, record(), tmp_path)
    with pytest.raises(BrokenFile, match="a holds .* expected floating-point numbers"):
        weights.load("one", tmp_path)


def test_an_unknown_name_lists_the_known_ones(tmp_path):
    weights.save(TENSORS, record(), tmp_path)
    with pytest.raises(InvalidValue, match="'one'"):
        weights.load("two", tmp_path)
    with pytest.raises(InvalidType, match="name"):
        weights.load(7, tmp_path)


@pytest.mark.parametrize("change", [{"a": (3, 2)}, {"c": (1,)}, {"a": None}])
def test_other_shapes_are_refused_with_both_named(change):
    shapes = {name: tensor.shape for name, tensor in TENSORS.items()}
    weights.check_shapes("one", TENSORS, shapes)
    expected = {name: shape for name, shape in (shapes | change).items() if shape}
    with pytest.raises(BrokenFile, match=rf"tensor {next(iter(change))} has shape .*expected"):
        weights.check_shapes("one", TENSORS, expected)


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BrokenFile, match="cannot be written"):
        weights.save(TENSORS, record(), tmp_path / "file" / "deeper")
