"""The live scene in a notebook: an anywidget whose commands travel over the kernel's own channel."""

import hashlib
import threading
import time
import uuid
import weakref

import anywidget
import traitlets
from IPython import get_ipython
from ipywidgets import Layout

from tutorialbot.viewers.assets import front_end, script
from tutorialbot.viewers.log import pack
from tutorialbot.viewers.look import Look

FRAME = 1.0 / 60.0  # shortest time between two messages [s]




SCRIPT = script("unpack") + script("widget")


class FrontEnd(anywidget.AnyWidget):
    """Carries the drawing code to a page, once for all scenes of a kernel, and all their messages afterwards."""

    _esm = SCRIPT
    _view_name = traitlets.Unicode(None, allow_none=True).tag(sync=True)
    channel = traitlets.Unicode().tag(sync=True)
    scene = traitlets.Unicode("").tag(sync=True)
    code = traitlets.Bytes().tag(sync=True)
    code_hash = traitlets.Unicode().tag(sync=True)

    def __repr__(self) -> str:
        return "FrontEnd()"


class SceneWidget(anywidget.AnyWidget):
    """One scene on a page, made by `Scene.widget`. It lives until the cells that showed it run again."""

    _esm = SCRIPT
    channel = traitlets.Unicode().tag(sync=True)
    scene = traitlets.Unicode().tag(sync=True)
    snapshot = traitlets.Bytes().tag(sync=True)

    def __init__(self, look: Look):
        self._look, self._log, self._sequence, self._last, self._timer = look, look.log, 0, 0.0, None
        self._packed: tuple[int, bytes] = (-1, b"")
        self._log.take()
        self._view = look.header()
        layout = Layout(flex="1 1 auto", min_width="240px")  # in a row of widgets too the scene takes what is left
        super().__init__(channel=shared_front_end().channel, scene=uuid.uuid4().hex, layout=layout)
        self.on_msg(self._answer)
        self._log.on_change = self._changed

    def __repr__(self) -> str:
        return "Scene()"

    def _repr_mimebundle_(self, **kwargs) -> dict | tuple | None:
        return self._look.still() or super()._repr_mimebundle_(**kwargs)

    def close(self) -> None:
        """Close the channel; the front end removes every view of it."""
        self._log.on_change = lambda: None
        super().close()

    def get_state(self, key=None, drop_defaults=False) -> dict:
        """Return the widget's state, with a snapshot of the scene as it is now (asked for by each late joiner)."""
        state = super().get_state(key, drop_defaults)
        if "snapshot" in state:
            state["snapshot"] = self._snapshot()
        return state

    def tell(self, content: dict, buffers: list[bytes] | None = None) -> None:
        """Send a message to this scene in the page."""
        shared_front_end().send({"scene": self.scene, **content}, buffers)

    def send_view(self) -> None:
        """Tell the front end where the camera is now, whatever the reader has done to it."""
        with self._log.lock:
            self._packed = (-1, b"")
            self._view = self._look.header()
            self.tell({"kind": "view", "view": self._view, "move": True})

    def _snapshot(self) -> bytes:
        with self._log.lock:
            self._flush()
            if self._packed[0] != self._sequence:
                header = {"sequence": self._sequence, "view": self._look.header()}
                self._packed = (self._sequence, pack(header, self._log.entries))
            return self._packed[1]

    def _changed(self) -> None:
        """Pass the pending commands on at once, or, when that happened less than a frame ago, a frame later."""
        if self._timer is not None:
            return
        self._timer = threading.Timer(max(0.0, self._last + FRAME - time.monotonic()), self._on_timer)
        self._timer.daemon = True
        self._timer.start()

    def _on_timer(self) -> None:
        with self._log.lock:
            self._timer = None
            self._flush()

    def _flush(self) -> None:
        pending = self._log.take()
        if not pending or self.comm is None:
            return
        self._sequence += 1
        self._last = time.monotonic()
        sizes = [len(body) for body in pending.values()]
        content = {"kind": "commands", "sequence": self._sequence, "keys": list(pending), "sizes": sizes}
        self.tell(content, [b"".join(pending.values())])
        if any(key[0] in ("set_object", "set_animation", "delete") for key in pending):
            view = self._look.header()
            if view != self._view:  # there is more, or less, to see: the camera that fits is another
                self._view = view
                self.tell({"kind": "view", "view": view, "move": False})

    def _answer(self, _widget, content: dict, _buffers) -> None:
        """A view asks what the last sequence number is, or, having missed one, for the whole scene."""
        if content.get("kind") == "sequence?":
            with self._log.lock:
                self.tell({"kind": "sequence", "sequence": self._sequence})
        elif content.get("kind") == "snapshot?":
            self.tell({"kind": "snapshot"}, [self._snapshot()])


_shared: list[FrontEnd] = []
_shown: dict[str, "weakref.WeakSet[SceneWidget]"] = {}  # cell id -> the widgets that this cell made or showed
_cell: list[str] = [""]


def shared_front_end() -> FrontEnd:
    """Return this kernel's one carrier of the drawing code."""
    if not _shared or _shared[0].comm is None:
        code = front_end()
        _shared[:] = [FrontEnd(code=code, code_hash=hashlib.sha256(code).hexdigest()[:16], channel=uuid.uuid4().hex)]
        shell = get_ipython()
        if shell is not None:
            shell.events.register("pre_run_cell", _before_cell)
    return _shared[0]


def note_use(widget: SceneWidget) -> None:
    """Remember that the cell that runs now shows `widget`."""
    shell = get_ipython()
    if not _cell[0] and shell is not None:  # the very first use: the hook has not seen this cell begin
        parent = getattr(shell, "parent_header", None) or {}
        _cell[0] = str(parent.get("metadata", {}).get("cellId", ""))
    _shown.setdefault(_cell[0], weakref.WeakSet()).add(widget)


def _before_cell(info) -> None:
    """When a cell runs again, free the models of the scenes that only its old output showed."""
    _cell[0] = str(getattr(info, "cell_id", "") or "")
    for widget in _shown.pop(_cell[0], ()) if _cell[0] else ():
        if not any(widget in others for others in _shown.values()):
            widget.close()
