"""Pictures against those of before, with a tolerance that a wrong colour exceeds.

After a change that is meant, the new one is in the temporary folder of its test.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib.testing.compare import compare_images

from capsule_sym.figures import figure_style

_TOLERANCE = 6.0  # root mean square of pixel values: room for another version of FreeType
_RESOLUTION = 60  # dots per inch


def as_before(figure: Any, baseline: Path, folder: Path) -> bool:
    """True if a figure is the picture of before; a folder gets what is drawn now."""
    drawn = folder / baseline.name
    with figure_style():
        figure.savefig(drawn, dpi=_RESOLUTION)
    return compare_images(baseline, drawn, _TOLERANCE) is None
