"""Scenarios of an optimisation: starts of the motion, and parameters off by their tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.quantities import System, real
from capsule_sym._errors import InvalidInput
from capsule_sym._parameters import names_of

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Scenario:
    """A start (x_r, v_r, v_c), and factors of parameters by name."""

    state: tuple[float, float, float]
    factors: Mapping[str, float]

    def system(self, system: System) -> System:
        """The system with its parameters at this end of their tolerances."""
        changed = {name: getattr(system, name) * by for name, by in self.factors.items()}
        return replace(system, **changed) if changed else system

    def weights(self, system: System) -> Vector:
        """What a derivative by a parameter of this scenario's system is by the parameter, (k,)."""
        return np.array([self.factors.get(name, 1.0) for name in names_of(system)])


def scenarios_of(
    starts: Sequence[Sequence[float]], tolerances: Mapping[str, float] | None, system: System
) -> tuple[Scenario, ...]:
    """All starts with all ends of the tolerances, and with none; raises InvalidInput."""
    if not isinstance(starts, Sequence | np.ndarray) or not len(starts):
        raise InvalidInput("starts", starts, "one state (x_r, v_r, v_c) or more")
    states = []
    for one in starts:
        state = tuple(one) if isinstance(one, Sequence | np.ndarray) else ()
        if len(state) != 3 or not all(map(real, state)):
            raise InvalidInput("starts", one, "states (x_r, v_r, v_c) of finite numbers")
        states.append((float(state[0]), float(state[1]), float(state[2])))
    tolerances = {} if tolerances is None else tolerances
    if not isinstance(tolerances, Mapping):
        raise InvalidInput("tolerances", tolerances, "a share for each of some parameters")
    for name, by in tolerances.items():
        if name not in names_of(system):
            raise InvalidInput("tolerances", name, f"of {', '.join(names_of(system))}")
        if not (real(by) and 0 < by < 1):
            raise InvalidInput(f"tolerance of {name}", by, "a share between 0 and 1")
    ends = product(*((1 - by, 1 + by) for by in tolerances.values()))
    factors: list[dict[str, float]] = [{}] if tolerances else []
    factors += [dict(zip(tolerances, one, strict=True)) for one in ends]
    return tuple(Scenario(state, one) for state in states for one in factors)
