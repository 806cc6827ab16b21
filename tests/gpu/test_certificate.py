"""Claims of the device source about an expansion, beside 60 digits, and it without each term."""

from __future__ import annotations

import ctypes
import math
from random import Random

import numpy as np
import pytest

from benchmarks.hardcases.cases import Case, cases
from capsule_sym import simulate
from capsule_sym._native import core_of
from capsule_sym._parameters import CAPSULE
from tests.gpu.host import COMPILER
from tests.gpu.probed import changed, probed
from tests.native.certificate import Core
from tests.native.families import FAMILIES
from tests.native.mutants import EDGES, TERMS, Term
from tests.native.scalar_claims import CLAIMS, first_false_answer
from tests.native.test_certificate import MOST, first_false_claim
from tests.native.test_edges import KILLED, MUTANTS, Edge, Edges, decided, edges, wrong

__all__ = ["edges"]  # a fixture

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(COMPILER is None, reason="no C++ compiler here"),
]
WIDTH = "1"
OWN = tuple(term for term in TERMS if WIDTH in term.widths())
SAID = [name for name, of in CLAIMS.items() if WIDTH in of[2]]
INTERRUPTED = "interrupted"
SHOWN = [term for term in OWN if EDGES not in term.shown]


@pytest.fixture(scope="module")
def core() -> Core:
    return Core(probed(tuple(term.mutant for term in OWN)))


@pytest.mark.parametrize("family", [name for name, of in FAMILIES.items() if WIDTH in of[2]])
def test_what_the_step_claims_is_true(core: Core, family: str) -> None:
    core.weak.value = 0
    assert first_false_claim(core, family, WIDTH, range(40)) == ""


@pytest.mark.parametrize("family", [name for name in SAID if name != INTERRUPTED])
def test_what_is_said_of_a_start_is_true(core: Core, family: str) -> None:
    core.weak.value = 0
    assert first_false_answer(core, family, WIDTH, range(MOST)) == ""


def all_continue(core: Core) -> bool:
    """True if each run that ends at a switch, but for a rounding, continues for another period.

    A run that is handed back continues in the C core, which would not take another field.
    """
    binding = core_of(CAPSULE)
    assert binding is not None
    core.reach.value = 0.0
    for number in range(MOST):
        start = CLAIMS[INTERRUPTED][1](Random(f"{INTERRUPTED} {number}"))
        row = np.array([[*start.parameters.to_dict().values()]])
        begin = np.array([(*start.state, start.angle, *start.zeros, *start.errors)], dtype=float)
        record, stops = np.zeros(1, binding.STATE), np.zeros(1, np.int8)
        at = [ctypes.c_void_p(array.ctypes.data) for array in (row, begin, record)]
        for periods in (1, 2):
            of = at[0], start.field, at[1], periods - 1, periods, at[2]
            if core.library.run_to(*of) == binding.OPEN:
                binding.run_many(row, record, periods, stops, lanes=1)
                if stops[0] != binding.DONE:
                    return False
    return True


def test_runs_that_end_at_a_switch_continue(core: Core) -> None:
    core.weak.value = 0
    assert all_continue(core)


@pytest.mark.parametrize("term", SHOWN, ids=lambda term: term.mutant.name)
def test_without_a_term_a_claim_is_false(core: Core, term: Term) -> None:
    core.weak.value = OWN.index(term) + 1
    for family, widths in term.shown.items():
        if WIDTH in widths:
            false = first_false_answer if family in CLAIMS else first_false_claim
            if family == INTERRUPTED:
                assert not all_continue(core)
            else:
                assert false(core, family, WIDTH, range(MOST)), family


def test_nothing_near_a_tangency_or_a_corner_is_decided_wrongly(edges: Edges) -> None:
    sound = changed(None)
    assert wrong(sound, edges, 1) == []
    far = [decided(sound, edge, 1) for edge in edges if edge.distance == math.inf]
    assert len(far) > 100
    assert -1 not in far


@pytest.mark.parametrize("mutant", KILLED)
def test_a_bound_that_is_gone_is_noticed(edges: Edges, mutant: str) -> None:
    assert wrong(changed(MUTANTS[mutant]), edges, 1) != []


def test_hard_cases_are_decided_as_by_50_digits_or_handed_back() -> None:
    sound, known, handed = changed(None), list(cases()), []
    for case in known:
        edge = edge_of(case)
        found = decided(sound, edge, 1)
        if found == -1:
            handed.append(case.name)
        else:
            assert found == edge.switch, case.name
    assert 0 < len(handed) < len(known) // 2


def edge_of(case: Case) -> Edge:
    """A hard case, and its first switch by the map that escalates to 50 digits."""
    start = case.build()
    run = simulate(
        start.parameters, start.state, start.phase, start.periods, backend="mpmath", max_segments=1
    )
    first = next(iter(run.segments))
    plane = int(first.target[1:]) if first.target else 0
    return Edge(start, 0.0, (first.field, plane) if plane else (0, 0))
