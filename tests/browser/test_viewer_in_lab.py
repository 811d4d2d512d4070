"""The viewer as a reader has it: a real JupyterLab in a real browser, and the offline page from a file."""

import io
import os
import subprocess
import sys
import time
from pathlib import Path

import nbformat
import numpy as np
import psutil
import pytest
from lab import CHROMIUM_FLAGS, REPOSITORY, Lab
from PIL import Image

from tutorialbot.doctor import find_chromium
from tutorialbot.viewers import MujocoView, play

pytestmark = [
    pytest.mark.full,
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium on this machine: install Debian's chromium"),
]

SET_UP = """
import time
import ipywidgets, mujoco, numpy as np
from tutorialbot.viewers import MujocoView, Scene, play
model = mujoco.MjModel.from_xml_string('''<mujoco><worldbody><body><joint type="hinge" axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 0 0 1" size="0.1" rgba="1 0 0 1"/>
  <geom type="box" pos="0 0 1" size="0.15 0.15 0.15" rgba="0 0 1 1"/></body></worldbody></mujoco>''')
"""
PIXELS = """([scene, colour]) => {
  const canvas = document.querySelectorAll(".tb-scene canvas")[scene];
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const found = [0, 0, 0];
  for (let i = 0; i < data.length; i += 4) {
    const other = Math.max(data[i + (colour + 1) % 3], data[i + (colour + 2) % 3]);
    if (data[i + colour] > 2 * other && data[i + colour] > 60) {
      found[0] += 1; found[1] += (i / 4) % canvas.width; found[2] += Math.floor(i / 4 / canvas.width);
    }
  }
  return found[0] ? [found[0], found[1] / found[0], found[2] / found[0]] : [0, 0, 0];
}"""


def write_notebook(folder: Path, *cells: str) -> str:
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in (SET_UP, *cells)])
    notebook.metadata.kernelspec = {"name": "python3", "display_name": "Python 3", "language": "python"}
    nbformat.write(notebook, folder / "viewer.ipynb")
    return "viewer.ipynb"


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """One server for the whole file; when it ends, nothing that it started may be left."""
    server = Lab(tmp_path_factory.mktemp("lab"))
    with server:
        yield server
    assert server.survivors == []


@pytest.fixture
def opened(lab):
    """Return a function that writes a notebook of some cells and opens it; checks at the end what must always hold."""
    pages, contexts = [], []

    def open_notebook(*cells: str, run: bool = True):
        contexts.append(lab.open(write_notebook(lab.folder, *cells)))
        page = contexts[-1].__enter__()
        pages.append(page)
        if run:
            page.run_all(120)
        return page

    yield open_notebook
    try:
        for page in pages:
            assert page.errors() == []
            # JupyterLab itself says this of every widget when a kernel goes
            assert [line for line in page.console if "Comm not found for comm id" not in line] == []
            assert page.outside_requests() == []
    finally:
        for page in pages:
            page.page.evaluate("() => window.jupyterapp.shell.currentWidget.sessionContext.shutdown()")
        for context in contexts:
            context.__exit__(None, None, None)


def blob(page, scene: int = 0, colour: int = 2) -> tuple[float, float, float]:
    """Return count, mean column and mean row of the red (0), green (1) or blue (2) pixels of a scene's canvas."""
    return tuple(page.page.evaluate(PIXELS, [scene, colour]))


def wait_for(page, what, seconds: float = 120.0):
    """Wait until `what()` is true and return its value; fail with a picture's worth of words otherwise."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        value = what()
        if value:
            return value
        page.page.wait_for_timeout(100)
    raise AssertionError(f"did not happen within {seconds} s; console: {page.console}")


def drawn(page, scene: int = 0) -> tuple[float, float, float]:
    """Wait until a scene shows the robot's blue box; return its pixels."""
    page.page.locator(".tb-scene").nth(scene).scroll_into_view_if_needed()
    wait_for(page, lambda: page.page.locator(".tb-scene").count() > scene and blob(page, scene)[0] > 50)
    page.page.wait_for_timeout(300)
    return blob(page, scene)


