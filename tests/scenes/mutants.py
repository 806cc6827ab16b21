"""Terms of the certificate that scenes bring, what the core is like without each, and what shows it."""

from typing import NamedTuple

from tests.native.certificate import Mutant
from tests.scenes.families import BOTH


class Term(NamedTuple):
    """A text without a term or condition, and the family that shows it at these widths."""

    mutant: Mutant
    family: str
    widths: tuple[str, ...]


def _term(name: str, old: str, new: str, family: str, *widths: str) -> Term:
    return Term(Mutant(name, old, new), family, widths)


TERMS = (
    _term("size of the drive in Q", "fabs(near_to(to_second.reaction[n][k]))", "0.0", "from a bound", *BOTH),
    _term("error of the angle in Q", "b->alpha * s->angle_error", "0.0 * s->angle_error", "ahead", *BOTH),
    _term("remainder of the drive in Q", "force_change_size(z, x_left, v_left) + to_second.reaction_left[k]", "force_change_size(z, x_left, v_left)", "late bound, 106 bits", "106 bits"),
    _term("remainder of v_c by momentum", "v_left / (z->gamma + 1.0)", "0.0 * v_left", "pushed off", "106 bits"),
    _term("which stop is met first", "lt(behind.to, front.to)", "gt(behind.to, front.to)", "from stop to stop", "1"),
    _term("rounding of the other gap", "2.0 * UNIT * size_of(near_to(s->other))", "0.0 * size_of(near_to(s->other))", "beside a stop", *BOTH),
    _term("rest for ever: the stop behind", "(c)->CAPSULE_FRONT_GAP - (x) < (c)->CAPSULE_BACK_GAP + (x)", "1", "resting", *BOTH),
    _term("rest for ever: the stop in front", "reach < room_about(b, near_to(rest_centre(c)))", "reach < b->CAPSULE_BACK_GAP + near_to(rest_centre(c))", "resting", *BOTH),
    _term("rounding before an edge", "3.0 * g->rounding", "0.0 * g->rounding", "corner of a displaced motion", *BOTH),
    _term("tail before an edge", "3.0 * g->tail", "0.0 * g->tail", "levelling", "1"),
    _term("error of the edge's time", "error * most", "0.0 * most", "corner at a late edge", "1"),
    _term("a crossing that ends before the edge", "lt(at + error, g->to)", "not(none)", "grazing", "1"),
    _term("rest that breaks at an edge", "moved |= out->edge", "moved |= none", "breaking", *BOTH),
)  # fmt: skip

BEHIND = (
    # Of the drive's cosine and sine each counts at its full size, so one is a cover for the other.
    _term("remainder of the drive's cosine", "r.reaction_left[2] = 1.0001 * left", "0.0", "late bound, 106 bits"),
    _term("remainder of the drive's sine", "r.reaction_left[3] = 1.0001 * left / z->omega", "0.0", "late bound, 106 bits"),
    # The remainder of the drive's series in doubles is less than the form's tail.
    _term("terms of the drive left out", "economize(b, to_second.reaction, FULL, TERMS, 0, to_second.reaction_left, unused[0], unused[1])", "economize(b, to_second.reaction, FULL, TERMS, 0, unused[0], unused[0], unused[1])", "late bound"),
    # Beside 20 units and more of each term.
    _term("units of the coefficient behind", "(of.units[n + 1] - of.units[n] + 2) * UNIT", "0.0", "from a bound"),
    # As for the friction bounds (tests/native/mutants.py).
    _term("distance of the stops", "stops_apart(b) > apart", "1", "from stop to stop"),
    # An isolation allows for means of 50 halvings, far more than it takes.
    _term("isolation before an edge", "g->off", "all(0.0)", "levelling"),
)  # fmt: skip
"""Terms that no start shows, as others stand before them."""
