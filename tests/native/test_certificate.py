"""Every claim of the certified step beside 60 digits, at every width, and the step without each of
its terms."""

import shutil
from functools import cache
from random import Random

import pytest

from tests.native import ROOT
from tests.native.certificate import WIDTHS, Core, Start, Truth, build, false_claims
from tests.native.families import FAMILIES
from tests.native.mutants import BEHIND, EDGES, KILLED, TERMS, Term, table
from tests.native.scalar_claims import CLAIMS, first_false_answer

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

KNOWN = (*TERMS, *BEHIND)
FEW, MOST = 3, 60
IMPLIED = {"root": "x_r's own error", "v_r": "v_r's own error", "impulse": "rounding of {}"}
"""Errors that bounds include in another term, and this term."""
UNIT = {"1": 2.0**-53, "4": 2.0**-53, "8": 2.0**-53, "106 bits": 2.0**-102}


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Core:
    mutants = tuple(term.mutant for term in KNOWN)
    return Core(build(tmp_path_factory.mktemp("probed") / "c", mutants))


@cache
def drawn(family: str, number: int) -> tuple[Start, Truth]:
    start = FAMILIES[family][0](Random(f"{family} {number}"))
    return start, Truth(start)


def first_false_claim(core: Core, family: str, width: str, starts: range) -> str:
    """A claim about the starts of a family that is false, empty if all are true."""
    core.reach.value = FAMILIES[family][1]
    for number in starts:
        start, truth = drawn(family, number)
        seen = core.probe(width, [start] * WIDTHS[width])[number % WIDTHS[width]]
        for claim in false_claims(start, seen, truth):
            return f"{claim}: {start}"
    return ""


@pytest.mark.parametrize("family", FAMILIES)
def test_what_the_step_claims_is_true(core: Core, family: str) -> None:
    core.weak.value = 0
    for width in FAMILIES[family][2]:
        assert first_false_claim(core, family, width, range(200)) == ""


@pytest.mark.parametrize("family", CLAIMS)
def test_what_is_said_of_a_start_is_true(core: Core, family: str) -> None:
    core.weak.value = 0
    for width in CLAIMS[family][2]:
        assert first_false_answer(core, family, width, range(MOST)) == "", width


def not_implied(core: Core, width: str) -> list[str]:
    """Starts whose bounds hold less than the roundings that they imply and do not count apart.

    Those are 4 units of where a root is, 2 of v_r where a segment continues, and 4 of the impulse
    that drives both bodies until there.
    """
    found = []
    for family, (_, reach, widths) in FAMILIES.items():
        if reach or width not in widths or family.startswith("tiny"):
            continue
        core.reach.value = 0.0
        for number in range(FEW):
            start, truth = drawn(family, number)
            for now in core.probe(width, [start] * WIDTHS[width])[0]:
                unit, h, p = UNIT[width], float(now["h"][0]), start.parameters
                if now["crossing"] and now["error"] * now["reach"] < 4 * unit * h:
                    found.append(f"root of {family} {number}")
                if now["crossing"] or now["open"]:
                    continue
                if now["energy_error"] < 2 * unit * abs(now["v_r"][0]):
                    found.append(f"v_r of {family} {number}")
                impulse = p.alpha * min(h, 2 / p.omega) + p.f_b * h
                if truth.way and now["v_c_error"] < 4 * unit * impulse / (1 + p.gamma):
                    found.append(f"impulse of {family} {number}")
    return found


@pytest.mark.parametrize("width", WIDTHS)
def test_bounds_hold_what_they_do_not_count_apart(core: Core, width: str) -> None:
    core.weak.value = 0
    assert not_implied(core, width) == []
    names = [term.mutant.name for term in KNOWN]
    for implied, term in IMPLIED.items():
        core.weak.value = (
            names.index(term.format("106 bits" if width == "106 bits" else "doubles")) + 1
        )
        assert any(line.startswith(implied) for line in not_implied(core, width)), implied


@pytest.mark.parametrize("term", TERMS, ids=lambda term: term.mutant.name)
def test_without_a_term_a_claim_is_false(core: Core, term: Term) -> None:
    core.weak.value = KNOWN.index(term) + 1
    if EDGES in term.shown:
        assert KILLED[term.mutant.name] == term.shown[EDGES]  # a test of its own
        return
    for family, widths in term.shown.items():
        false = first_false_answer if family in CLAIMS else first_false_claim
        for width in widths:
            assert false(core, family, width, range(MOST)), width


@pytest.mark.parametrize("term", BEHIND, ids=lambda term: term.mutant.name)
def test_a_term_that_is_said_not_to_be_shown_is_not(core: Core, term: Term) -> None:
    core.weak.value = KNOWN.index(term) + 1
    shown = [
        (family, width)
        for family, (_, reach, widths) in FAMILIES.items()
        for width in widths
        if reach == 0.0 and first_false_claim(core, family, width, range(20))
    ]
    assert shown == []


def test_a_lane_does_not_depend_on_its_neighbours(core: Core) -> None:
    """Eight starts of one flow in every order, and each alone among copies of itself."""
    core.weak.value, core.reach.value = 0, 0.0
    first, _ = drawn("moving", 0)
    x_r, v_r, v_c = first.state
    starts = [
        Start(first.parameters, first.field, (x_r + 0.1 * i, v_r - 0.2 * i, v_c * (1 + i)), 0.7 * i)
        for i in range(8)
    ]
    for width, lanes in WIDTHS.items():
        alone = [core.probe(width, [start] * lanes)[0][0].tobytes() for start in starts[:lanes]]
        for turn in range(lanes):
            order = [(turn + 3 * lane) % lanes for lane in range(lanes)]
            seen = core.probe(width, [starts[i] for i in order])
            assert [lane[0].tobytes() for lane in seen] == [alone[i] for i in order]


def test_the_documentation_has_the_table_of_terms() -> None:
    assert table() in (ROOT / "benchmarks" / "MEASUREMENTS.md").read_text(encoding="utf-8")
