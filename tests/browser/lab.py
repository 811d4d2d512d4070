"""A real JupyterLab in headless Chromium, for the browser tests and for looking at a notebook.

As a script it runs a notebook from top to bottom and writes pictures of what a reader would see:

    python tests/browser/lab.py notebooks/00_start_here.ipynb /tmp/pictures

As a module: `with Lab(folder) as lab, lab.open("a.ipynb") as page: page.run_all(); page.errors()`.
The server listens on the loopback address with a token, in a folder and with settings of its own; nothing of the
user's Jupyter set-up is read or written, and leaving the `with` block ends every process that was started.
"""

import argparse
import json
import os
import secrets
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from urllib.parse import urlsplit

from tutorialbot.doctor import find_chromium

REPOSITORY = Path(__file__).resolve().parents[2]
CHROMIUM_FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SETTINGS = {
    "@jupyterlab/apputils-extension/notification": {"fetchNews": "false", "checkForUpdates": False},
    "@jupyterlab/notebook-extension/tracker": {"windowingMode": "none", "autoStartDefaultKernel": True},
    "@jupyterlab/docmanager-extension/plugin": {"autosave": False},
}
CELLS_SCRIPT = """() => window.jupyterapp.shell.currentWidget.content.widgets.map((cell, index) => ({
    index, kind: cell.model.type, source: cell.model.sharedModel.getSource(),
    count: cell.model.executionCount ?? null, state: cell.model.executionState ?? null,
    outputs: cell.model.outputs ? cell.model.outputs.toJSON() : []}))"""


