"""Where pages are shown."""

import html
import importlib
import sys
import tempfile
import webbrowser
from pathlib import Path

_HEIGHT = 720


def show(page: str) -> None:
    """Shows the text of a page: in a notebook below the cell, otherwise in the browser."""
    if _is_notebook():
        display = importlib.import_module("IPython.display")
        style = f"width: 100%; height: {_HEIGHT}px; border: 0"
        display.display(display.HTML(f'<iframe srcdoc="{html.escape(page)}" style="{style}"></iframe>'))
        return
    with tempfile.NamedTemporaryFile("w", suffix=".html", prefix="remora-", encoding="utf-8", delete=False) as file:
        file.write(page)
    address = Path(file.name).as_uri()
    if not webbrowser.open(address):
        print(f"no browser is to be had: open {address}")


def _is_notebook() -> bool:
    # The kernel of a notebook has loaded it.
    loaded = sys.modules.get("IPython")
    return loaded is not None and hasattr(loaded.get_ipython(), "kernel")
