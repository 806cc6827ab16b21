"""The local maps of Table 3 as derived, and what a wide gap excludes."""

import pytest
import sympy as sp

from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.symbols import delta, f_b, zeta
from capsule_sym._symbolic.proofs.statement import Statement, settle
from paper.derived import appendices, inner_products, tables
from paper.derived.local_maps import SCENARIOS, allowed_maps, local_maps, never_rests
from tests.sampling import sampled, some

GROUPS = (inner_products.inner, tables.table_2, tables.table_3, appendices.items)


@sampled
@pytest.mark.parametrize("group", GROUPS)
def test_statements_are_settled_and_wrong_claims_refused(group: object) -> None:
    for one in some(tuple(group()), 2):
        result = settle(one)
        assert result.settled, (one.name, result.status)
        assert bool(result.witness) == bool(one.witness), one.name
        assert settle(one.mutant).status == "failed", one.name


def test_conditional_statements_are_those_of_signs_that_vary() -> None:
    found: list[Statement] = [one for group in GROUPS for one in group()]
    assert {one.name for one in found if one.verdict == "conditional"} == {
        *(f"table2.{line}" for line in ("L1", "L2", "L3", "L4")),
        *(f"appendix.B.L{line}^(2)" for line in range(1, 5)),
        *(one.name for one in inner_products.inner() if "exactly where" in one.says),
    }


def test_local_maps_are_counted_once() -> None:
    assert len(local_maps()) == len(set(local_maps())) == 52


def test_wide_gap_excludes_contact_from_stick() -> None:
    for scenario in ("δ = f_b", "δ > f_b"):
        maps = allowed_maps([SCENARIOS[scenario], zeta > 0])
        assert not [m for m in maps if m.target == "Σ5" and m.field in (1, 2, 3)]
        assert {m.target for m in maps if m.source == "Σ7"} == {"Σ8"}


def test_only_forward_contact_never_rests() -> None:
    wide = [sp.Ge(delta, f_b)]
    assert [s.index for s in SEGMENTS if not s.stick and never_rests(s, wide)] == [4]
    assert not never_rests(SEGMENTS[3], [])
