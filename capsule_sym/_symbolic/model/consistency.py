"""Consistency checks of a declaration, which name the line at fault."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp
from sympy.polys.polyerrors import BasePolynomialError

from capsule_sym._symbolic.model.parts import (
    BadDeclaration,
    DeclaredUnit,
    Drive,
    Mode,
    Parameter,
    Quantity,
    SpringRange,
    excess,
    read,
    substituted,
    unit_of,
)

tau = sp.Symbol("tau", real=True)
"""Time."""

force = sp.Symbol("u", real=True)
"""Force of the drive, as a symbol of its own."""

UNITS = {"friction_force": "N", "natural_frequency": "rad/s", "length_scale": "m"}
"""Units of results that a device defines, and their own units in SI."""


class Declared:
    """A declaration with the line of each word; `check` raises BadDeclaration if inconsistent."""

    def __init__(self) -> None:
        self.parameters: list[Parameter] = []
        self.quantities: list[Quantity] = []
        self.units: list[DeclaredUnit] = []
        self.state: tuple[sp.Symbol, ...] = ()
        self.state_labels: dict[str, str] = {}
        self.regions: list[SpringRange] = []
        self.modes: list[Mode] = []
        self.drive: Drive | None = None
        self.stiffness = sp.Symbol("kappa", nonnegative=True)
        self.stop = sp.Symbol("stop", real=True)
        self.force = self.mass_force = self.capsule_force = sp.Integer(0)
        self.inertia = self.weight = sp.Integer(0)
        self._lines: dict[str, int] = {}
        self._file = ""

    def refusal(self, word: str | int, said: str) -> BadDeclaration:
        """Error, to be raised, about a word or a line; line 1 for a word that is not declared."""
        line = word if isinstance(word, int) else self._lines.get(word, 1)
        return BadDeclaration(f"{self._file}:{line}: {said}")

    def symbol(self, name: str) -> sp.Symbol:
        """Symbol of a parameter; raises KeyError if none has this name."""
        return {one.name: one.symbol for one in self.parameters}[name]

    @property
    def bounds(self) -> Mapping[int, sp.Expr]:
        """Friction bound by direction of drift: at rest -bounds[-1] < force < bounds[1]."""
        return {mode.way: -mode.way * mode.friction for mode in self.modes if mode.way}

    @property
    def stops(self) -> tuple[sp.Expr, ...]:
        """x_r where the spring of each stop begins to act: in front, and behind if there is one."""
        x_r = self.state[0]
        return tuple(x_r - way * excess(one.where[0]) for way, one in self._beyond)

    @property
    def springs(self) -> tuple[sp.Symbol, ...]:
        """For each stop the parameter to which its stiffness is proportional."""
        return tuple(self._spring(one) for _, one in self._beyond)

    @property
    def _beyond(self) -> tuple[tuple[int, SpringRange], ...]:
        """Side of each stop (1 in front, -1 behind) and the region beyond it."""
        return tuple(zip((1, -1), self.regions[1:], strict=False))

    @property
    def load(self) -> sp.Expr:
        """Constant force on the mass in addition to drive and interaction."""
        return sp.expand(self.mass_force - self.drive_force + self.force)

    @property
    def drive_force(self) -> sp.Expr:
        """Force of the drive on the mass; for pulses the symbol of their level."""
        if self.drive and self.drive.pulsed:
            return force
        return self.symbol("alpha") * sp.cos(self.symbol("omega") * tau)

    @property
    def reacts(self) -> bool:
        """True if the drive pushes the capsule back."""
        return bool(sp.expand(self.capsule_force - self.force) != 0)

    @property
    def driven(self) -> dict[str, tuple[str, str]]:
        """For quantities proportional to one parameter: that parameter, and the quantity's unit.

        Such a quantity is in no unit of results and in no other parameter. The order is that of the
        parameters.
        """
        known, found = self.relations() if self.quantities else {}, {}
        held = {one for unit in self.units for one in known[unit.letter].free_symbols}
        for one in self.quantities:
            symbol = known[one.name]
            by = [p.name for p in self.parameters if known[p.name].has(symbol)]
            alone = len(by) == 1 and symbol not in held
            if alone and not sp.cancel(known[by[0]] / symbol).has(symbol):
                found[one.name] = by[0], one.unit
        order = [one.name for one in self.parameters]
        return dict(sorted(found.items(), key=lambda one: order.index(one[1][0])))

    def relations(self) -> dict[str, sp.Expr]:
        """Quantities, units (by letter) and parameters by name, in terms of the quantities.

        Raises BadDeclaration for a relation that is not arithmetic or not of the declared unit;
        parameters have none.
        """
        known = {one.name: sp.Symbol(one.name, positive=True) for one in self.quantities}
        numbers = {known[one.name]: k for k, one in enumerate(self.quantities, start=2)}
        sizes = {known[one.name]: unit_of(one.unit) for one in self.quantities}
        told = [(f"unit {one.name}", one.letter, one.relation) for one in self.units]
        told += [(f"parameter {one.name}", one.name, one.si) for one in self.parameters]
        for word, name, relation in told:
            unit = UNITS.get(word.removeprefix("unit "), "")
            try:
                known[name] = found = read(relation, known)
            except ValueError as error:
                raise self.refusal(word, f"{name} = {relation}: {error}") from error
            size = found.subs({one: numbers[one] * sizes[one] for one in numbers})
            if size / found.subs(numbers) != unit_of(unit):
                raise self.refusal(word, f"{name} = {relation} is not in {unit or 'numbers'}")
        return known

    def in_quantities(self, relation: str) -> str:
        """Relation in quantities and units alone, with the relations of its parameters put in."""
        own = {one.name: f"({one.si})" for one in self.parameters}
        found = substituted(relation, own)
        return relation if found == relation else self.in_quantities(found)

    def check(self) -> None:
        """Raise BadDeclaration, with the line at fault, if the declaration is inconsistent."""
        for word in ("state", "interaction", "region", "rest", "drift", "mass", "capsule"):
            if word not in self._lines:
                raise self.refusal(1, f"nothing is said of the {word}")
        self._check_equations()
        self._check_ways()
        self._check_room()
        if self.quantities or self.units:
            self._check_device()

    def _check_room(self) -> None:
        """Check that there is room between two stops at the default values."""
        defaults = {one.symbol: one.default for one in self.parameters}
        if len(self.stops) == 2 and (self.stops[0] - self.stops[1]).subs(defaults) <= 0:
            said = f"by the defaults no room is between {self.stops[1]} and {self.stops[0]}"
            raise self.refusal("state", said)

    def _check_device(self) -> None:
        """Check that a device has all units, each parameter a relation, each quantity a use."""
        own = {*self.state_labels, *(one.name for one in self.parameters)}
        names = {f"quantity {one.name}": one.name for one in self.quantities}
        for word, name in (names | {f"unit {one.name}": one.letter for one in self.units}).items():
            if name in own:
                raise self.refusal(word, f"{name} is a name of the model and of the device")
        if missing := [one for one in UNITS if one not in [unit.name for unit in self.units]]:
            place = f"quantity {self.quantities[0].name}"
            raise self.refusal(place, f"the device has no {missing[0]}")
        if missing := [one.name for one in self.parameters if not one.si]:
            said = f"{missing[0]} has no relation, si, to the device"
            raise self.refusal(f"parameter {missing[0]}", said)
        known = self.relations()
        used = {symbol for name in own & {*known} for symbol in known[name].free_symbols}
        for one in self.quantities:
            if known[one.name] not in used:
                raise self.refusal(f"quantity {one.name}", f"{one.name} is in no relation")

    def _check_drive(self, line: int) -> None:
        """Check that a drive consists of parameters with the names and ranges of their roles."""
        assert self.drive
        ranges = {one.symbol: (one.low, one.high) for one in self.parameters}
        drive = self.drive
        roles = {"amplitude": drive.amplitude, "frequency": drive.frequency}
        if drive.pulsed:
            roles |= {"low level": drive.low, "share of the period": drive.share}
        for role, symbol in roles.items():
            if symbol not in ranges:
                raise self.refusal(line, f"the drive's {role}, {symbol}, is no parameter")
        for role, name in (("amplitude", "alpha"), ("frequency", "omega")):
            if roles[role].name != name:
                raise self.refusal(line, f"the drive's {role} is named {name}, not {roles[role]}")
        if len({*roles.values()}) < len(roles):
            raise self.refusal(line, "one parameter has two roles in the drive")
        if drive.pulsed:
            low, high = ranges[drive.share]
            if not 0 < low < high < 1:
                said = f"the share {drive.share} of a period is in (0, 1), not [{low:g}, {high:g}]"
                raise self.refusal(f"parameter {drive.share}", said)

    def _check_equations(self) -> None:
        held = {*self.state, tau, self.stiffness, self.stop, force}
        if self.load.free_symbols & held or not self._affine(self.load):
            raise self.refusal(
                "mass",
                "the forces on the mass are the drive, alpha*cos(omega*tau) or what pulses gives, "
                "less the interaction force, and a constant",
            )
        if self.reacts and sp.expand(self.capsule_force - self.force + self.drive_force) != 0:
            raise self.refusal(
                "capsule",
                "the capsule is moved by the interaction force and friction, and where the drive "
                f"reacts on it by all of that, -{self.drive_force}",
            )
        lift = sp.expand(-self.symbol("gamma") * self.load)
        if self.weight != 0 and sp.expand(self.weight) != lift:
            said = f"the weight is {lift}, by the bias on the mass, not {self.weight}"
            raise self.refusal("capsule", said)
        if self.inertia != self.symbol("gamma"):
            raise self.refusal("capsule", f"the mass ratio is gamma, not {self.inertia}")

    def _check_force(self) -> None:
        x_r, v_r, v_c = self.state
        place = self.stop if len(self.stops) == 2 else self.stops[0]
        rest = sp.expand(self.force - self.stiffness * (x_r - place))
        if (
            not self._affine(self.force)
            or rest.subs({x_r: 0, v_r: 0}) != 0
            or {v_c, self.stiffness, self.stop} & rest.free_symbols
            or not rest.coeff(x_r).is_positive
            or not rest.coeff(v_r).is_nonnegative
        ):
            raise self.refusal(
                "interaction",
                "the interaction force is linear in x_r and v_r, with coefficients > 0 and >= 0 "
                "that are polynomials of the parameters, and with "
                f"{self.stiffness}*(x_r - {place}) for the spring of a stop",
            )
        damping = sp.cancel(rest.coeff(v_r) / self.symbol("zeta"))
        if not (damping.is_number and 0 < damping <= 2):
            said = f"the damping {rest.coeff(v_r)} is not zeta times a number above 0, at most 2"
            raise self.refusal("interaction", said)

    def _affine(self, function: sp.Expr) -> bool:
        """True if affine in the state with polynomials of the parameters as coefficients."""
        symbols = (one.symbol for one in self.parameters)
        names = (*self.state, self.stiffness, self.stop, *symbols)
        try:
            powers = sp.Poly(sp.expand(function), *names, domain=sp.QQ).monoms()
        except BasePolynomialError:
            return False
        return all(sum(power[: len(self.state)]) <= 1 for power in powers)

    def _check_stops(self) -> None:
        """Check that no spring acts between the stops, and one of its own beyond each."""
        first, *others = self.regions
        if len(others) not in (1, 2):
            said = "two regions beside one stop, x_r < delta first; three beside two stops"
            raise self.refusal(self.regions[-1].line, said)
        asked = ("x_r < delta", "x_r < delta_1, x_r > -delta_2")[len(others) - 1]
        places = [p.symbol for p in self.parameters]
        x_r, ways = self.state[0], (1, -1)
        gaps = {way * x_r + excess(one) for way, one in zip(ways, first.where, strict=False)}
        for gap in self.parameters:
            if gap.symbol in gaps and gap.signed:
                said = f"{gap.name} ranges from {gap.low:g}, but a gap is at least 0"
                raise self.refusal(f"parameter {gap.name}", said)
        if first.stiffness != 0 or len(first.where) != len(others) or gaps - {*places}:
            said = f"the first region is {asked}, of parameters, with stiffness=0: no spring acts"
            raise self.refusal(first.line, said)
        for inner, one in zip(first.where, others, strict=True):
            self._check_spring(one)
            if len(one.where) != 1 or sp.expand(excess(inner) + excess(one.where[0])) != 0:
                said = f"no way from {first.name} to {one.name}: beside {inner} lies nothing"
                raise self.refusal(one.line, said)

    def _check_spring(self, region: SpringRange) -> None:
        """Check that the stiffness beyond a stop is a parameter times a positive factor."""
        stiffness = region.stiffness
        held_by = stiffness.free_symbols - {one.symbol for one in self.parameters}
        if held_by or not (self._affine(stiffness) and stiffness.is_nonnegative):
            said = f"the stiffness {stiffness} is no polynomial >= 0 of parameters"
            raise self.refusal(region.line, said)
        try:
            self._spring(region)
        except StopIteration:
            said = f"the stiffness {stiffness} is not a parameter times what is above 0"
            raise self.refusal(region.line, said) from None

    def _spring(self, region: SpringRange) -> sp.Symbol:
        """Parameter to which a stiffness is proportional; raises StopIteration without one."""
        factors = (p.symbol for p in self.parameters if region.stiffness.has(p.symbol))
        return next(p for p in factors if sp.cancel(region.stiffness / p).is_positive)

    def _check_ways(self) -> None:
        """Check that where a mode of friction ends another one begins."""
        if [mode.way for mode in self.modes] != [1, 0, -1]:
            raise self.refusal("rest", "drift forward, rest and drift backward, in this order")
        ahead, rest, back = self.modes
        pull = self.capsule_force
        positive = [p.symbol for p in self.parameters if p.positive]
        for one in (ahead, back):
            if self.bounds[one.way] not in positive:
                raise self.refusal(one.line, f"{self.bounds[one.way]} is no parameter above 0")
        reached = {sp.expand(ahead.friction + pull), sp.expand(back.friction + pull)}
        held = {sp.expand(-way * excess(r)) for way, r in zip((1, -1), rest.where, strict=False)}
        if held != reached or len(rest.where) != 2:
            raise self.refusal(
                rest.line,
                f"no way from {rest.name} to {ahead.name} or {back.name}: the force that moves the "
                f"capsule at rest is < {self.bounds[1]} and > {-self.bounds[-1]}, as in drift",
            )
        for one, way in ((ahead, 1), (back, -1)):
            if sp.expand(excess(one.where[0]) - way * self.state[2]) != 0:
                raise self.refusal(
                    one.line, f"no way from {one.name} to {rest.name}: a drift ends where v_c is 0"
                )
