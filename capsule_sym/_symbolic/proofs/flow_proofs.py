"""Proofs that the closed-form flow, its jets and its Jacobians solve the fields of the model.

Every statement is substituted back into the equations of motion, for symbolic parameters, state,
phase and duration: the flow into the equations of drift and of stick, the Jacobians into their
variational equations. Their fields are shown to be those of all segments (Eqs. (7)-(12) of the
capsule).
`basis_proofs` proves the rules that are used here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, partial
from itertools import chain

import sympy as sp

from capsule_sym._symbolic.model import basis, declaration, flow, jacobian, jets
from capsule_sym._symbolic.model.basis import INITIAL, K, cosine, sine
from capsule_sym._symbolic.model.flow import PLACE, STIFF, contact, cos_theta, drift, sin_theta
from capsule_sym._symbolic.model.model import (
    ANY_LEVEL,
    DRIVE,
    LEVEL,
    PULL,
    SEGMENTS,
    Linear,
    friction_of,
    high,
    kappa,
)
from capsule_sym._symbolic.model.parts import SpringRange
from capsule_sym._symbolic.model.symbols import (
    MODEL,
    PARAMETERS,
    PULSED,
    alpha,
    force,
    gamma,
    h,
    omega,
    stop,
    tau,
    theta,
    v_c,
    v_r,
    x_c,
    x_r,
)
from capsule_sym._symbolic.proofs.basis_proofs import DEPENDENT, INDEPENDENT, Reduction
from capsule_sym._symbolic.proofs.statement import Residuals, Statement, proof

JET_ORDER = 10  # the recurrence has one form at every order; this many of its steps are compared

_STATE = (x_r, v_r, v_c, x_c)
_START = {**INITIAL, h: sp.S.Zero}
_ANGLE = theta + omega * h

_PAPERS = declaration.path() == declaration.home(declaration.SHIPPED[0])
_ALL = "Eqs. (7)-(12)" if _PAPERS else "all fields"

_derive = cache(flow.derive)
_rows = cache(jacobian.rows)


@dataclass(frozen=True)
class _Motion:
    """A field (rates of x_r, v_r, v_c at time tau) beside the constants of its closed form."""

    name: str
    stick: bool
    field: tuple[sp.Expr, ...]
    pull: sp.Expr
    constants: Mapping[sp.Symbol, sp.Expr]

    @cached_property
    def _reduction(self) -> Reduction:
        definitions = {
            **DEPENDENT,
            **self.constants,
            jets.gap: x_r - stop,
            flow.spring: flow.SPRING,
            flow.margin: flow.MARGIN,
        }
        modes = [one for one in (contact, drift, high) if one not in self.constants]
        symbols = (*_STATE, *PARAMETERS, cos_theta, sin_theta, *modes, *INDEPENDENT)
        return Reduction(symbols, definitions, (K, omega, gamma + 1, gamma))

    def vanishing(self, residual: sp.Expr) -> sp.Expr:
        """Residual in parameters and independent response functions: 0 if it vanishes."""
        return self._reduction.numerator(residual)

    @cached_property
    def end(self) -> dict[sp.Symbol, sp.Expr]:
        """State (x_r, v_r, v_c, x_c) at duration h; in stick (x_r, v_r) alone."""
        derived = _derive()
        moved = {x_r: x_r + derived.position, v_r: derived.velocity}
        if not self.stick:
            moved |= {v_c: v_c + derived.drift_long, x_c: x_c + derived.advance}
        return moved

    @cached_property
    def rates(self) -> dict[sp.Symbol, sp.Expr]:
        """Time derivatives of the state at duration h, as functions of state, theta and h."""
        turned = {sp.cos(omega * tau): sp.cos(_ANGLE)}
        rates = (*(rate.subs(turned) for rate in self.field), v_c)
        return dict(zip(self.end, rates, strict=False))

    def at_end(self, expression: sp.Expr) -> sp.Expr:
        """Expression in state and forcing angle, at duration h."""
        turned = {
            sp.cos(_ANGLE): cos_theta * cosine - omega * sin_theta * sine,
            sp.sin(_ANGLE): sin_theta * cosine + omega * cos_theta * sine,
        }
        return expression.subs(turned).xreplace(self.end)

    def solves(self, state: sp.Symbol, claim: sp.Expr) -> Residuals:
        """Residuals of one component of the flow in its equation of motion and at the start."""
        motion = basis.derivative(claim, h) - self.at_end(self.rates[state])
        return self.vanishing(motion), self.vanishing(claim.xreplace(_START) - state)

    def varies(self, state: sp.Symbol, column: sp.Symbol, claim: sp.Expr) -> Residuals:
        """Residuals of an entry of the Jacobian in the variational equations and at the start."""
        rate = self.rates[state]
        slope = sp.S.Zero if column in _STATE else self.at_end(sp.diff(rate, column))
        for other, line in zip(self.rates, _rows(self.stick), strict=True):
            slope += sp.diff(rate, other) * line[jacobian.COLUMNS.index(column)]
        initial = sp.Integer(state is column)
        if column is h:
            initial = rate.subs(sp.cos(_ANGLE), cos_theta)
        motion = basis.derivative(claim, h) - slope
        return self.vanishing(motion), self.vanishing(claim.xreplace(_START) - initial)

    def equals(self, expected: sp.Expr, claim: sp.Expr) -> Residuals:
        """Residual of an equation between expressions of the start."""
        forcing = {sp.cos(omega * tau): cos_theta}
        return (self.vanishing((claim - expected).subs(forcing)),)


def _general(stick: bool, side: SpringRange | None = None) -> _Motion:
    """All segments in drift, or all in stick, by `contact`, `drift` and, of pulses, `high`.

    With a region, those in it alone, whose contact is a number.
    """
    here = {kappa: STIFF, stop: PLACE} | ({DRIVE: LEVEL} if PULSED else {})
    pull, force = (one.subs(here) for one in (PULL, MODEL.mass_force))
    capsule = sp.S.Zero if stick else (pull - friction_of(drift)) / gamma
    field = (v_r, force - capsule, capsule)
    name, constants = "stick" if stick else "drift", flow.general_constants(stick)
    if side:
        name, number = f"{name}-{side.name}", sp.Integer(MODEL.regions.index(side))
        constants = {one: value.subs(contact, number) for one, value in constants.items()}
        constants |= {contact: number}
    return _Motion(name, stick, field, pull, constants)


def _generals() -> Iterator[_Motion]:
    """Drift and stick, by the symbol `contact`; with two stops region by region, in low powers."""
    for side in (None,) if len(MODEL.stops) == 1 else MODEL.regions:
        yield from (_general(stick, side) for stick in (False, True))


def _field_proofs(segment: Linear) -> Iterator[Statement]:
    general = _general(segment.stick)
    mode = {contact: segment.contact, drift: segment.drift, high: 1 - segment.level}
    told = f"contact {segment.contact}, drift {segment.drift}"
    told += f", high level {mode[high]}" if PULSED else ""
    parts = [*zip(_STATE, general.field, segment.field, strict=False)]
    parts += [("pull", general.pull, segment.pull)]
    if PULSED:
        kind = ANY_LEVEL[(segment.index - 1) % len(ANY_LEVEL)]
        guards = (guard.subs(force, LEVEL) for guard in kind.guards)
        parts += zip(("guard1", "guard2", "guard3", "guard4"), guards, segment.guards, strict=False)
    for part, claim, expected in parts:
        yield proof(
            f"flow.{segment.name}.field.{part}",
            f"Eq. ({segment.index + 6})" if _PAPERS else f"field {segment.name}",
            f"{segment.name} is the {general.name} of {told}",
            claim.subs(mode),
            partial(general.equals, expected),
        )


def _flow_proofs(motion: _Motion) -> Iterator[Statement]:
    for state, claim in motion.end.items():
        yield proof(
            f"flow.{motion.name}.{state}",
            _ALL,
            f"{state}(h) has the rate that {motion.name} gives it, and its value at h = 0",
            claim,
            partial(motion.solves, state),
        )
    steps = dict(jets.jet(1))
    pull = steps[jets.force_symbol(0)]
    equal = {
        "flow {}.drift_short": (_derive().drift_short, _derive().drift_long),
        "jets {}.v_c": ((pull - flow.friction) / gamma, motion.field[2]),
        "jets {}.x2": (steps[jets.position_symbol(2)], motion.field[1]),
        "jets {}.p0": (pull, motion.pull),
    }
    for name, (claim, expected) in [*equal.items()][2 * motion.stick :]:
        yield proof(
            name.replace(" {}", f".{motion.name}"),
            _ALL,
            f"two formulas of {name.rpartition('.')[2]} in {motion.name} agree",
            claim.subs(motion.constants),
            partial(motion.equals, expected),
        )


def _jet_proofs() -> Iterator[Statement]:
    """Statements on a jet: from x3 and p1 on, each is the rate of the one before; amplitudes."""
    steps = dict(jets.jet(JET_ORDER))
    x, p = jets.position_symbol, jets.force_symbol
    amplitudes = [name for name in steps if name.name.startswith("drive")]
    drives = {name: alpha * omega**n for n, name in enumerate(amplitudes, 1)}
    moving = {jets.gap: v_r, cos_theta: -omega * sin_theta, sin_theta: omega * cos_theta}
    moving |= {x(n): x(n + 1) for n in range(JET_ORDER + 1)}

    def follows(previous: sp.Expr, claim: sp.Expr) -> Residuals:
        rate = sum(sp.diff(previous, name) * slope for name, slope in moving.items())
        stiffness = {K: flow.m * flow.STIFFNESS}
        return (sp.expand((claim - rate).subs(drives).subs(stiffness)),)

    successors = [(x(n), x(n + 1)) for n in range(2, JET_ORDER + 1)]
    successors += [(p(n), p(n + 1)) for n in range(JET_ORDER)]
    for symbol, successor in successors:
        yield proof(
            f"jets.{successor}",
            _ALL,
            f"{successor} = d {symbol}/d tau",
            steps[successor],
            partial(follows, steps[symbol]),
        )
    for name, power in drives.items():
        yield proof(
            f"jets.{name}",
            _ALL,
            f"{name} = {power}",
            steps[name].subs(drives),
            partial(_general(stick=False).equals, power),
        )


def _jacobian_proofs(motion: _Motion) -> Iterator[Statement]:
    for state, line in zip(motion.end, _rows(motion.stick), strict=True):
        for column, entry in zip(jacobian.COLUMNS, line, strict=True):
            yield proof(
                f"jacobian.{motion.name}.{state}.{column}",
                f"variational equations of {_ALL}",
                f"d {state}(h)/d {column} has the rate of the linearised field, and its value at 0",
                entry,
                partial(motion.varies, state, column),
            )


@cache
def proofs() -> tuple[Statement, ...]:
    """All statements about the flows of all fields, their jets and their Jacobians."""
    groups: Iterable[Iterator[Statement]] = (
        *map(_field_proofs, SEGMENTS),
        *map(_flow_proofs, _generals()),
        _jet_proofs(),
        *map(_jacobian_proofs, _generals()),
    )
    return tuple(chain.from_iterable(groups))
