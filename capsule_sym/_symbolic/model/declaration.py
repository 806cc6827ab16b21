"""The words in which a model is declared, and the checks of what they say.

A declaration is a Python file that makes one `Model`, named `model`, and tells it parameters,
state, regions, forces, modes of friction and the equations of both bodies, in this order.
`capsule.py` is the paper's. All derivations read `MODEL`: the capsule, or what `choose` named
before they were imported, so that one process knows one model.
"""

from __future__ import annotations

import keyword
import math
import re
import runpy
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import sympy as sp
from sympy.polys.polyerrors import BasePolynomialError

tau = sp.Symbol("tau", real=True)
"""Time."""

DEFAULT = Path(__file__).with_name("capsule.py")
_RESERVED = ("alpha", "omega", "delta", "gamma")
_STATE = ("x_r", "v_r", "v_c")
_NEEDED = {"region": "state", "interaction": "state"} | dict.fromkeys(
    ("drift", "rest", "mass"), "interaction"
)
_KEYWORDS_TEXT = """
    auto break case catch char classdef const continue default do double else elseif end enum
    extern float for function global goto if inline int long otherwise parfor persistent
    register restrict return short signed sizeof spmd static struct switch try typedef union
    unsigned void volatile while
"""
_KEYWORDS = frozenset(_KEYWORDS_TEXT.split()) | {*keyword.kwlist}
_NAMES_TEXT = """
    Any B B2 B2d BI BW BWd Bd Bdd Constants G G2 G2d Gd H H1 H2 JACOBIAN_COLUMNS K M_c M_m NULL
    Omega P_d Z2 abs advance before bound bound_of c cap capsule_advance centre constants contact
    cos cos_theta cosine deal detached detuning drift drift_change drift_long drift_short drive
    drive_rate exp expm1 fabs fast field flat flow fmax force force_change force_gain2
    force_per_energy forced forced_doubled forced_slopes_apart forced_slopes_doubled forcing_next
    forcing_terms free_doubled free_slopes_apart free_slopes_doubled friction friction_at
    friction_bounds friction_guard g gain gap guard h i index jacobian jacobian_drift
    jacobian_stick jet jet_magnitudes k1 k2 kappa lag lag2 last len level list load_force m mad
    margin margin_at max mp mu mul n name neg next np nu num oscillating over overdamped p params
    period periods phase pi position position_at pow pull push push_at q range rate reach real
    relative_flow replace response_next rest_centre rest_force resonant root_K second segment
    segment_sizes sigma sign sin sin_theta sine sine2 size_of slow spring sqrt start state sub
    tau term theta to_dict total turning_velocity u u1 v_c v_c_rate v_change v_r v_rate v_second
    v_x values velocity velocity_at versine versine2 w way width x_c x_change x_r
"""
_NAMES = frozenset(_NAMES_TEXT.split())
"""What generated code and derivations name otherwise."""
_NUMBERED = re.compile(r"(t|x|p|P_|drive|abs_[xp])\d*|(abs|by|d\d)_\w+|\w+_(gradient|size)")


class BadDeclaration(Exception):
    """A declaration that says what cannot be derived from; its text begins with file and line."""


@dataclass(frozen=True)
class Parameter:
    """A dimensionless parameter, with all that is told of it anywhere."""

    symbol: sp.Symbol
    default: float
    low: float
    high: float
    label: str
    """A few words, as on an axis."""
    definition: str
    """Its scaling, as in the documentation of `Parameters`."""
    about: str
    """A sentence for who sees it for the first time."""
    letter: str
    tex: str
    slider: tuple[float, float, float]
    """Ends and step of the explorer's slider."""
    device: tuple[str, str] | None
    """What of a device it alone is in proportion to, and that one's unit."""

    @property
    def name(self) -> str:
        """The name in code."""
        return str(self.symbol)

    @property
    def positive(self) -> bool:
        """Whether 0 is not allowed."""
        return self.low > 0

    @property
    def signed(self) -> bool:
        """Whether values below 0 are allowed."""
        return self.low < 0


@dataclass(frozen=True)
class Region:
    """The states on one side of the stop, and the second spring's stiffness there."""

    name: str
    where: tuple[sp.Basic, ...]
    stiffness: sp.Expr
    line: int


