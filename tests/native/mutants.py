"""The terms of the certificate, what the core is like without each, and which starts show it."""

from typing import NamedTuple

from tests.native.certificate import WIDTHS, Mutant
from tests.native.families import DOUBLES

ALL = (*WIDTHS,)
WIDE = ("106 bits",)
SCALAR, LANES = ("1", "106 bits"), ("4", "8")
EDGES = "edges"  # not a family here: benchmarks/tests/hardcases/test_edges.py shows these
KILLED: dict[str, tuple[str, ...]] = {
    "rounding": SCALAR[:1] + LANES,
    **dict.fromkeys(("a rival guard", "one change of sign", "every coefficient positive"), ALL),
}
"""Mutants that starts at edges distinguish from the sound core, and the widths where they do."""


class Term(NamedTuple):
    """A term or condition of the certificate: the text without it, and the starts that show it."""

    mutant: Mutant
    shown: dict[str, tuple[str, ...]]
    """Widths at which it is noticed, by the family of starts (families.py, scalar_claims.py)."""

    def widths(self) -> list[str]:
        """Widths at which its absence is noticed."""
        return [width for width in WIDTHS if any(width in some for some in self.shown.values())]


def _term(name: str, old: str, new: str, shown: dict[str, tuple[str, ...]]) -> Term:
    return Term(Mutant(name, old, new), shown)


