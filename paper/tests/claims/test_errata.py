"""Witnesses of the errata, evaluated with an independent form of the model in fractions."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from capsule_sym._symbolic.model.proof import consistent
from capsule_sym._symbolic.model.symbols import (
    alpha,
    beta,
    delta,
    f_b,
    force,
    gamma,
    v_c,
    v_r,
    x_r,
    zeta,
)
from paper.claims import everything
from paper.claims.errata import Erratum, fails
from paper.printed import read

ITEMS = {item.name: item for item in everything.statements(read())}
BY_ID = {
    name.removeprefix("erratum."): Erratum(**item.claim)
    for name, item in ITEMS.items()
    if item.check is fails
}


def _force(point: dict[sp.Symbol, Fraction], contact: bool) -> Fraction:
    spring = point[beta] * (point[x_r] - point[delta]) if contact else 0
    return point[x_r] + 2 * point[zeta] * point[v_r] + spring


@pytest.mark.parametrize("name", BY_ID)
def test_witness_is_in_range(name: str) -> None:
    erratum = BY_ID[name]
    point = erratum.point()
    assert point[alpha] >= 0
    assert point[delta] >= 0
    assert point[f_b] == 1
    assert point[force] == point[alpha]  # tau = 0
    assert consistent(erratum.holding)


def test_equation_23_at_its_witness() -> None:
    point = BY_ID["equation.23"].point()
    assert _force(point, contact=False) == -1
    acceleration = 1 + point[force]
    value = -point[v_r] - 2 * point[zeta] * acceleration
    printed = -point[v_r] + 2 * point[zeta] + 2 * point[zeta] * point[force]
    assert value != printed
    assert value == -point[v_r] - 2 * point[zeta] - 2 * point[zeta] * point[force]


def test_forward_drift_from_l4_is_decelerated() -> None:
    witness = ITEMS["erratum.table2.L4"].witness()
    point = {s: Fraction(witness[str(s)]) for s in (x_r, v_r, zeta, beta, gamma, delta)}
    assert _force(point, contact=True) == -1
    assert point[x_r] > point[delta]
    assert (_force(point, contact=True) - 1) / point[gamma] == -2 / point[gamma]


def test_second_spring_ends_stick_that_the_printed_condition_holds() -> None:
    witness = ITEMS["erratum.equation.5.held"].witness()
    point = {s: Fraction(witness[str(s)]) for s in (x_r, v_r, zeta, beta, gamma, delta)}
    assert point[x_r] > point[delta]
    assert abs(_force(point, contact=False)) < 1 < _force(point, contact=True)


@pytest.mark.parametrize("line", ["L5", "L7"])
def test_line_above_the_corner_leads_out_of_contact_forwards(line: str) -> None:
    witness = ITEMS[f"erratum.equation.14.{line}"].witness()
    point = {s: Fraction(witness[str(s)]) for s in (x_r, v_r, zeta, beta, gamma, delta)}
    assert point[x_r] == point[delta] > 1
    assert _force(point, contact=False) > 1  # (P3 - f_b)/gamma > 0: forward drift
    assert point[v_r] < 0  # out of contact
    assert witness["passage there"].startswith("Ω6 → Ω1, not ")
    printed = {"L5": 2 * point[zeta] * point[v_r] > 1 - point[delta], "L7": point[v_r] < 0}
    assert printed[line]


def test_literal_equation_6_lets_a_moving_capsule_coast() -> None:
    point = BY_ID["equation.6"].point()
    assert point[v_c] > 0
    assert abs(_force(point, contact=False)) < 1


def test_spring_force_decides_stick_in_contact() -> None:
    point = BY_ID["equation.11"].point()
    assert abs(_force(point, contact=False)) <= 1 < _force(point, contact=True)


def test_true_statement_has_no_witness() -> None:
    erratum = BY_ID["equation.23"]
    true = replace(erratum, printed=erratum.expected)
    with pytest.raises(ValueError, match="holds everywhere"):
        true.point()


def test_true_statement_is_not_settled_as_an_erratum() -> None:
    erratum = BY_ID["equation.23"]
    assert not replace(erratum, printed=erratum.expected).settled()


def test_errata_hold_errors_only() -> None:
    """Right statements, and those right in scope, are distinguished from refuted ones."""
    for item in ITEMS.values():
        assert item.name.startswith("erratum.") == (item.verdict == "refuted")
        if item.verdict == "refuted":
            assert item.derived != "as printed"


def test_what_the_scan_leaves_in_doubt_says_so() -> None:
    for entry in read():
        assert bool(entry.note) == (entry.reading != "clear") or entry.id == "table.2"
    assert "doubtful scan" in ITEMS["erratum.equation.11"].printed
    assert "illegible" in ITEMS["erratum.section.3.1.O1.line"].printed


def test_known_doubts_are_all_settled() -> None:
    assert {
        "erratum.equation.23",
        "erratum.appendix.B.L2^(1)",
        "erratum.appendix.B.L2^(3).sign",
        "erratum.equation.6",
        "erratum.table2.L4",
        "erratum.table3.missing.restricted",
        "erratum.table3.missing.every",
        "printed.section.3.3.L2^(1).stick",
        "printed.appendix.B.L3^(3)",
        "erratum.equation.5.held",
        "erratum.section.3.1.O1.line",
        "erratum.section.4.reference.1",
    } <= set(ITEMS)


def test_counterexample_by_an_independent_integrator() -> None:
    """From rest: stick, backward drift, and the impact while the capsule still moves back."""
    claim = ITEMS["erratum.section.3.1.equal"].claim
    values = {name: float(text) for name, text in claim["at"].items()}
    assert values["delta"] == values["f_b"] == 1
    assert values["zeta"] > 0

    def force(y: np.ndarray) -> float:
        return float(y[0] + 2 * values["zeta"] * y[1])

    def stick(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -force(y) + values["alpha"] * np.cos(values["omega"] * t), 0.0]

    def drift(t: float, y: np.ndarray) -> list[float]:
        capsule = (force(y) + 1) / values["gamma"]
        return [y[1], stick(t, y)[1] - capsule, capsule]

    def slip(t: float, y: np.ndarray) -> float:
        return abs(force(y)) - 1

    def contact(t: float, y: np.ndarray) -> float:
        return float(y[0] - 1)

    slip.terminal = contact.terminal = True  # type: ignore[attr-defined]
    options = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-12}
    first = solve_ivp(stick, (0, 20), [0, 0, 0], events=(slip, contact), **options)
    assert force(first.y[:, -1]) == pytest.approx(-1)
    second = solve_ivp(drift, (first.t[-1], 30), first.y[:, -1], events=contact, **options)
    assert second.y[0, -1] == pytest.approx(1)
    assert second.y[2, 1:].max() < 0
