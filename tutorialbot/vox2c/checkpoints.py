"""Checkpoints of a training: model, optimizer and what the run found so far, as safetensors (never pickle)."""

import json
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from tutorialbot.errors import BrokenFile
from tutorialbot.runs import write_then_rename


def use_threads(count: int) -> None:
    """Let torch use so many cores."""
    torch.set_num_threads(count)


def save(path: Path, model: torch.nn.Module, optimizer: torch.optim.Optimizer, header: dict, state: dict) -> None:
    """Write a checkpoint, so that `path` is never half of one; header and state are plain data (JSON)."""
    tensors = {f"model.{key}": tensor.detach().cpu().contiguous() for key, tensor in model.state_dict().items()}
    for i, moments in optimizer.state_dict()["state"].items():
        tensors |= {f"optimizer.{i}.{key}": torch.as_tensor(value).cpu().contiguous() for key, value in moments.items()}
    rates = [group["lr"] for group in optimizer.param_groups]
    notes = {"header": json.dumps(header), "state": json.dumps(state), "rates": json.dumps(rates)}
    try:
        write_then_rename(path, lambda part: save_file(tensors, part, notes))  # straight from memory: it may be 0.4 GB
    except SafetensorError as error:
        raise BrokenFile(f"{path}: cannot be written: {error}") from None


def restore(path: Path, model: torch.nn.Module, optimizer: torch.optim.Optimizer, header: dict) -> dict[str, Any]:
    """Put model and optimizer into the state of the checkpoint and return what was saved as `state`.

    Raises BrokenFile when the file is damaged, cut short, or belongs to a run with another header.
    """
    try:
        with safe_open(path, framework="pt") as file:
            notes = {key: json.loads(value) for key, value in (file.metadata() or {}).items()}
            tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118 - no mapping
    except (SafetensorError, ValueError, OSError) as error:
        raise BrokenFile(f"{path}: no whole checkpoint (damaged or cut short): {error}") from None
    if notes.get("header") != json.loads(json.dumps(header)):
        raise BrokenFile(
            f"{path}: belongs to another run: {notes.get('header')}, expected {header} (--fresh starts anew)"
        )
    moments: dict[int, dict] = {}
    for key, tensor in tensors.items():
        if key.startswith("optimizer."):
            _, i, name = key.split(".", 2)
            moments.setdefault(int(i), {})[name] = tensor
    try:
        model.load_state_dict({key[6:]: value for key, value in tensors.items() if key.startswith("model.")})
        optimizer.load_state_dict({"state": moments, "param_groups": optimizer.state_dict()["param_groups"]})
        for group, rate in zip(optimizer.param_groups, notes["rates"], strict=True):
            group["lr"] = rate
        return notes["state"]
    except (KeyError, ValueError, RuntimeError) as error:
        raise BrokenFile(f"{path}: does not fit this network: {error}") from None
