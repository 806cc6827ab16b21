"""Balls, passages, orbits and certificates, for proofs beside those of the tool."""

# ruff: noqa: F401, I001 - imported to be exported
# fmt: off

from capsule_sym._enclosures.certificates.certify import certificates, file_of
from capsule_sym._enclosures.numbers.balls import (
    arb, Ball, ball, bits, floats, greatest, largest, matrix, Matrix, precision, stacked,
    symmetric, thin, unit, Unproved, upper,
)
from capsule_sym._enclosures.numbers.fields import (
    at_rest, C, Exponential, Field, generated, ONE, SIZE, U, V, W, X,
)
from capsule_sym._enclosures.orbits.events import beyond, Proved, NEAR, prove_event
from capsule_sym._enclosures.orbits.krawczyk import enclose, image_of, newton, Tube
from capsule_sym._enclosures.orbits.proof import (
    columns_of, guess_of, held, prove_admissible, restarted, shooting_of,
)
from capsule_sym._enclosures.orbits.shooting import BoxValues, Shooting
from capsule_sym._enclosures.orbits.stability import Characteristic, characteristic, monodromy
from capsule_sym._enclosures.passage.exchanges import (
    around, chosen, extended, hull, ranges, ROWS, TIME,
)
from capsule_sym._enclosures.passage.guards import Line, Signs
from capsule_sym._enclosures.passage.runs import enclose_run
from capsule_sym._enclosures.passage.segments import Duration, Passage, Passed, Leg
from capsule_sym._enclosures.passage.switches import GUARD_ROWS, Known, saltation, three, zeros
