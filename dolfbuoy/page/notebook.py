"""A record in a notebook: its page in a frame of the cell, apart from the notebook's own document."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene


class Shown:
    """The result of `dolfbuoy.show`; a notebook displays it at the end of a cell."""

    def __init__(self, page: str, height: int):
        self.page, self.height = page, height

    def _repr_html_(self) -> str:
        """A frame that holds the page; its scripts cannot reach the notebook."""
        held = html.escape(self.page)
        look = f"width: 100%; height: {self.height}px; border: 1px solid #d5dce3"
        return f'<iframe srcdoc="{held}" sandbox="allow-scripts" style="{look}" title="dolfbuoy"></iframe>'

    def __repr__(self) -> Any:
        return f"<page of {len(self.page) / 1e6:.2g} MB: the last line of a notebook's cell shows it>"


def show(record: xr.Dataset, scene: Scene | None = None, height: int = 820) -> Shown:
    """The page of a record with its replay, in a frame of that height [pixels].

    record: of `simulate`, opened with xarray, or of `modes`.  scene: by default the one that the record carries.
    Raises InputError for what has no page.
    """
    from ..errors import InputError

    if "eigenvalue" in record:
        from .result_pages import modes_page

        return Shown(modes_page(record, scene), height)
    if not record.sizes.get("time"):
        raise InputError("This is neither the record of a run nor modes: compute one with simulate, or modes.")
    from .run_page import run_page

    return Shown(run_page(record, scene), height)
