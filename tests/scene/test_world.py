"""The world of a trial: what is only seen can be left out of it."""

import mujoco
import numpy as np
import pytest

from tutorialbot.bo.objective import start_posture
from tutorialbot.scene.door import Door
from tutorialbot.scene.world import MOVING, Settings, assemble


@pytest.mark.parametrize("door", [Door(), Door(latch="bolt", side="left")], ids=["latch", "bolt"])
def test_without_what_is_seen_every_number_is_the_same(door):
    posture, ends = start_posture(door), []
    for visible in (False, True):
        model, _ = assemble(door, Settings(), seen=visible)
        data = mujoco.MjData(model)
        data.qpos[[model.joint(name).qposadr[0] for name in MOVING]] = posture
        controls = [model.actuator(name).id for name in MOVING]
        states = []
        for step in range(150):
            data.ctrl[controls] = posture + 0.05 * np.sin(0.1 * step + np.arange(9))
            mujoco.mj_step(model, data)
            states.append(np.concatenate([data.qpos, data.qvel, data.sensordata, data.qfrc_constraint]))
        ends.append((model, np.array(states)))
    (bare, felt), (full, also_felt) = ends
    np.testing.assert_array_equal(felt, also_felt)
    assert np.abs(felt[-1] - felt[0]).max() > 0.01  # something happened
    assert bare.ngeom < full.ngeom / 3
    kept = {bare.geom(g).name for g in range(bare.ngeom)}
    touching = {full.geom(g).name for g in range(full.ngeom) if full.geom_contype[g] or full.geom_conaffinity[g]}
    assert touching | {"door/spindle", "door/bar"} <= kept  # what touches, and what weighs
