"""Tangencies to a switching plane: values of alpha, and runs beside them."""

from __future__ import annotations

from functools import cache
from math import inf

from benchmarks.speed.model import Start
from capsule_sym import Parameters, simulate, simulate_many

EXPONENTS = range(2, 13)
"""Runs are made at alpha* (1 - 10^-k) and alpha* (1 + 10^-k) for these k."""

PERIODS = 20

_GRAZING = "grazing of the gap"
_BRACKETS = {
    "adding-sliding of the stick in contact": (0.3685, 0.369),
    "adding-sliding of the stick without contact": (0.9405, 0.941),
    "switching-sliding of the forward drift": (1.5215, 1.522),
    "grazing-sliding of the backward drift": (1.5515, 1.551),
}
"""From alpha without a short segment to alpha with it."""

_WIDTH = 1e-9  # relative, to which these are bisected
_BESIDE = [1e-8 * 4**k for k in range(6)]  # relative distances from which alpha* is extrapolated
_BLOCK = 100  # excitation periods after which to look whether a motion is steady

State = tuple[float, float, float]


@cache
def values() -> dict[str, float]:
    """Values of alpha at which the steady motion touches a plane, at the case study's parameters.

    Grazing of x_r = delta is at |1 - omega^2 + 2 i zeta omega| delta, by the amplitude of the
    linear motion in F2. At the others a segment shrinks to nothing, and alpha is a power series in
    its duration: bisected by the number of switches to 1e-9, alpha is then extrapolated to
    duration 0. That it is right to 1e-12 is seen from the itineraries of the 50-digit runs beside
    it.
    """
    p = Parameters()
    response = complex(1 - p.omega**2, 2 * p.zeta * p.omega)
    return {_GRAZING: p.delta * abs(response)} | {
        name: _vanishing(*_bisect(*bracket)) for name, bracket in _BRACKETS.items()
    }


def starts(name: str) -> list[Start]:
    """Runs beside a tangency, from the steady motion at each alpha; at grazing, the linear one."""
    parameters = [
        Parameters(alpha=values()[name] * (1 + side * 10.0**-k))
        for k in EXPONENTS
        for side in (-1, 1)
    ]
    if name == _GRAZING:
        return [Start(p, _linear(p), PERIODS) for p in parameters]
    near = _steady(parameters[0], (0.0, 0.0, 0.0))
    return [Start(p, _steady(p, near), PERIODS) for p in parameters]


def _bisect(without: float, within: float) -> tuple[float, float]:
    state = _steady(Parameters(alpha=without), (0.0, 0.0, 0.0))
    few = _switches(Parameters(alpha=without), state)
    while abs(within - without) > _WIDTH * within:
        p = Parameters(alpha=(without + within) / 2)
        state = _steady(p, state)
        if _switches(p, state) == few:
            without = p.alpha
        else:
            within = p.alpha
    return without, within


def _switches(p: Parameters, state: State) -> int:
    return len(simulate(p, state, 0.0, PERIODS).switches)


def _vanishing(without: float, within: float) -> float:
    """Alpha at which the shortest segment vanishes, by Neville's scheme."""
    side = 1 if within > without else -1
    state: State = (0.0, 0.0, 0.0)
    alphas, durations = [], []
    for distance in _BESIDE:
        p = Parameters(alpha=within * (1 + side * distance))
        state = _steady(p, state)
        segments = simulate(p, state, 0.0, 2, backend="c").segments[1:-1]
        alphas.append(p.alpha)
        durations.append(min(segment.duration for segment in segments))
    for order in range(1, len(alphas)):
        for i in range(len(alphas) - order):
            one, other = durations[i], durations[i + order]
            alphas[i] += (alphas[i + 1] - alphas[i]) * one / (one - other)
    return float(alphas[0])


def _steady(p: Parameters, state: State) -> State:
    """The state at phase 0 on which a run from this state settles, but for rounding."""
    change = inf
    while True:
        before, state = state, _after(p, state)
        last, change = change, max(abs(a - b) for a, b in zip(before, state, strict=True))
        if not 0 < change < last:
            return state


def _after(p: Parameters, state: State) -> State:
    found = simulate_many([p], state, periods=_BLOCK)
    if not found.success.all():
        raise ArithmeticError(f"a run did not finish at alpha = {p.alpha!r} from {state}")
    x_r, v_r, v_c = found.states[0].tolist()
    return x_r, v_r, v_c


def _linear(p: Parameters) -> State:
    response = p.alpha / complex(1 - p.omega**2, 2 * p.zeta * p.omega)
    return response.real, (1j * p.omega * response).real, 0.0