class Lab:
    """A JupyterLab server over `folder`; use it as a context manager."""

    def __init__(self, folder: str | Path, environment: dict[str, str] | None = None, settings: dict | None = None):
        self.folder, self.token = Path(folder).resolve(), secrets.token_hex(16)
        self.environment, self.settings = environment or {}, {**SETTINGS, **(settings or {})}
        self.survivors: list[str] = []

    def __enter__(self) -> "Lab":
        self._private = tempfile.TemporaryDirectory(prefix="lab_")
        root = Path(self._private.name)
        for name, values in self.settings.items():
            file = root / "settings" / f"{name}.jupyterlab-settings"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(values))
        python_path = os.pathsep.join(p for p in (str(REPOSITORY), os.environ.get("PYTHONPATH", "")) if p)
        private = {name: str(root / name) for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR")}
        env = {**os.environ, "PYTHONPATH": python_path, "OMP_NUM_THREADS": "1", "TUTORIALBOT_VIEWER": "live"}
        env |= {**private, **self.environment}
        options = {
            "ServerApp.ip": "127.0.0.1", "ServerApp.port": 0, "IdentityProvider.token": self.token,
            "ServerApp.root_dir": str(self.folder), "ServerApp.open_browser": False, "ServerApp.allow_root": True,
            "LabApp.user_settings_dir": str(root / "settings"), "LabApp.workspaces_dir": str(root / "workspaces"),
            "LabApp.expose_app_in_browser": True,
        }  # fmt: skip
        command = [sys.executable, "-m", "jupyterlab", *(f"--{name}={value}" for name, value in options.items())]
        self._log = (root / "server.log").open("w+")
        self.process = subprocess.Popen(command, env=env, cwd=self.folder, stdout=self._log, stderr=self._log)
        try:
            self.url = self._wait_for_url(root / "JUPYTER_RUNTIME_DIR")
        except BaseException:
            self.__exit__()
            raise
        return self

    def _wait_for_url(self, runtime: Path, seconds: float = 90.0) -> str:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline and self.process.poll() is None:
            for file in runtime.glob("jpserver-*.json"):
                with suppress(OSError, ValueError, KeyError):
                    url = json.loads(file.read_text())["url"].rstrip("/")
                    urllib.request.urlopen(f"{url}/api?token={self.token}", timeout=5).close()
                    return url
            time.sleep(0.2)
        raise RuntimeError(f"JupyterLab did not start: {self.server_log()[-2000:]}")

    def server_log(self) -> str:
        """Return everything that the server has written so far."""
        self._log.flush()
        return Path(self._log.name).read_text()

    def __exit__(self, *_) -> None:
        import psutil

        family = psutil.Process(self.process.pid).children(recursive=True) if self.process.poll() is None else []
        with suppress(OSError, AttributeError):
            request = urllib.request.Request(f"{self.url}/api/shutdown?token={self.token}", method="POST", data=b"")
            urllib.request.urlopen(request, timeout=10).close()
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.survivors.append("the server itself")
            self.process.kill()
        _, alive = psutil.wait_procs(family, timeout=10)
        for process in alive:
            with suppress(psutil.Error):
                self.survivors.append(" ".join(process.cmdline()))
                process.kill()
        self._log.close()
        self._private.cleanup()

    @contextmanager
    def open(self, notebook: str, width: int = 1280, height: int = 900) -> Iterator["NotebookPage"]:
        """Open `notebook` (a path inside the folder) in a fresh headless browser."""
        from playwright.sync_api import sync_playwright

        with sync_playwright() as play:
            browser = play.chromium.launch(executable_path=find_chromium(), headless=True, args=CHROMIUM_FLAGS)
            try:
                context = browser.new_context(viewport={"width": width, "height": height})
                yield NotebookPage(self, context, notebook)
            finally:
                browser.close()


class NotebookPage:
    """One notebook in one browser tab. `.page` is playwright's page, for whatever is not here."""

    def __init__(self, lab: Lab, context, notebook: str):
        self.lab, self.notebook, self.requests, self.console = lab, notebook, [], []
        context.on("request", lambda request: self.requests.append(request.url))
        self.page = context.new_page()
        self.page.set_default_timeout(120_000)  # a loaded machine draws a scene in software slowly
        self.page.on("websocket", lambda socket: self.requests.append(socket.url))
        self.page.on("pageerror", lambda error: self.console.append(f"page error: {error}"))
        self.page.on("console", lambda m: self.console.append(f"{m.type}: {m.text}") if m.type == "error" else None)
        self.load()

    def load(self) -> None:
        """Load (or reload) the page and wait until the notebook's kernel is idle."""
        self.page.goto(f"{self.lab.url}/doc/tree/{self.notebook}?token={self.lab.token}&reset")
        self.page.wait_for_function(
            "() => window.jupyterapp?.shell.currentWidget?.content?.widgets?.length > 0", timeout=90_000
        )
        self.wait_idle()

    def wait_idle(self, seconds: float = 300.0) -> None:
        """Wait until the kernel has nothing to do."""
        script = "() => window.jupyterapp.shell.currentWidget.sessionContext.session?.kernel?.status === 'idle'"
        self.page.wait_for_function(script, timeout=1000 * seconds)

    def command(self, name: str, arguments: dict | None = None) -> None:
        """Run one of JupyterLab's commands by its name and wait for its end."""
        script = "([name, args]) => window.jupyterapp.commands.execute(name, args).then(() => null)"
        self.page.evaluate(script, [name, arguments or {}])

    def cells(self) -> list[dict]:
        """Return each cell as a dict: index, kind, source, count (its prompt), state, outputs (nbformat)."""
        return self.page.evaluate(CELLS_SCRIPT)

    def run_all(self, seconds: float = 600.0) -> None:
        """Run all cells and wait until every code cell that holds something has its number (or one failed)."""
        self.page.evaluate("() => { window.jupyterapp.commands.execute('notebook:run-all-cells'); }")
        self.wait_prompts(seconds)

    def wait_prompts(self, seconds: float = 600.0) -> None:
        """Wait until every code cell that holds something has its number, or one has failed."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            code = [c for c in self.cells() if c["kind"] == "code" and c["source"].strip()]
            busy = [c for c in code if c["count"] is None or c["state"] == "running"]
            if not busy or self.errors():
                return self.wait_idle()
            self.page.wait_for_timeout(300)
        raise TimeoutError(f"cell {busy[0]['index']} has not ended after {seconds} s:\n{busy[0]['source'][:300]}")

    def restart_and_run_all(self, seconds: float = 600.0) -> None:
        """Restart the kernel, clear the outputs, run all cells."""
        self.page.evaluate("() => window.jupyterapp.shell.currentWidget.sessionContext.restartKernel()")
        self.command("notebook:clear-all-cell-outputs")
        self.page.wait_for_timeout(500)
        self.run_all(seconds)

    def execute(self, code: str) -> str:
        """Run `code` in the notebook's kernel, beside its cells, and return what it printed."""
        script = """async (code) => {
            const kernel = window.jupyterapp.shell.currentWidget.sessionContext.session.kernel;
            const future = kernel.requestExecute({ code, store_history: false }), texts = [];
            future.onIOPub = (message) => texts.push(message.content.text ?? "");
            await future.done;
            return texts.join("");
        }"""
        return self.page.evaluate(script, code)

    def errors(self) -> list[str]:
        """Return the notebook's errors, one text for each cell that failed."""
        found = ((c, o) for c in self.cells() for o in c["outputs"] if o["output_type"] == "error")
        return [f"cell {c['index']}: {o['ename']}: {o['evalue']}" for c, o in found]

    def outside_requests(self) -> list[str]:
        """Return the addresses that the page asked for outside the notebook's own server."""
        home = urlsplit(self.lab.url).netloc
        remote = (u for u in self.requests if urlsplit(u).scheme in ("http", "https", "ws", "wss"))
        return sorted({u for u in remote if urlsplit(u).netloc != home})

    def screenshots(self, folder: str | Path, piece: int = 1600) -> list[Path]:
        """Write the whole notebook as pieces of `piece` pixels height, and each cell's output; return the paths."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        area = ".jp-WindowedPanel-outer"
        width, before = self.page.viewport_size["width"], self.page.viewport_size["height"]
        end = "e => e.scrollTop + [...e.querySelectorAll('.jp-Cell')].pop().getBoundingClientRect().bottom"
        total = int(self.page.eval_on_selector(area, f"{end} - e.getBoundingClientRect().top"))
        chrome = before - self.page.eval_on_selector(area, "e => e.clientHeight")
        self.page.set_viewport_size({"width": width, "height": piece + chrome})
        self.page.wait_for_timeout(1000)
        paths = []
        for number, top in enumerate(range(0, total, piece), start=1):
            self.page.eval_on_selector(area, "(e, top) => { e.scrollTop = top; }", top)
            self.page.wait_for_timeout(700)
            paths.append(folder / f"page_{number:02d}.png")
            self.page.screenshot(path=paths[-1])
        for index, cell in enumerate(self.page.query_selector_all(".jp-Notebook .jp-Cell")):
            output = cell.query_selector(".jp-OutputArea-child")
            if output is not None:
                area_box = cell.query_selector(".jp-Cell-outputWrapper")
                area_box.scroll_into_view_if_needed()
                self.page.wait_for_timeout(150)
                paths.append(folder / f"output_{index:03d}.png")
                area_box.screenshot(path=paths[-1])
        self.page.set_viewport_size({"width": width, "height": before})
        return paths


def main() -> int:
    """Run one notebook in a real JupyterLab, write pictures, print errors and outside requests."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("notebook", type=Path)
    parser.add_argument("outdir", type=Path)
    parser.add_argument("--seconds", type=float, default=900.0, help="time limit for the whole notebook (default 900)")
    parser.add_argument("--width", type=int, default=1280, help="width of the window in pixels (default 1280)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="notebook_") as folder:
        pages, pictures = Path(folder) / "notebooks", Path(folder) / "data" / "pictures"
        shutil.copytree(REPOSITORY / "data" / "pictures", pictures)
        pages.mkdir()
        shutil.copy(options.notebook, pages)
        lab = Lab(folder)
        with lab, lab.open(f"notebooks/{options.notebook.name}", width=options.width) as page:
            started = time.monotonic()
            page.run_all(options.seconds)
            print(f"ran in {time.monotonic() - started:.1f} s")
            page.page.wait_for_timeout(2000)
            errors, outside, console = page.errors(), page.outside_requests(), page.console
            paths = page.screenshots(options.outdir)
    for title, lines in {
        "notebook errors": errors, "outside requests": outside, "browser console errors": console,
        "processes left behind": lab.survivors, "pictures": [str(path) for path in paths],
    }.items():  # fmt: skip
        print(f"{title}: {len(lines)}", *lines, sep="\n  ")
    return 1 if errors or outside or lab.survivors else 0


if __name__ == "__main__":
    sys.exit(main())
