"""The expressions behind each kernel that `codegen/kernels.toml` names.

A block is a list of assignments (symbol, expression); later ones may use earlier ones.
"""

from __future__ import annotations

from collections.abc import Callable

import sympy as sp

from capsule_sym._symbolic.model import basis, flow, jacobian, jets
from capsule_sym._symbolic.model.flow import general_constants
from capsule_sym._symbolic.model.model import SEGMENTS, kappa
from capsule_sym._symbolic.model.symbols import gamma, omega

Assignments = list[tuple[sp.Symbol, sp.Expr]]

_CONSTANTS = (flow.m, kappa, flow.push, flow.friction, basis.sigma, basis.K)

position, velocity, drift_change, advance = sp.symbols("position velocity drift_change advance")


def segment_constants(index: int) -> Assignments:
    """Constants of the segment of field `F{index}`, as read off its equations of motion."""
    values = flow.constants(SEGMENTS[index - 1])
    return [(name, sp.factor(values[name])) for name in _CONSTANTS]


def flow_parameters() -> set[sp.Symbol]:
    """Parameters that the linear flows, apart from their constant terms, depend on."""
    made = general_constants(stick=False)
    found = (made[name].free_symbols for name in (flow.m, kappa, basis.sigma, basis.K))
    return {omega, gamma}.union(*found)


def _relative_flow() -> Assignments:
    derived = flow.derive()
    keep_gap = {flow.spring: _spring()}
    return [
        (position, derived.position.subs(keep_gap)),
        (velocity, derived.velocity.subs(keep_gap)),
    ]


def _spring() -> sp.Expr:
    return jets.with_gap(flow.SPRING)


def _drift_short() -> Assignments:
    return [(drift_change, flow.derive().drift_short.subs(flow.spring, _spring()))]


def _drift_long() -> Assignments:
    derived = flow.derive()
    return [(drift_change, derived.drift_long.subs(derived.velocity, velocity))]


def _advance() -> Assignments:
    derived = flow.derive()
    return [(advance, derived.advance.subs(derived.position, position))]


def _jacobian(stick: bool) -> Assignments:
    rows = jacobian.rows(stick)
    return [
        (sp.Symbol(f"d{i}_{column}"), entry.subs(flow.spring, _spring()))
        for i, row in enumerate(rows)
        for column, entry in zip(jacobian.COLUMNS, row, strict=True)
    ]


def blocks(jet_order: int) -> dict[str, Callable[[], Assignments]]:
    """Name of each block, and the derivation that gives it."""
    return {
        "oscillating": lambda: list(basis.OSCILLATING.items()),
        "overdamped": lambda: list(basis.OVERDAMPED.items()),
        "detached": lambda: list(basis.detached().items()),
        "double": lambda: list(basis.double().items()),
        "sensitivities": lambda: list(basis.sensitivities().items()),
        "double_sensitivities": lambda: list(basis.double_sensitivities().items()),
        "relative_flow": _relative_flow,
        "drift_short": _drift_short,
        "drift_long": _drift_long,
        "capsule_advance": _advance,
        "jet": lambda: jets.jet(jet_order),
        "jet_magnitudes": lambda: jets.magnitudes(jets.jet(jet_order)),
        "jacobian_drift": lambda: _jacobian(stick=False),
        "jacobian_stick": lambda: _jacobian(stick=True),
    }
