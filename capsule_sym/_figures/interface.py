"""Elements of figures, for figures of the paper."""

# ruff: noqa: F401, I001 - imported to be exported
# fmt: off

from capsule_sym._arrays import Matrix as Array
from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._figures.boundaries import corners, Limits, lines
from capsule_sym._figures.layout import across, add_key, add_words, canvas, handles_of, NARROW
from capsule_sym._figures.portraits import boundary_handles, field_handles, unsettled_handles
from capsule_sym._figures.sizes import PAGE
from capsule_sym._figures.style import (
    describe, field_colour, figure_of, labels_of, LOOKS, mathematical, on_page, REGIONS, styled,
)
from capsule_sym._figures.units import DIMENSIONLESS
