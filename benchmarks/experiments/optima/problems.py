"""Random problems of `optimise`, each by its number."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.experiments.optima.motions import Motions, Vector, settled
from capsule_sym import Parameters
from capsule_sym.inputs import SceneParameters

RANGES = {
    "alpha": (0.2, 3.0),
    "omega": (0.3, 2.5),
    "delta": (0.0, 1.0),
    "beta": (0.0, 30.0),
    "gamma": (0.5, 8.0),
    "zeta": (0.02, 0.1),
}
REST = (0.0, 0.0, 0.0)
GREATEST = (
    "velocity",
    "velocity",
    "speed",
    "progression",
    "power",
    "peak_force",
    "peak_contact",
    "speed_per_work",
    "velocity/work",
    "speed - 0.1*power",
    "speed**2/power",
    "speed/peak_force",
    "speed - 0.02*peak_contact",
    "velocity/alpha",
)
LEAST = ("velocity", "velocity", "progression", "cost_of_transport", "velocity/work")
COSTS = ("work", "power", "peak_force", "peak_contact", "cost_of_transport", "power + peak_force")
LIMITED = ("peak_force", "peak_contact", "power", "work", "cost_of_transport", "peak_force/alpha")
PROBES = 256


@dataclass(frozen=True)
class Problem:
    """One call of `optimise`; the rest of the parameters is fixed in `base`."""

    metric: str
    over: dict[str, tuple[float, float]]
    base: SceneParameters
    maximise: bool = True
    limits: tuple[tuple[str, str, float], ...] = ()
    margin: float | None = None
    starts: tuple[tuple[float, ...], ...] = (REST,)

    @property
    def texts(self) -> tuple[str, ...]:
        """The constraints as `optimise` reads them."""
        return tuple(f"{name} {relation} {value!r}" for name, relation, value in self.limits)

    @property
    def options(self) -> dict[str, Any]:
        """The options of the call, but for the seed."""
        given: dict[str, Any] = {} if self.maximise else {"maximise": False}
        given |= {"subject_to": self.texts} if self.limits else {}
        given |= {"margin": self.margin} if self.margin is not None else {}
        return given | ({"start": self.starts[0]} if self.starts != (REST,) else {})

    @property
    def call(self) -> str:
        """The problem as a Python call."""
        fixed = ", ".join(
            f"{name}={value!r}"
            for name, value in self.base.to_dict().items()
            if name not in self.over
        )
        given = "".join(f", {name}={value!r}" for name, value in self.options.items())
        return f"optimise({self.metric!r}, {self.over!r}, Parameters({fixed}){given})"

    def rows(self, u: Vector) -> Vector:
        """Rows of parameters (n, 7) at variables (n, d) that are scaled by the bounds."""
        values = self.base.to_dict()
        rows = np.tile([*values.values()], (len(u), 1))
        for k, (name, (low, high)) in enumerate(self.over.items()):
            rows[:, [*values].index(name)] = np.where(
                u[:, k] == 1, high, low + u[:, k] * (high - low)
            )
        return rows

    def motions(self, u: Vector, sure: bool = False) -> list[Motions]:
        """The motions that each of the starts leads to."""
        return self.at(self.rows(u), sure)

    def at(self, rows: Vector, sure: bool = False) -> list[Motions]:
        """The same at rows of parameters."""
        return [settled(rows, start, sure, self.base.scene) for start in self.starts]

    def judged(
        self, motions: list[Motions], margin: float | None = None
    ) -> tuple[Vector, Vector, Vector]:
        """Excess over limits, the objective to minimise, and the largest multiplier.

        They are those of the worst start; infinite if a motion has not settled.
        """
        sign = -1.0 if self.maximise else 1.0
        value = np.max([sign * valued(self.metric, one) for one in motions], axis=0)
        largest = np.max([one.multiplier for one in motions], axis=0)
        beyond = np.zeros(len(value))
        for name, relation, limit in self.limits:
            way = 1.0 if relation == "<=" else -1.0
            for one in motions:
                with np.errstate(invalid="ignore"):
                    over = way * (valued(name, one) - limit) / (abs(limit) or 1.0)
                beyond = np.maximum(beyond, np.where(np.isnan(over), np.inf, over))
        least = self.margin if margin is None else margin
        if least is not None:
            beyond = np.maximum(beyond, largest - (1 - least))
        lost = ~np.isfinite(value)
        return np.where(lost, np.inf, beyond), np.where(lost, np.inf, value), largest


def valued(text: str, motions: Motions) -> Vector:
    """Arithmetic of metrics and parameters."""
    with np.errstate(all="ignore"):
        found: Vector = eval(text, {"__builtins__": {}}, motions.metrics)
    return np.where(np.isnan(motions.multiplier), np.nan, found)


def problem(number: int) -> Problem:
    """A random problem by its number: the first 40 have 2 or 3 variables, the others 2 to 6."""
    random = np.random.default_rng([31, number])
    while True:
        drawn = _drawn(random, int(random.integers(2, 4 if number < 40 else 7)))
        u = random.uniform(size=(PROBES, len(drawn.over)))
        motions = drawn.motions(u)
        chosen = _limited(drawn, motions, random)
        beyond, value, _ = chosen.judged(motions)
        known = value[beyond == 0]
        # Without motion, or almost without feasible points, there is nothing to find.
        if len(known) >= PROBES // 50 and np.ptp(known) > 1e-6 * (1 + abs(known).max()):
            return chosen


def _drawn(random: np.random.Generator, count: int) -> Problem:
    """Variables with bounds, and a metric; constraints are added where the motions are known."""
    names = sorted(random.choice(list(RANGES), count, replace=False).tolist())
    over, base = {}, {}
    for name, (low, high) in RANGES.items():
        if name not in names:
            base[name] = round(float(random.uniform(low, high)), 4)
            continue
        width = random.uniform(0.25, 1.0) * (high - low)
        begin = random.uniform(low, high - width)
        over[name] = round(float(begin), 4), round(float(begin + width), 4)
    kind = random.choice(["greatest", "least", "cost"], p=[0.6, 0.2, 0.2])
    metric = str(random.choice({"greatest": GREATEST, "least": LEAST, "cost": COSTS}[str(kind)]))
    margin = float(random.choice([0.01, 0.05, 0.1])) if random.uniform() < 0.2 else None
    count = int(random.choice([0, 1, 2], p=[0.8, 0.15, 0.05]))
    starts = tuple(map(tuple, random.uniform(-1.0, 1.0, (count, 3)).round(3).tolist()))[:1]
    # A cost alone is least where nothing moves.
    limits = (("speed", ">=", np.inf),) if kind == "cost" else ()
    return Problem(
        metric, over, Parameters(**base), kind == "greatest", limits, margin, starts or (REST,)
    )


def _limited(drawn: Problem, motions: list[Motions], random: np.random.Generator) -> Problem:
    """A problem with limits that some of the motions keep; a third has some."""
    limits = [(name, relation) for name, relation, _ in drawn.limits]
    chance = random.uniform()
    if not limits and chance < 0.2:
        others = [name for name in LIMITED if name != drawn.metric]
        limits.append((str(random.choice(others)), "<="))
        if chance < 0.07:
            limits.append(("speed", ">="))
    found = []
    for name, relation in limits:
        values = np.max([valued(name, one) for one in motions], axis=0)
        if relation == ">=":
            values = np.min([valued(name, one) for one in motions], axis=0)
        values = values[np.isfinite(values) & (values > 0)]
        at = random.uniform(0.15, 0.7) if relation == "<=" else random.uniform(0.3, 0.9)
        value = float(f"{np.quantile(values, at):.3g}") if len(values) else np.inf
        found.append((name, relation, value))
    return replace(drawn, limits=tuple(found))
