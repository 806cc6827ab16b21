"""Vocabulary of a model's declaration.

A declaration is a Python file that makes one `Model`, named `model`. It declares, in this order, a
device in SI units if there is one, parameters, state, regions, forces, modes of friction and the
equations of both bodies. The shipped ones are in `_symbolic/scenes`; `capsule.py` is the paper's.
All derivations read `MODEL`: the capsule, or the one that `choose` named before they were imported,
so a process has one model.
"""

from __future__ import annotations

import math
import runpy
import sys
import traceback
from functools import cache
from pathlib import Path
from typing import Any

import sympy as sp

from capsule_sym._symbolic.model.consistency import UNITS, Declared, force, tau
from capsule_sym._symbolic.model.names import problem
from capsule_sym._symbolic.model.parts import (
    BadDeclaration,
    DeclaredUnit,
    Drive,
    Mode,
    Parameter,
    Quantity,
    SpringRange,
    excess,
    shown,
    unit_of,
)
from capsule_sym._symbolic.model.vocabulary import Part

__all__ = [
    "SHIPPED",
    "BadDeclaration",
    "Model",
    "choose",
    "chosen",
    "force",
    "home",
    "load",
    "path",
    "tau",
]

SHIPPED = ("capsule", "slope", "prototype", "reaction", "reaction_pulse")
"""Scenes that ship, by the names of their files; the first is the paper's."""
_RESERVED = ("alpha", "omega", "zeta", "gamma")
_STATE = {
    "x_r": "relative displacement",
    "v_r": "relative velocity",
    "v_c": "capsule velocity",
}
_NEEDED = {"region": "state", "interaction": "region"} | dict.fromkeys(
    ("drift", "rest", "mass"), "interaction"
)
_ONCE = ("state", "interaction", "rest", "mass", "capsule")
_LONGEST = 60  # characters of a label, which stands in one line of code