def test_slider_moves_the_robot_in_every_view_of_it(opened):
    page = opened(
        "view = MujocoView(model)\n"
        "slider = ipywidgets.FloatSlider(min=-1.5, max=1.5, step=0.1)\n"
        "slider.observe(lambda change: view.update([change.new]), 'value')\n"
        "ipywidgets.VBox([slider, view.widget])",
        "view",
    )
    start, second = drawn(page, 0), drawn(page, 1)
    assert start[0] > 300 and abs(start[0] - second[0]) < 0.02 * start[0]
    handle = page.page.locator(".noUi-handle")
    handle.scroll_into_view_if_needed()
    handle.focus()
    for _ in range(10):
        page.page.keyboard.press("ArrowRight")
    moved = wait_for(page, lambda: (now := blob(page, 0))[1] - start[1] > 60 and now)  # the box swings to the right
    page.page.wait_for_timeout(300)
    page.page.locator(".tb-scene").nth(1).scroll_into_view_if_needed()
    wait_for(page, lambda: abs(blob(page, 1)[1] - blob(page, 0)[1]) < 2)
    assert moved[2] > start[2]  # and down


def test_scene_takes_the_room_beside_sliders(opened):
    page = opened(
        "view = MujocoView(model)\n"
        "knobs = ipywidgets.VBox([ipywidgets.FloatSlider() for _ in range(3)])\n"
        "ipywidgets.HBox([knobs, view.widget])",
    )
    drawn(page)
    scene, row = (page.page.locator(name).first.bounding_box() for name in (".tb-scene", ".widget-hbox"))
    assert scene["width"] > 0.5 * row["width"]


def test_animation_plays_by_itself_and_obeys_its_controls(opened):
    page = opened("view = MujocoView(model)\nplay(view, np.linspace(0, 1.5, 60)[:, None], np.linspace(0, 3, 60))")
    first = drawn(page)
    wait_for(page, lambda: abs(blob(page)[1] - first[1]) > 20)
    page.page.locator(".tb-play").click()
    assert page.page.locator(".tb-play").get_attribute("aria-label") == "play"
    page.page.wait_for_timeout(300)
    stopped = blob(page)
    page.page.wait_for_timeout(600)
    assert blob(page) == stopped
    slider = page.page.locator(".tb-time")
    slider.evaluate("(e) => { e.value = 3; e.dispatchEvent(new Event('input')); }")
    end = wait_for(page, lambda: (now := blob(page)) != stopped and now)
    slider.evaluate("(e) => { e.value = 0; e.dispatchEvent(new Event('input')); }")
    begin = wait_for(page, lambda: (now := blob(page)) != end and now)
    assert end[1] - begin[1] > 60 and "0.00 / 3.00 s" in page.page.locator(".tb-clock").inner_text()


def test_a_loop_in_a_cell_is_seen_while_it_runs(opened):
    page = opened(
        "view = MujocoView(model)\nview",
        "for k in range(240):\n    view.update([1.5 * k / 239])\n    time.sleep(1 / 30)",
        run=False,
    )
    page.page.evaluate("() => { window.jupyterapp.commands.execute('notebook:run-all-cells'); }")
    seen = []
    while not all(cell["count"] for cell in page.cells()):
        if page.page.locator(".tb-scene canvas").count():
            seen.append(blob(page))
        page.page.wait_for_timeout(100)
    assert len({round(place[1]) for place in seen if place[0]}) >= 5  # different poses, before the cell has ended
    page.wait_idle()
    page.page.wait_for_timeout(1000)
    last = blob(page)
    assert last[1] >= max(place[1] for place in seen) - 1  # and the last one stays


def test_reload_shows_the_scene_as_it_is_now(opened):
    page = opened("view = MujocoView(model)\nview", "view.update([1.2])")
    before = drawn(page)
    page.command("docmanager:save")
    page.load()
    after = drawn(page)
    np.testing.assert_allclose(after, before, rtol=0.05, atol=3)


def test_24_scenes_and_none_is_lost(opened):
    page = opened("for k in range(24):\n    view = MujocoView(model, Scene(height=120))\n"
                  "    view.update([k / 24])\n    display(view)")  # fmt: skip
    places = [drawn(page, k) for k in range(24)]
    assert all(p[0] > 50 for p in places) and places[23][1] > places[0][1] + 10
    again = [drawn(page, k) for k in range(24)]  # and the first ones are still there
    np.testing.assert_allclose(again, places, atol=1)


