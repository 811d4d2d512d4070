"""Run a notebook without a browser and write it as HTML, with a bar that counts its cells."""

import os
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, DeadKernelError
from nbconvert import HTMLExporter

from tutorialbot.runs import progress

MARK = "<!-- tutorialbot source {} -->"


class CellFailed(Exception):
    """A cell raised, or the kernel died; the message holds the end of the traceback."""


def is_done(page: Path, source: str) -> bool:
    """Tell whether `page` is a whole result of exactly this `source` (a hash)."""
    try:
        return page.read_text(encoding="utf-8").endswith(MARK.format(source))
    except OSError:
        return False


def execute(notebook: Path, page: Path, source: str) -> None:
    """Run `notebook` from top to bottom and write `page` (renamed into place, marked with `source`).

    Raises CellFailed; KeyboardInterrupt ends the kernel and leaves no page.
    """
    content = nbformat.read(notebook, as_version=4)
    cells = sum(cell.cell_type == "code" and bool(cell.source.strip()) for cell in content.cells)
    with progress(total=cells, description=notebook.stem) as bar:
        client = NotebookClient(
            content, timeout=None, kernel_name="python3", resources={"metadata": {"path": str(notebook.parent)}},
            on_cell_executed=lambda **_: bar.update(),
            extra_arguments=["--log-level=ERROR"],
        )  # fmt: skip
        try:
            client.execute(env={"TUTORIALBOT_VIEWER": "html", **os.environ})  # 3-D scenes that need no kernel
        except BaseException as error:
            if hasattr(client, "_async_cleanup_kernel_future"):  # nbclient caught a signal and ended the kernel
                raise KeyboardInterrupt from None
            if isinstance(error, CellExecutionError | DeadKernelError):
                raise CellFailed(str(error)[-2000:]) from None
            raise
    about = {"metadata": {"name": notebook.stem, "path": str(notebook.parent)}}
    body, _ = HTMLExporter(embed_images=True).from_notebook_node(content, about)  # pictures travel with the page
    page.parent.mkdir(parents=True, exist_ok=True)
    part = page.with_suffix(f".{os.getpid()}.part")
    part.write_text(body + "\n" + MARK.format(source), encoding="utf-8")
    os.replace(part, page)