TERMS: tuple[Term, ...] = (
    _term("rounding of doubles", "#define UNIT 0x1p-53", "0x1p-80", {"moving": DOUBLES}),
    _term("rounding of 106 bits", "#define UNIT 0x1p-102", "0x1p-160", {"moving": WIDE}),
    _term("rounding of a response's coefficients", "(of.units[n] + evaluation_units(n)) * UNIT", "0.0", {"moving": ALL}),
    _term("Taylor's remainder", "1.0001 * (hypot(last, before) + grown * reach)", "0.0", {"late": WIDE}),
    _term("the remainder's rate", "((FULL + 1) * rest[k] + speed[k]) / t->reach", "0.0", {"late": WIDE}),
    _term("x_r's own error", "e.limit[X_ERROR]", "all(0.0)", {"moving": ALL}),
    _term("P's or v_c's own error", "e.limit[SECOND_ERROR]", "all(0.0)", {"moving": ALL}),
    _term("v_r's own error", "bound_dot(t->v_error, e->size)", "all(0.0)", {"stopping": DOUBLES, "moving on long expansions": WIDE}),
    _term("rounding of the gap", "2.0 * UNIT * gap", "0.0 * gap", {"still": ALL}),
    _term("rounding of f_b -+ P", "pick(eq(s->second_zeros, all(0.0)), margin_error, all(0.0))", "all(0.0)", {"still": ALL}),
    _term("rounding of v_c'", "margin_error * t->reach_per_gamma", "0.0 * margin_error", {"heavy": ALL}),
    _term("rounding of v_c", "UNIT * v_c", "all(0.0)", {"fast": ALL}),
    _term("tail of the gap's form", "e->limit[X_TAIL]", "all(0.0)", {"moving": DOUBLES}),
    _term("tail of P's or v_c's form", "e->limit[SECOND_TAIL]", "all(0.0)", {"moving": DOUBLES}),
    _term("error carried to the gap", "s->energy_error * t->x_per_energy", "all(0.0)", {"displaced": ALL}),
    _term("error carried to P", "t->force_per_energy * s->energy_error", "all(0.0)", {"displaced": ALL}),
    _term("error of v_c carried to it", "e.second_own + s->v_c_error", "e.second_own", {"displaced": ALL}),
    _term("error of x_r and v_r carried to v_c", "s->energy_error * t->v_c_per_energy", "all(0.0)", {"energy displaced": ALL}),
    _term("error carried on", "s->energy_error + bound_dot(t->v_error, e->size)", "bound_dot(t->v_error,e->size)", {"displaced": ALL}),
    _term("x_r's own error carried on", "(e->x_own + 2.0 * UNIT * x_size)", "(2.0*UNIT*x_size)", {"still": ALL}),
    _term("rounding of x_r carried on", "2.0 * UNIT * x_size", "0.0 * x_size", {"overdamped": ALL}),
    _term("forcing out of phase", "angle_error * e->size[2] * t->reach", "all(0.0)", {"out of phase": ALL}),
    _term("error of the angle carried on", "s->angle_error + 4.0 * UNIT * TWO_PI", "4.0*UNIT*TWO_PI - (bound){0}", {"out of phase": ALL}),
    _term("rounding of the angle", "4.0 * UNIT * TWO_PI", "0.0", {"moving": DOUBLES, "drift displaced": WIDE}),
    _term("error of v_c carried on", "s->v_c_error + e->second_own", "e->second_own - (bound){0}", {"displaced": ALL}),
    _term("error of x_r and v_r carried on to v_c", "energy * t->v_c_per_energy", "0.0*energy", {"energy displaced": ALL}),
    _term("rounding of v_c carried on", "UNIT * size_of(near_to(to->v_c))", "all(0.0)", {"fast": ALL}),
    _term("range of a form", "(range + rounding) + tail", "rounding+tail", {"moving": ALL}),
    _term("every coefficient positive", "smaller(least, value[j])", "j > 1 && j < DEGREE - 2 ? least : smaller(least, value[j])", {"dipping": DOUBLES, "late": WIDE}),
    _term("each sign beyond its error", "gt(nearest, error)", "not(none)", {"ending": DOUBLES, "ending wide": WIDE}),
    _term("one change of sign", "not(turned)", "not(none)", {EDGES: ALL}),
    _term("tail where signs do not tell", "1.0001 * g->tail", "0.0", {"dipping": ("1",)}),
    _term("Newton's end", "ROOT_UNIT * here", "1e-2 * here", {"moving": ALL}),
    _term("Newton's end by curvature", "UNIT * size_of(near_to(fall))", "1e-6 * size_of(near_to(fall))", {"moving": ALL}),
    _term("rounding over steepness", "(rounding + rounding) / steepness", "0.0*rounding", {"creeping": DOUBLES, "displaced": WIDE}),
    _term("a rival guard", "gt(near_to(value), near_zero)", "gt(near_to(value), all(-1e300))", {"corner": ALL}),
    _term("a rival within its bounds", "begun * (3.0 * g->rounding + off) +\n                            3.0 * g->tail * (until * until * until)", "begun * g->rounding + g->tail * (until * until * until)", {"hidden": ("1",)}),
    _term("a rival within the error of the time", "error * most", "0.0 * most", {"slow corner": ALL}),
    _term("which way after a switch", "le(size_of(within), 16.0 * UNIT * (terms + friction_bounds(b)))", "none", {"stopped": DOUBLES}),
    _term("what is lost below the normal range", "#define UNDERFLOW 1e-290", "0.0", {"tiny": DOUBLES, "tiny, 106 bits": WIDE}),
    _term("a simple root", "gt(0.5 * steepness * straight, apart + apart)", "gt(straight, all(-1.0))", {"inflected": ("1",)}),
    _term("the remainder in P or v_c", "t->limit[k][SECOND_ERROR] += left", "t->limit[k][SECOND_ERROR] += 0.0*left", {"late": WIDE}),
    _term("a third guard", "near_to(f->at) + f->error < found[i].to", "1", {"grazed": SCALAR}),
    _term("which friction bound is met first", "lt(found[SECOND].to, found[FIRST].to)", "gt(found[SECOND].to, found[FIRST].to)", {"both bounds": ("1",)}),
    _term("rounding where signs do not tell", "g->rounding + means", "0.0", {"level": ("1",)}),
    _term("a switch past a run's end", "o->crossing ? 0 : field", "field", {"interrupted": SCALAR}),
    _term("a batch: a switch past a run's end", "crosses ? 0 : field", "field", {"interrupted": LANES}),
    _term("a batch: a sum of many expansions", "expansions > MOST_SUMMED", "0", {"lasting": LANES}),
    _term("a batch: what follows a switch", "(out->undetermined >> l & 1)", "0", {"stopping side by side": LANES}),
    _term("halves of a part of the reach", "whole->to = r", "whole->to = 1.0", {"twice": ("1",)}),
    _term("successor: rounding of P", "MARGIN_AT_UNITS * UNIT * margin_at_size(b, x, gap, v)", "0.0", {"bound": ("1",)}),
    _term("successor: rounding of P'", "(PULL_RATE_UNITS + V_RATE_UNITS) * UNIT", "0.0", {"turning": ("1",)}),
    _term("successor: rounding of v_r'", "V_RATE_UNITS * UNIT * rate_size", "0.0", {"touching": ("1",)}),
    _term("rest for ever: rounding of the forced response", "8.0 * rounded / distance", "0.0", {"resonant": SCALAR}),
    _term("rest for ever: forcing out of phase", "(relative + s->angle_error)", "(relative)", {"resting out of phase": SCALAR}),
    _term("rest for ever: error carried", "s->energy_error + roundings", "roundings", {"resting displaced": SCALAR}),
    _term("rest for ever: x_r", "reach < room_about(b, near_to(rest_centre(c)))", "1", {"resting": SCALAR}),
    _term("rest for ever: P", "most < near_to(friction_guard(c, num(-1.0), load)) &&\n           most < near_to(friction_guard(c, num(1.0), load))", "1", {"resting": SCALAR}),
    _term("long rest: energy", "hypot(near_to(s->v_r), root_K * near_to(sub(s->x_r, rest_centre(c))))", "0.0", {"growing": SCALAR}),
    _term("long rest: growth", "(0.999 * most - energy) / b->alpha", "(0.999 * most - energy) / (0.1 * b->alpha)", {"growing": SCALAR}),
    _term("long rest: error carried", "s->energy_error + 0x1p-40 * (fabs(near_to(s->x_r)) + fabs(centre))", "0.0", {"growing displaced": SCALAR}),
    _term("long rest: x_r", "root_K * room_about(b, centre)", "1e3", {"growing": SCALAR}),
    _term("long rest: P", "least / near_to(force_per_energy(c, num(root_K)))", "1e3", {"growing": SCALAR}),
)  # fmt: skip

BEHIND: tuple[Term, ...] = (
    # Bounds add up, so it has its place: but it is 1e-15 of the responses at most at the library's own
    # reach, where their rounding counts 3e-15, and on longer expansions Taylor's remainder is larger.
    _term("remainder of the series of 14 terms", "rest[k] + change[k]", "rest[k]", {}),
    # Decides only where both friction guards cross in one expansion while 2 f_b is below three tails
    # and what their isolation is off by, some 4e-13 of the largest coefficient.
    _term("friction bounds beside an isolation's error", "friction_bounds(b) > apart", "1", {}),
)  # fmt: skip
"""Terms that no start shows, as others stand before them."""


def table() -> str:
    """The terms by the widths at which their absence is noticed, as a table for the documentation."""
    rows: dict[str, list[str]] = {}
    for term in TERMS:
        key = ", ".join(term.widths()).replace("1, 4, 8", "1, 4, 8 lanes")
        rows.setdefault("1 lane" if key == "1" else key, []).append(term.mutant.name)
    rows["not shown"] = [term.mutant.name for term in BEHIND]
    lines = ["| noticed at | removed |", "|---|---|"]
    lines += [f"| {key} | {'; '.join(names)} |" for key, names in rows.items()]
    return "\n".join(lines)