def test_running_again_frees_the_old_model_and_restart_replaces_cleanly(opened):
    page = opened("view = MujocoView(model)\nview", "view2 = MujocoView(model, Scene())\nview2")
    count = """from ipywidgets.widgets import widget as _w
from tutorialbot.viewers.widget import SceneWidget
print(sum(isinstance(w, SceneWidget) for w in _w._instances.values()))"""
    live = "() => [...globalThis[Symbol.for('tutorialbot.viewers')].hubs.values()].map((hub) => hub.scenes.size)"
    for _ in range(4):
        page.run_all(60)
        drawn(page, 0), drawn(page, 1)
    assert page.execute(count).strip() == "2" and page.page.locator(".tb-scene").count() == 2
    assert page.page.evaluate(live) == [2]
    page.restart_and_run_all(120)
    assert drawn(page, 0)[0] > 300 and drawn(page, 1)[0] > 300
    assert page.page.locator(".tb-scene").count() == 2
    assert page.page.evaluate(live)[-1] == 2  # ipywidgets keeps the models of a kernel that went, without views


def test_wheel_scrolls_the_notebook_until_the_scene_is_clicked(opened):
    tall = "display(*[ipywidgets.HTML('<div style=height:900px>') for _ in 'ab'])"
    page = opened("view = MujocoView(model)\nview", tall)
    size, place = drawn(page)[0], "() => document.querySelector('.jp-WindowedPanel-outer').scrollTop"
    before = page.page.evaluate(place)
    box = page.page.locator(".tb-scene").bounding_box()
    page.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.page.mouse.wheel(0, 60)
    wait_for(page, lambda: page.page.evaluate(place) > before)
    assert abs(blob(page)[0] - size) < 0.02 * size
    box, before = page.page.locator(".tb-scene").bounding_box(), page.page.evaluate(place)
    page.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.page.mouse.wheel(0, 60)
    wait_for(page, lambda: abs(blob(page)[0] - size) > 0.05 * size)
    assert page.page.evaluate(place) == before


def test_no_record_button_and_no_control_panel(opened):
    page = opened("view = MujocoView(model)\nplay(view, [[0.0], [1.0]], [0.0, 1.0])")
    drawn(page)
    assert page.page.locator(".dg:visible").count() == 0


def test_offline_page_draws_and_plays_from_a_file_without_a_request(tmp_path):
    from playwright.sync_api import sync_playwright

    names: dict = {}
    exec(SET_UP, names)
    view = MujocoView(names["model"])
    play(view, np.linspace(0, 1.5, 60)[:, None], np.linspace(0, 3, 60))
    file = tmp_path / "scene.html"
    view.scene.html(file)
    with sync_playwright() as player:
        browser = player.chromium.launch(executable_path=find_chromium(), headless=True, args=CHROMIUM_FLAGS)
        page, asked, problems = browser.new_page(viewport={"width": 900, "height": 500}), [], []
        page.on("request", lambda request: asked.append(request.url))
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
        page.goto(file.as_uri())
        page.wait_for_selector(".tb-scene canvas")
        page.wait_for_timeout(1500)
        pictures = []
        for _ in range(2):
            pictures.append(np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int))
            page.wait_for_timeout(700)
        box = (page.viewport_size["width"], page.viewport_size["height"])
        browser.close()
    assert asked == [file.as_uri()] and problems == []
    blue = [(p[..., 2] > 2 * p[..., :2].max(-1)) & (p[..., 2] > 60) for p in pictures]
    assert pictures[0].shape[:2] == box[::-1] and all(b.sum() > 300 for b in blue)
    assert abs(np.nonzero(blue[0])[1].mean() - np.nonzero(blue[1])[1].mean()) > 5


def test_nbval_passes_twice_and_leaves_no_process(tmp_path):
    motion = "play(view, [[0.0], [1.0]], [0.0, 1.0])"
    write_notebook(tmp_path, "view = MujocoView(model)\nview", motion, "print(repr(view.scene), repr(view.widget))")
    notebook = nbformat.read(tmp_path / "viewer.ipynb", 4)
    notebook.cells[-1].outputs = [nbformat.v4.new_output("stream", name="stdout", text="Scene() Scene()\n")]
    for count, cell in enumerate(notebook.cells, start=1):
        cell.execution_count = count if cell.outputs else None
    nbformat.write(notebook, tmp_path / "viewer.ipynb")
    before = {process.pid for process in psutil.process_iter()}
    command = [sys.executable, "-m", "pytest", "--nbval", "-q", "-p", "no:cacheprovider", "viewer.ipynb"]
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY), "IPYTHONDIR": str(tmp_path / "ipython")}
    for _ in range(2):
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stdout[-3000:]
    new = [p.info for p in psutil.process_iter(["pid", "cmdline", "cwd"]) if p.pid not in before]
    left = [i["cmdline"] for i in new if i["cwd"] == str(tmp_path) or "meshcat" in " ".join(i["cmdline"] or [])]
    assert left == []
