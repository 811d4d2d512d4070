"""What a scene records, sends and packs; no browser and no kernel."""

import gc
import gzip
import json
import re
import shutil
import struct
import subprocess
import time
from base64 import b64decode
from pathlib import Path
from types import SimpleNamespace

import meshcat.commands as mc
import meshcat.geometry as mg
import numpy as np
import pinocchio
import psutil
import pytest
import umsgpack
from meshcat.animation import Animation

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.viewers import Scene, widget
from tutorialbot.viewers.log import pack

SCRIPTS = sorted((Path(widget.__file__).parent).glob("*.js"))


def unpacked(block: bytes) -> tuple[dict, list[dict]]:
    """Read a snapshot by its written format alone."""
    data = gzip.decompress(block)
    (length,) = struct.unpack_from("<I", data)
    header, at, commands = json.loads(data[4 : 4 + length]), 4 + length, []
    for size in header["sizes"]:
        commands.append(umsgpack.unpackb(data[at : at + size]))
        at += size
    assert at == len(data)
    return header, commands


def recorded(scene: Scene) -> list[dict]:
    return [umsgpack.unpackb(body) for body in scene.window.entries.values()]


def shift(x: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix


def test_commands_are_meshcats_own():
    scene, box, colour = Scene(), mg.Box([1, 2, 3]), mg.MeshPhongMaterial(color=0x123456)
    scene["a/b"].set_object(box, colour)
    scene["a/b"].set_transform(shift(2.0))
    made, moved = recorded(scene)
    path = scene["a/b"].path
    expected = mc.SetObject(box, colour, path).lower()
    made["object"]["object"].pop("uuid"), expected["object"]["object"].pop("uuid")
    assert made == expected
    assert moved == mc.SetTransform(shift(2.0), path).lower()


def test_log_keeps_the_last_of_each_key_and_does_not_grow():
    scene = Scene()
    scene["a"].set_object(mg.Sphere(1.0))
    for x in range(500):
        scene["a"].set_transform(shift(float(x)))
    assert len(scene.window.entries) == 2
    assert recorded(scene)[-1]["matrix"][12] == 499.0


def test_deleting_all_deletes_the_animation_too():
    scene = Scene()
    animation = Animation()
    with animation.at_frame(scene["a"], 0) as frame:
        frame.set_transform(np.eye(4))
    scene.set_animation(animation)
    assert recorded(scene)[-1]["type"] == "set_animation" and recorded(scene)[-1]["animations"]
    scene.delete()
    assert not any(command.get("animations") for command in recorded(scene))


def test_deleting_removes_everything_below_and_nothing_beside():
    scene = Scene()
    for path in ("arm", "arm/hand", "armrest"):
        scene[path].set_object(mg.Sphere(1.0))
        scene[path].set_transform(shift(1.0))
    scene["arm"].delete()
    assert {command["path"] for command in recorded(scene)} == {"/meshcat/armrest"}
    scene["/Grid"].delete()  # not ours: a fresh viewer would have it again
    assert recorded(scene)[-1] == {"type": "delete", "path": "/Grid"}


def test_a_colour_stays_behind_its_object_when_the_object_comes_again():
    scene = Scene()
    scene["a"].set_object(mg.Sphere(1.0))
    scene["a"].set_property("color", [1, 0, 0, 1])
    scene["a"].set_object(mg.Box([1, 1, 1]))
    assert [c["type"] for c in recorded(scene)] == ["set_property", "set_object"]


def test_pack_round_trip():
    scene = Scene()
    scene["a"].set_object(mg.Sphere(1.0))
    scene["b"].set_property("visible", False)
    header, commands = unpacked(pack({"sequence": 7}, scene.window.entries))
    assert header["sequence"] == 7 and commands == recorded(scene)
    assert [tuple(k) for k in header["keys"]] == list(scene.window.entries)


@pytest.fixture
def live():
    """A scene with its widget and the list of messages that the widget sent."""
    scene, sent = Scene(), []
    scene["a"].set_object(mg.Sphere(1.0))
    shown = scene.widget
    shown.tell = lambda content, buffers=None: sent.append((time.monotonic(), content, buffers))
    yield scene, sent
    shown.close()



def test_no_channel_before_the_first_display():
    scene = Scene()
    scene["a"].set_object(mg.Sphere(1.0))
    assert scene._widget is None


def test_fast_changes_are_sent_at_most_60_times_a_second_and_the_last_one_always(live):
    scene, sent = live
    began = time.monotonic()
    count = 0
    while time.monotonic() - began < 0.5:
        count += 1
        scene["a"].set_transform(shift(float(count)))
    time.sleep(0.2)
    took = sent[-1][0] - began
    assert count > 10 * len(sent) and len(sent) <= took * 60 + 2
    assert umsgpack.unpackb(sent[-1][2][0])["matrix"][12] == float(count)
    assert [content["sequence"] for _, content, _ in sent] == list(range(1, len(sent) + 1))


def test_a_batch_is_never_sent_by_halves(live):
    scene, sent = live
    with scene.window.batch():
        scene["a"].set_transform(shift(1.0))
        time.sleep(0.1)
        scene["b"].set_transform(shift(1.0))
        assert not sent
    time.sleep(0.1)
    assert [len(content["keys"]) for _, content, _ in sent] == [2]


def test_late_joiner_gets_the_scene_as_it_is_now(live):
    scene, sent = live
    scene["a"].set_transform(shift(3.0))
    header, commands = unpacked(scene.widget.get_state()["snapshot"])
    assert commands[-1]["matrix"][12] == 3.0
    assert header["sequence"] == sent[-1][1]["sequence"] == 1
    scene.widget._answer(None, {"kind": "sequence?"}, [])
    scene.widget._answer(None, {"kind": "snapshot?"}, [])
    assert sent[-2][1] == {"kind": "sequence", "sequence": 1}
    assert unpacked(sent[-1][2][0])[1] == commands


def test_camera_can_move_later(live):
    scene, sent = live
    scene.set_camera((3, 0, 1), (0, 0, 1))
    assert sent[-1][1]["view"]["camera"] == [3.0, 0.0, 1.0]
    scene.set_cam_target((0, 0, 2))
    assert sent[-1][1]["view"]["camera"] == [3.0, 0.0, 1.0] and sent[-1][1]["view"]["target"] == [0.0, 0.0, 2.0]


def test_repr_is_constant_and_the_bundle_is_shared():
    first, second = Scene(), Scene()
    assert repr(first) == repr(first.widget) == repr(second.widget) == "Scene()"
    assert first.widget.channel == second.widget.channel
    assert len(first.widget.get_state()["_esm"]) < 5500


def test_scene_that_is_let_go_stays_on_the_page():
    """A cell may show scenes in a loop, or by a function, and keep none of them."""
    scene = Scene()
    shown = scene.widget
    del scene
    gc.collect()
    assert shown.comm is not None


def test_running_a_cell_again_closes_what_only_that_cell_showed(monkeypatch):
    monkeypatch.setattr(widget, "_shown", {})
    run = lambda cell: widget._before_cell(SimpleNamespace(cell_id=cell))  # noqa: E731
    run("one")
    kept, lost = Scene(), Scene()
    kept_widget, lost_widget = kept.widget, lost.widget
    run("two")
    assert kept.widget is kept_widget  # a second view, of another cell
    run("one")
    assert lost_widget.comm is None and kept_widget.comm is not None
    assert lost.widget is not lost_widget  # shown again, it opens a new channel
    run("")


def test_no_process_and_no_port():
    me = psutil.Process()

    def state():
        ports = {c.laddr for c in me.net_connections() if c.status == "LISTEN"}
        return {child.pid for child in me.children(recursive=True)}, ports

    before = state()
    scene = Scene()
    scene["a"].set_object(mg.Sphere(1.0))
    scene.widget.get_state(), scene.html(), scene.png(width=32, height=32)
    assert state() == before


def test_html_page_holds_everything_and_names_no_address(tmp_path):
    scene = Scene(height=300)
    scene["a"].set_object(mg.Sphere(1.0))
    animation = Animation()
    with animation.at_frame(scene["a"], 0) as frame:
        frame.set_transform(np.eye(4))
    scene.set_animation(animation)
    text = scene.html(tmp_path / "page.html", title="a <b>")
    assert (tmp_path / "page.html").read_text() == text and "<title>a &lt;b&gt;</title>" in text
    assert not re.search(r"(src|href)\s*=|https?://|\bimport\b", text)
    blocks = dict(re.findall(r'id="(code|data)">([^<]+)<', text))
    parts = json.loads(gzip.decompress(b64decode(blocks["code"])))
    assert "REVISION" in parts["meshcat"] and "SceneView" in parts["core"] and "Store" in parts["store"]
    assert unpacked(b64decode(blocks["data"]))[1] == recorded(scene)
    assert len(text) < 340_000


def test_display_mode_follows_the_environment(monkeypatch):
    scene = Scene(height=60)
    monkeypatch.setenv("TUTORIALBOT_VIEWER", "png")
    assert set(scene._repr_mimebundle_()) == {"text/plain", "image/png"}
    monkeypatch.setenv("TUTORIALBOT_VIEWER", "html")
    assert "<iframe srcdoc=" in scene._repr_mimebundle_()["text/html"]
    monkeypatch.setenv("TUTORIALBOT_VIEWER", "live")
    assert "application/vnd.jupyter.widget-view+json" in scene._repr_mimebundle_()[0]
    monkeypatch.setenv("TUTORIALBOT_VIEWER", "film")
    for shown in (scene, scene.widget):
        with pytest.raises(InvalidValue, match="TUTORIALBOT_VIEWER = 'film'"):
            shown._repr_mimebundle_()


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: Scene(height=10), InvalidValue, "height = 10"),
        (lambda: Scene(height="tall"), InvalidType, "height = 'tall'"),
        (lambda: Scene(camera=(1, 2)), InvalidValue, "camera"),
        (lambda: Scene(target=(1, 2, np.nan)), InvalidValue, "target"),
        (lambda: Scene().set_transform(np.eye(3)), InvalidValue, "matrix"),
        (lambda: Scene().add_path([[0, 0, 0]]), InvalidValue, "points"),
        (lambda: Scene().add_path([[0, 0, 0], [0, 0, 0]]), InvalidValue, "points"),
        (lambda: Scene().add_path([[0, 0, 0], [1, 0, 0]], radius=-1.0), InvalidValue, "radius = -1.0"),
        (lambda: Scene().add_path([[0, 0, 0], [1, 0, 0]], color="blue"), InvalidValue, "color = 'blue'"),
        (lambda: Scene().add_frame(np.eye(4), length=0.0), InvalidValue, "length = 0.0"),
        (lambda: Scene().add_frame(2.0 * np.eye(4)), InvalidValue, "rotation"),
        (lambda: Scene().add_frame("here"), InvalidType, "pose = 'here'"),
        (lambda: Scene().add_frame(np.diag([1.0, 1.0, -1.0, 1.0])), InvalidValue, "must be a rotation"),
        (lambda: Scene().add_frame(pinocchio.SE3(2.0 * np.eye(3), np.zeros(3))), InvalidValue, "must be a rotation"),
        (lambda: Scene().add_frame(np.diag([1.0, 1.0, 1.0, 2.0])), InvalidValue, "last row"),
        (lambda: Scene().png(width=1), InvalidValue, "width = 1"),
    ],
)
def test_bad_input(call, error, words):
    with pytest.raises(error, match=re.escape(words)):
        call()


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_javascript_parses(script, tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed; the browser tests run this file")
    copy = tmp_path / (script.name if script.name != "widget.js" else "widget.mjs")
    shutil.copy(script, copy)
    checked = subprocess.run([node, "--check", copy], capture_output=True, text=True, timeout=60)
    assert checked.returncode == 0, checked.stderr


def test_a_frame_that_moves_sends_its_pose_alone():
    scene = Scene()
    scene.add_frame(np.eye(4), 0.2, "tool")
    assert len(scene.window.take()) == 7
    scene.add_frame(shift(1.0), 0.2, "tool")
    (key,) = scene.window.take()
    assert key == ("set_transform", "/meshcat/tool", "")
    scene.add_frame(shift(1.0), 0.3, "tool")
    assert len(scene.window.take()) == 7
    scene["tool"].delete()
    scene.window.take()
    scene.add_frame(shift(1.0), 0.3, "tool")
    assert len(scene.window.take()) == 7
