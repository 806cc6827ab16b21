"""Expressions of each kernel that `codegen/kernels.toml` names.

A block is a list of assignments (symbol, expression); later ones may use earlier ones.
"""

from __future__ import annotations

import sympy as sp

from capsule_sym._symbolic.model import basis, flow, jacobian, jets
from capsule_sym._symbolic.model.flow import general_constants
from capsule_sym._symbolic.model.model import SEGMENTS, kappa
from capsule_sym._symbolic.model.symbols import PARAMETERS, PULSED, gamma, omega, stop

Assignments = list[tuple[sp.Symbol, sp.Expr]]

_OWN_STOP = (stop,) if stop not in PARAMETERS else ()
_CONSTANTS = (flow.m, kappa, flow.push, flow.friction, basis.sigma, basis.K, *_OWN_STOP)
OWN = tuple(map(str, _CONSTANTS))
"""Names of a segment's constants that follow directly from its equations of motion."""

position, velocity, drift_change, advance = sp.symbols("position velocity drift_change advance")


def segment_constants(index: int) -> Assignments:
    """Constants of the segment of field `F{index}`, from its equations of motion."""
    values = flow.constants(SEGMENTS[index - 1])
    return [(name, sp.factor(values[name])) for name in _CONSTANTS]


def flow_parameters() -> set[sp.Symbol]:
    """Parameters, and `contact`, on which the linear flows depend apart from constant terms."""
    made = general_constants(stick=False)
    found = (made[name].free_symbols for name in (flow.m, kappa, basis.sigma, basis.K))
    return ({gamma} if PULSED else {omega, gamma}).union(*found)


def _flow_blocks() -> dict[str, Assignments]:
    """Blocks of the flow, with `gap` for x_r - stop, and of its Jacobians."""
    derived = flow.derive()
    keep_gap = {flow.spring: jets.with_gap(flow.SPRING)}
    long = derived.drift_long.subs(derived.velocity, velocity)
    return {
        "relative_flow": [
            (position, derived.position.subs(keep_gap)),
            (velocity, derived.velocity.subs(keep_gap)),
        ],
        "drift_short": [(drift_change, derived.drift_short.subs(keep_gap))],
        "drift_long": [(drift_change, long)],
        "capsule_advance": [(advance, derived.advance.subs(derived.position, position))],
        **{
            name: [
                (sp.Symbol(f"d{i}_{column}"), entry.subs(keep_gap))
                for i, row in enumerate(jacobian.rows(stick=stick))
                for column, entry in zip(jacobian.COLUMNS, row, strict=True)
            ]
            for name, stick in (("jacobian_drift", False), ("jacobian_stick", True))
        },
    }


def shared_blocks() -> dict[str, Assignments]:
    """Assignments of the response functions of any scene, by the name of their block."""
    return {
        "oscillating": list(basis.OSCILLATING.items()),
        "overdamped": list(basis.OVERDAMPED.items()),
        "detached": list(basis.detached().items()),
        "double": list(basis.double().items()),
        "sensitivities": list(basis.sensitivities().items()),
        "double_sensitivities": list(basis.double_sensitivities().items()),
    }


def blocks(jet_order: int) -> dict[str, Assignments]:
    """Assignments of the blocks of this scene, by name: its jet, flow and Jacobians."""
    jet = jets.jet(jet_order)
    return {"jet": jet, "jet_magnitudes": jets.magnitudes(jet), **_flow_blocks()}
