"""The explorer: the exact map in a browser, as one page of HTML that runs without a network."""

from __future__ import annotations

from importlib.resources import files


def page() -> str:
    """The page, as built by `make explorer` from the sources in `explorer/`."""
    return (files(__package__) / "page.html").read_text(encoding="utf-8")