class Model(Declared):
    """A declared model; each method notes its line.

    Methods raise BadDeclaration for a line that is wrong in itself, and `check` for a declaration
    that is inconsistent. `device` and `system` take their facts from parts of `vocabulary`; later
    parts override earlier.
    """

    def __init__(self, *parts: Part) -> None:
        super().__init__()
        self._facts: dict[str, dict[str, Any]] = {}
        for part in parts:
            for name, facts in part.items():
                self._facts.setdefault(name, {}).update(facts)

    def device(self, **values: float) -> None:
        """Quantities of the parts with these values, and the units of force, rate and length.

        The value is the default of an optional quantity, and an example of any other.
        """
        for name, value in values.items():
            unit, facts = self._known(name, "measure")
            facts["default" if facts.pop("optional", False) else "example"] = value
            self.quantity(name, unit, **facts)
        for name in UNITS:
            relation, facts = self._known(name, "relation")
            self.unit(name, relation=relation, **facts)

    def system(self, **defaults: float) -> tuple[sp.Symbol, ...]:
        """Parameters of the parts with these defaults, in this order; gives their symbols.

        Without a device before them, relations to it are documentation only.
        """
        found = []
        for name, default in defaults.items():
            relation, facts = self._known(name, "si")
            facts = {"definition": shown(relation)} | facts
            si = relation if self.quantities else ""
            found.append(self.parameter(name, default, si=si, **facts))
        return tuple(found)

    def _known(self, name: str, fact: str) -> tuple[Any, dict[str, Any]]:
        """One fact of a name, and its others; raises BadDeclaration if no part has that one."""
        others = dict(self._facts.get(name, {}))
        if fact not in others:
            kind = {"measure": "quantity", "relation": "unit", "si": "parameter"}[fact]
            raise self.refusal(self._note(name), f"no part has a {kind} {name}")
        return others.pop(fact), others

    def quantity(
        self,
        name: str,
        unit: str,
        between: tuple[float, float],
        example: float = 0.0,
        *,
        default: float | None = None,
        **facts: Any,
    ) -> None:
        """A quantity of the device in SI units, with an example for the explorer, or a default.

        Quantities with a default come last. Other facts are label, about and slider, and a letter
        if that is not the name.
        """
        line = self._note(f"quantity {name}")
        value, facts = example if default is None else default, {"letter": name} | facts
        try:
            unit_of(unit)
        except ValueError as error:
            raise self.refusal(line, f"{unit}: {error}") from error
        self._check_fact(name, line, value, between, facts)
        self._check_name(name, line, "quantity")
        if name in [one.name for one in self.quantities]:
            raise self.refusal(line, f"quantity {name} is declared twice")
        if default is None and self.quantities and (last := self.quantities[-1]).optional:
            said = f"{name} has no default, and stands after {last.name}, which has one"
            raise self.refusal(line, said)
        facts |= {"name": name, "unit": unit, "value": value, "optional": default is not None}
        self.quantities.append(Quantity(*between, **facts))

    def unit(self, name: str, letter: str, relation: str, about: str) -> None:
        """Unit of force, rate or length, by its relation to quantities and earlier units."""
        line = self._note(f"unit {name}")
        if name not in UNITS or name in [one.name for one in self.units]:
            raise self.refusal(line, f"one unit of each of {', '.join(UNITS)}, not {name}")
        self._check_name(letter, line, "quantity")
        self._check_texts(line, about=about)
        taken = [one.letter for one in self.units] + [one.name for one in self.quantities]
        if letter in (*taken, "d", "Math"):  # the last two in TypeScript
            raise self.refusal(line, f"the letter {letter} is in use for something else")
        self.units.append(DeclaredUnit(name, letter, relation, about))

    def parameter(
        self,
        name: str,
        default: float,
        between: tuple[float, float] | None = None,
        *,
        si: str = "",
        **facts: Any,
    ) -> sp.Symbol:
        """A parameter, positive if its range is, of either sign if its range begins below 0.

        `si` is its relation to the device and earlier parameters. Other facts are label, about and
        slider; letter and tex if they are not the name; and definition, the text of the relation in
        documentation, without which `si` is needed. Gives the parameter's symbol.
        """
        line = self._note(f"parameter {name}")
        if between is None:
            raise self.refusal(line, f"parameter {name} has no range")
        self._check_name(name, line, "parameter")
        low, high = between
        least = {"omega": "> 0", "gamma": "> 0", "alpha": ">= 0"}.get(name)
        if least and (low < 0 or (least == "> 0" and low == 0)):
            raise self.refusal(line, f"{name} has to be {least}, and its range begins at {low:g}")
        facts = {"definition": shown(si), "letter": name, "tex": name} | facts
        self._check_fact(name, line, default, between, facts)
        if any(name.upper() == one.name.upper() for one in self.parameters):
            raise self.refusal(line, f"parameter {name} is declared twice, by letters of any case")
        sign = {"positive": True} if low > 0 else {"real" if low < 0 else "nonnegative": True}
        symbol = sp.Symbol(name, **sign)
        facts |= {"symbol": symbol, "default": default, "si": si}
        self.parameters.append(Parameter(low, high, **facts))
        return symbol

    def states(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the state: relative displacement and velocity of the mass, and v_c."""
        self._note("state")
        if missing := [n for n in _RESERVED if n not in [one.name for one in self.parameters]]:
            raise self.refusal(
                "state",
                f"no parameter {missing[0]}: amplitude, frequency, damping and mass ratio are "
                f"named {', '.join(_RESERVED)}",
            )
        self.state_labels = _STATE
        self.state = tuple(sp.Symbol(name, real=True) for name in _STATE)
        return self.state

    def harmonic(self, amplitude: sp.Symbol, frequency: sp.Symbol) -> sp.Expr:
        """Cosine drive of the parameters alpha and omega, largest at the start of a period."""
        self._take(self._note("drive"), Drive(amplitude, frequency))
        return amplitude * sp.cos(frequency * tau)

    def pulses(
        self, high: sp.Symbol, low: sp.Symbol, frequency: sp.Symbol, share: sp.Symbol
    ) -> sp.Expr:
        """A drive of two levels: the high one for a share of each period, then the low one.

        The high level is the parameter alpha, the frequency omega; the share is a parameter whose
        range lies within (0, 1). Gives a symbol of the force.
        """
        self._take(self._note("drive"), Drive(high, frequency, low, share))
        return force

    def _take(self, line: int, drive: Drive) -> None:
        if self.drive:
            raise self.refusal(line, "a second drive: a model has one")
        self.drive = drive
        self._check_drive(line)

    def region(self, name: str, *where: sp.Basic, stiffness: sp.Expr) -> None:
        """States that satisfy the inequalities, and the stiffness of a stop's spring there.

        Declare the states between the stops first, then those beyond the front and the back stop.
        """
        line = self._note("region")
        self._check_name(name, line, "mode")
        relations = tuple(map(self._inequality, where))
        self.regions.append(SpringRange(name, relations, self._expression(stiffness), line))

    def interaction(self, force: sp.Expr) -> sp.Expr:
        """Force of the mass on the capsule; `stiffness` and `stop` stand for the spring of a stop.

        With one stop, its place may be written instead of `stop`; the returned force has it.
        """
        self._note("interaction")
        self._check_stops()
        self.force = self._expression(force)
        if len(self.stops) == 1:
            self.force = self.force.subs(self.stop, self.stops[0])
        self._check_force()
        return self.force

    def rest(self, name: str, *where: sp.Basic) -> None:
        """Rest of the capsule, while the force that moves it satisfies two inequalities."""
        line = self._note("rest")
        self._check_name(name, line, "mode")
        self.modes.append(Mode(name, 0, tuple(map(self._inequality, where)), sp.S.Zero, line))

    def drift(self, name: str, where: sp.Basic, against: sp.Expr) -> None:
        """Drift of the capsule against a friction, where an inequality of its velocity holds."""
        line, relation = self._note("drift"), self._inequality(where)
        self._check_name(name, line, "mode")
        way = 1 if excess(relation).coeff(self.state[2]) == 1 else -1
        self.modes.append(Mode(name, way, (relation,), -way * self._expression(against), line))

    def mass(self, force: sp.Expr) -> None:
        """Right-hand side of v_r' + v_c': the sum of the forces on the mass."""
        self._note("mass")
        self.mass_force = self._expression(force)

    def capsule(self, inertia: sp.Symbol, force: sp.Expr, weight: sp.Expr | int = 0) -> None:
        """Mass on the left of the capsule's equation and its force on the right, without friction.

        `weight` is the part of the friction bounds that pulls the capsule itself backward on a
        slope. The work against it is lift, not a loss.
        """
        self._note("capsule")
        given = force, inertia, weight
        self.capsule_force, self.inertia, self.weight = map(self._expression, given)

    def _note(self, word: str) -> int:
        """Line of a word, which is noted; raises BadDeclaration if it is out of order."""
        frame = sys._getframe(2)
        while frame.f_back and frame.f_globals is globals():
            frame = frame.f_back
        self._file = frame.f_code.co_filename
        if word in self._lines and word in _ONCE:
            raise self.refusal(frame.f_lineno, f"a second {word}: a model has one")
        if word in ("region", "state") and "interaction" in self._lines:
            raise self.refusal(frame.f_lineno, f"the {word} is said after the interaction")
        self._line = self._lines[word] = frame.f_lineno
        needed = _NEEDED.get(word)
        if needed and needed not in self._lines:
            raise self.refusal(word, f"the {word} is said before the {needed}")
        return self._line

    def _check_name(self, name: str, line: int, kind: str) -> None:
        """Raise BadDeclaration for a name that `problem` refuses, or of two regions or modes."""
        if said := problem(name, kind):
            raise self.refusal(line, said)
        taken = [one.name for one in self.regions] + [one.name for one in self.modes]
        if kind == "mode" and name in taken:
            raise self.refusal(line, f"{name} is the name of two regions or modes")

    def _check_fact(
        self,
        name: str,
        line: int,
        value: float,
        between: tuple[float, float],
        facts: dict[str, Any],
    ) -> None:
        """Raise BadDeclaration for a value out of range, or a malformed range, slider or text."""
        slider: Any = facts.get("slider")
        for kind, given, count in (("range", between, 2), ("slider", slider, 3)):
            if not isinstance(given, list | tuple) or len(given) != count:
                raise self.refusal(line, f"the {kind} of {name} is {count} numbers, not {given!r}")
        numbers = value, *between, *slider
        if not all(isinstance(one, int | float) and math.isfinite(one) for one in numbers):
            raise self.refusal(line, f"{name} has a number that is not finite")
        if not (slider[0] < slider[1] and slider[2] > 0):
            raise self.refusal(line, f"the slider of {name} is least, largest and step > 0")
        self._check_texts(line, **{k: text for k, text in facts.items() if k != "slider"})
        if len(facts.get("label", "")) > _LONGEST:
            raise self.refusal(line, f"the label of {name} is longer than {_LONGEST} characters")
        low, high = between
        if not low <= value <= high:
            raise self.refusal(line, f"{name} = {value:.12g} is not in [{low:.12g}, {high:.12g}]")

    def _check_texts(self, line: int, **texts: Any) -> None:
        """Raise BadDeclaration for an empty text, and for what is no text of one line."""
        for kind, text in texts.items():
            if not (isinstance(text, str) and text and text.isprintable()):
                raise self.refusal(line, f"the {kind} {text!r} is no text of one line")

    def _expression(self, value: object) -> sp.Expr:
        """Value of this line as an exact expression in declared symbols and doubles."""
        found = sp.sympify(value)
        if not isinstance(found, sp.Expr):
            raise self.refusal(self._line, f"{value} is no expression")
        known = {*self.state, tau, self.stiffness, self.stop}
        known |= {one.symbol for one in self.parameters}
        known |= {force} if self.drive and self.drive.pulsed else set()
        if unknown := found.free_symbols - known:
            raise self.refusal(self._line, f"unknown symbol {min(map(str, unknown))}")
        for number in found.atoms(sp.Number):
            # Code in more digits has others as doubles, and its bounds would be too small.
            if sp.nsimplify(number, rational=True) != sp.Rational(float(number)):
                given = repr(float(number)) if number.is_Float else number
                said = f"{given} is no double of at most 15 digits: write a parameter in its place"
                raise self.refusal(self._line, said)
        return sp.nsimplify(found, rational=True) if found.has(sp.Float) else found

    def _inequality(self, value: object) -> sp.Basic:
        """Value of this line, if it is a strict inequality that is affine in the state."""
        if not isinstance(value, sp.StrictGreaterThan | sp.StrictLessThan):
            raise self.refusal(self._line, f"{value} is no strict inequality")
        self._expression(excess(value))
        if not self._affine(sp.expand(excess(value)).subs(self.drive_force, 0)):
            raise self.refusal(
                self._line,
                f"{value} is not affine in {', '.join(_STATE)} with coefficients that are "
                "polynomials of the parameters",
            )
        return value


def load(path: Path) -> Model:
    """Model declared by a file, which is run and checked; raises BadDeclaration."""
    try:
        if not path.stem.isprintable():
            raise BadDeclaration(f"{str(path)!r}:1: its name has characters that cannot be shown")
        model = runpy.run_path(str(path)).get("model")
        if not isinstance(model, Model):
            raise BadDeclaration(f"{path}:1: declares no Model named model")
        model._file = model._file or str(path)
        model.check()
    except BadDeclaration:
        raise
    except OSError as error:
        raise BadDeclaration(f"{path}:1: cannot be read ({error.strerror})") from error
    except SyntaxError as error:
        raise BadDeclaration(f"{path}:{error.lineno}: {error.msg}") from error
    except (Exception, SystemExit) as error:
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if frame.filename == str(path)]
        said = (str(error).splitlines() or [type(error).__name__])[0]
        raise BadDeclaration(f"{path}:{lines[-1] if lines else 1}: {said}") from error
    return model


def home(scene: str) -> Path:
    """File of a scene: a shipped one by its name, any other by its path."""
    return _SCENES / f"{scene}.py" if scene in SHIPPED else Path(scene)


_SCENES = Path(__file__).parents[1] / "scenes"
_choice = [home(SHIPPED[0])]


def choose(path: Path) -> None:
    """Set the declaration of this process, before `chosen` is called or a derivation imported."""
    _choice[:] = [path]


def path() -> Path:
    """File that declares the model of this process."""
    return _choice[0]


@cache
def chosen() -> Model:
    """Model of this process, loaded at the first call; raises BadDeclaration."""
    return load(_choice[0])
