"""Sizes and formats of pictures, known without a library that draws."""

from contextvars import ContextVar

COLUMN, PAGE = 3.35, 7.0
"""Widths that fit a column and a page of the journals of this field, in inches."""

NARROWEST, WIDEST = 3.3, 20.0
"""Least and largest width of a picture, in inches."""

FORMATS = (".png", ".svg", ".pdf")

RESOLUTION = 300.0
"""Dots per inch by default."""

RESOLUTIONS = 30.0, 2400.0
"""Least and largest resolution of a picture, in dots per inch."""

UNLISTED: ContextVar[bool] = ContextVar("UNLISTED", default=False)
"""True in commands, which write pictures: pyplot does not list them."""