@dataclass(frozen=True)
class Mode:
    """Drift of a way (1, -1) against a friction, or rest (0) within bounds of the force."""

    name: str
    way: int
    where: tuple[sp.Basic, ...]
    friction: sp.Expr
    line: int


def excess(relation: sp.Basic) -> sp.Expr:
    """The function that is positive where a strict inequality holds."""
    return relation.gts - relation.lts


class Model:
    """A model as it is declared; each word notes its line, and `check` refuses what is wrong."""

    def __init__(self) -> None:
        self.parameters: list[Parameter] = []
        self.state: tuple[sp.Symbol, ...] = ()
        self.state_labels: dict[str, str] = {}
        self.regions: list[Region] = []
        self.modes: list[Mode] = []
        self.stiffness = sp.Symbol("kappa", nonnegative=True)
        self._lines: dict[str, int] = {}

    def parameter(
        self,
        name: str,
        default: float,
        between: tuple[float, float] | None = None,
        *,
        label: str,
        definition: str,
        about: str,
        letter: str = "",
        tex: str = "",
        slider: tuple[float, float, float],
        device: tuple[str, str] | None = None,
    ) -> sp.Symbol:
        """A parameter, positive if its range is, of either sign if its range begins below 0."""
        self._note(f"parameter {name}")
        if between is None:
            raise self._bad(f"parameter {name}", f"parameter {name} has no range")
        self._check_name(name, f"parameter {name}")
        low, high = between
        if not all(map(math.isfinite, (default, *between, *slider))):
            raise self._bad(f"parameter {name}", f"{name} has a number that is not finite")
        least = {"omega": "> 0", "gamma": "> 0", "alpha": ">= 0", "delta": ">= 0"}.get(name)
        if least and (low < 0 or (least == "> 0" and low == 0)):
            raise self._bad(
                f"parameter {name}", f"{name} has to be {least}, and its range begins at {low:g}"
            )
        if not all(isinstance(one, str) and one for one in (label, definition, about)):
            raise self._bad(f"parameter {name}", f"label, definition or meaning of {name} is empty")
        if not low <= default <= high:
            raise self._bad(
                f"parameter {name}", f"{name} = {default:g} is not in [{low:g}, {high:g}]"
            )
        if any(name.upper() == one.name.upper() for one in self.parameters):
            raise self._bad(
                f"parameter {name}", f"parameter {name} is declared twice, by letters of any case"
            )
        sign = {"positive": True} if low > 0 else {"real" if low < 0 else "nonnegative": True}
        symbol = sp.Symbol(name, **sign)
        told = (label, definition, about, letter or name, tex or name, slider, device)
        self.parameters.append(Parameter(symbol, default, low, high, *told))
        return symbol

    def states(self, **labels: str) -> tuple[sp.Symbol, ...]:
        """The state: relative displacement and velocity of the mass, and the capsule's velocity."""
        self._note("state")
        if missing := [n for n in _RESERVED if n not in [one.name for one in self.parameters]]:
            raise self._bad(
                "state",
                f"no parameter {missing[0]}: amplitude, frequency, gap and mass ratio"
                f" are named {', '.join(_RESERVED)}",
            )
        if tuple(labels) != _STATE:
            raise self._bad("state", f"the state is {', '.join(_STATE)}, not {', '.join(labels)}")
        self.state_labels = labels
        self.state = tuple(sp.Symbol(name, real=True) for name in labels)
        return self.state

    def region(self, name: str, where: sp.Basic, stiffness: sp.Expr) -> None:
        """The states where an inequality holds, and the second spring's stiffness there."""
        line = self._note("region")
        self._check_name(name, line)
        relations = (self._inequality(where),)
        self.regions.append(Region(name, relations, self._expression(stiffness), line))

    def interaction(self, force: sp.Expr) -> sp.Expr:
        """The force of the mass on the capsule, with `stiffness` for the second spring's."""
        self._note("interaction")
        self.force = self._expression(force)
        self._check_force()
        return self.force

    def rest(self, name: str, *where: sp.Basic) -> None:
        """Rest of the capsule, while the force obeys two inequalities."""
        line = self._note("rest")
        self._check_name(name, line)
        self.modes.append(Mode(name, 0, tuple(map(self._inequality, where)), -self.force, line))

    def drift(self, name: str, where: sp.Basic, against: sp.Expr) -> None:
        """Drift of the capsule against a friction, where an inequality for its velocity holds."""
        line, relation = self._note("drift"), self._inequality(where)
        self._check_name(name, line)
        way = 1 if excess(relation).coeff(self.state[2]) == 1 else -1
        self.modes.append(Mode(name, way, (relation,), -way * self._expression(against), line))

    def mass(self, force: sp.Expr) -> None:
        """The right side of v_r' + v_c', all forces on the mass."""
        self._note("mass")
        self.mass_force = self._expression(force)

    def capsule(self, inertia: sp.Symbol, force: sp.Expr) -> None:
        """The left side's mass and the right side of gamma v_c', but for friction."""
        self._note("capsule")
        self.capsule_force, self.inertia = map(self._expression, (force, inertia))

    def _note(self, word: str) -> int:
        """The line of a word, after the word that it needs."""
        frame = sys._getframe(2)
        self._file = frame.f_code.co_filename
        self._line = self._lines[word] = frame.f_lineno
        needed = _NEEDED.get(word)
        if needed and needed not in self._lines:
            raise self._bad(word, f"the {word} is said before the {needed}")
        return self._line

    def _check_name(self, name: str, word: str | int) -> None:
        """Raises BadDeclaration unless C, Python and MATLAB can have the name."""
        if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) or name in _KEYWORDS:
            raise self._bad(word, f"{name!r} is no name in C, Python and MATLAB")
        if isinstance(word, str) and (name in _NAMES or _NUMBERED.fullmatch(name)):
            raise self._bad(word, f"the name {name} is in use for something else")

    def _expression(self, value: object) -> sp.Expr:
        """A value of this line as an exact expression in what is declared."""
        found = sp.sympify(value)
        if not isinstance(found, sp.Expr):
            raise self._bad(self._line, f"{value} is no expression")
        known = {*(one.symbol for one in self.parameters), *self.state, tau, self.stiffness}
        if unknown := found.free_symbols - known:
            raise self._bad(self._line, f"unknown symbol {min(map(str, unknown))}")
        return sp.nsimplify(found, rational=True) if found.has(sp.Float) else found

    def _inequality(self, value: object) -> sp.Basic:
        """A value of this line as a strict inequality between affine functions of the state."""
        if not isinstance(value, sp.StrictGreaterThan | sp.StrictLessThan):
            raise self._bad(self._line, f"{value} is no strict inequality")
        self._expression(excess(value))
        if not self._affine(excess(value)):
            raise self._bad(
                self._line,
                f"{value} is not affine in {', '.join(_STATE)} with coefficients that are "
                "polynomials of the parameters",
            )
        return value

    def _bad(self, word: str | int, said: str) -> BadDeclaration:
        line = word if isinstance(word, int) else self._lines.get(word, 1)
        return BadDeclaration(f"{self._file}:{line}: {said}")

    def symbol(self, name: str) -> sp.Symbol:
        """A parameter's symbol; raises KeyError if none has this name."""
        return {one.name: one.symbol for one in self.parameters}[name]

    @property
    def bounds(self) -> Mapping[int, sp.Expr]:
        """The friction that a drift of a way works against, which bounds the force at rest."""
        return {mode.way: -mode.way * mode.friction for mode in self.modes if mode.way}

    @property
    def load(self) -> sp.Expr:
        """The constant force on the mass beside drive and interaction."""
        drive = self.symbol("alpha") * sp.cos(self.symbol("omega") * tau)
        return sp.expand(self.mass_force - drive + self.force)

    def check(self) -> None:
        """Raises BadDeclaration, with the line at fault."""
        for word in ("state", "interaction", "region", "rest", "drift", "mass", "capsule"):
            if word not in self._lines:
                raise self._bad(1, f"nothing is said of the {word}")
        self._check_equations()
        self._check_ways()

    def _check_equations(self) -> None:
        held = {*self.state, tau, self.stiffness}
        if self.load.free_symbols & held or not self._affine(self.load):
            raise self._bad(
                "mass",
                "the forces on the mass are alpha*cos(omega*tau), less the "
                "interaction force, and a constant",
            )
        if sp.expand(self.capsule_force - self.force) != 0:
            raise self._bad("capsule", "the capsule is moved by the interaction force and friction")
        if self.inertia != self.symbol("gamma"):
            raise self._bad("capsule", f"the mass ratio is gamma, not {self.inertia}")

    def _check_force(self) -> None:
        x_r, v_r, v_c = self.state
        spring = self.stiffness * (x_r - self.symbol("delta"))
        rest = sp.expand(self.force - spring)
        if (
            not self._affine(self.force)
            or rest.subs({x_r: 0, v_r: 0}) != 0
            or {v_c, self.stiffness} & rest.free_symbols
            or not rest.coeff(x_r).is_positive
            or not rest.coeff(v_r).is_nonnegative
        ):
            raise self._bad(
                "interaction",
                "the interaction force is linear in x_r and v_r, with coefficients > 0 and >= 0 "
                f"that are polynomials of the parameters, and with {self.stiffness}*(x_r - delta) "
                "for the second spring",
            )

    def _affine(self, function: sp.Expr) -> bool:
        """Whether it is affine in the state, and a polynomial of the parameters."""
        names = (*self.state, self.stiffness, *(one.symbol for one in self.parameters))
        try:
            powers = sp.Poly(sp.expand(function), *names, domain=sp.QQ).monoms()
        except BasePolynomialError:
            return False
        return all(sum(power[: len(self.state)]) <= 1 for power in powers)

    def _check_ways(self) -> None:
        """Each guard that vanishes leads on: across it another region or mode begins."""
        if [len(self.regions), *(mode.way for mode in self.modes)] != [2, 1, 0, -1]:
            raise self._bad("rest", "two regions, and drift forward, rest and drift backward")
        first, second = self.regions
        gap = self.state[0] - self.symbol("delta")
        if first.stiffness != 0 or sp.expand(excess(first.where[0]) + gap) != 0:
            raise self._bad(
                first.line, "the first region is x_r < delta, where the second spring is free: 0"
            )
        held_by = second.stiffness.free_symbols - {one.symbol for one in self.parameters}
        if held_by or not (self._affine(second.stiffness) and second.stiffness.is_nonnegative):
            raise self._bad(
                second.line, f"the stiffness {second.stiffness} is no polynomial >= 0 of parameters"
            )
        if sp.expand(excess(first.where[0]) + excess(second.where[0])) != 0:
            raise self._bad(
                second.line,
                f"no way from {first.name} to {second.name}: beside {first.where[0]} lies nothing",
            )
        ahead, rest, back = self.modes
        reached = {sp.expand(ahead.friction + self.force), sp.expand(back.friction + self.force)}
        held = {sp.expand(-way * excess(r)) for way, r in zip((1, -1), rest.where, strict=False)}
        if held != reached or len(rest.where) != 2:
            raise self._bad(
                rest.line,
                f"no way from {rest.name} to {ahead.name} or {back.name}: rest "
                "ends where the force meets the friction of a drift",
            )
        for one, way in ((ahead, 1), (back, -1)):
            if self.bounds[way] not in [p.symbol for p in self.parameters if p.positive]:
                raise self._bad(one.line, f"{self.bounds[way]} is no parameter above 0")
            if sp.expand(excess(one.where[0]) - way * self.state[2]) != 0:
                raise self._bad(
                    one.line, f"no way from {one.name} to {rest.name}: a drift ends where v_c is 0"
                )


def load(path: Path) -> Model:
    """The model that a file declares; raises BadDeclaration."""
    try:
        model = runpy.run_path(str(path)).get("model")
        if not isinstance(model, Model):
            raise BadDeclaration(f"{path}:1: declares no Model named model")
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


_choice = [DEFAULT]


def choose(path: Path) -> None:
    """Name the declaration of this process, before any derivation is imported."""
    _choice[:] = [path]


def path() -> Path:
    """The file that declares the model of this process."""
    return _choice[0]


@cache
def chosen() -> Model:
    """The model of this process; raises BadDeclaration."""
    return load(_choice[0])
