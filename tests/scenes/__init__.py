"""Scenes for the judge: their terms, and an integrator of the equations of motion alone.

Nothing here imports the package. `integrator.c` has the equations and what it prints.
"""

import json
import math
import random
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).parent
GENERAL = (
    *("alpha", "omega", "zeta", "gamma", "delta_1", "beta_1", "delta_2", "beta_2"),
    *("s", "f_plus", "f_minus", "alpha_low", "D"),
)
"""Parameters of the general form, in the integrator's order."""

UNIT = 2.0**-53


@dataclass(frozen=True)
class Form:
    """Terms that a scene has: number of stops, pulses, reaction (eps = 1), bias, two bounds."""

    stops: int = 1
    pulsed: bool = False
    reacts: bool = False
    biased: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters of the scene by name."""
        stops = ("delta", "beta") if self.stops == 1 else ("delta_1", "beta_1", "delta_2", "beta_2")
        friction = ("s", "f_plus", "f_minus") if self.biased else ("f_b",)
        pulses = ("alpha_low", "D") if self.pulsed else ()
        return ("alpha", "omega", "zeta", "gamma", *stops, *friction, *pulses)

    def general(self, parameters: Mapping[str, float]) -> list[float]:
        """The scene's parameters by name as those of the general form."""
        assert set(parameters) == set(self.names), set(parameters) ^ set(self.names)
        given = {"delta_2": 0.0, "beta_2": 0.0, "s": 0.0, "alpha_low": 0.0, "D": 1.0, **parameters}
        for one, two in (("delta_1", "delta"), ("beta_1", "beta")):
            given[one] = given.get(one, given.get(two, 0.0))
        for bound in ("f_plus", "f_minus"):
            given[bound] = given.get(bound, given.get("f_b", 0.0))
        return [float(given[name]) for name in GENERAL]


SCENES = {
    "capsule": Form(),
    "slope": Form(biased=True),
    "prototype": Form(stops=2, pulsed=True, biased=True),
    "reaction": Form(reacts=True),
    "reaction_pulse": Form(reacts=True, pulsed=True),
}


class Start(NamedTuple):
    """Parameters by name, the state (x_r, v_r, v_c) and the time in the period at a run's start."""

    parameters: dict[str, float]
    state: tuple[float, float, float]
    phase: float = 0.0


class Passed(NamedTuple):
    """A segment: field, event at its end, duration, rate and largest term of its guard there.

    Events are `F` and `B`, a gap at the front or back stop, `V`, a velocity that vanishes, `U` and
    `L`, the bounds forward and backward, `R` and `D`, the drive's rise and fall, and `E`, the run's
    end. `alone` is the time to the next event that would have come.
    """

    field: int
    event: str
    duration: Fraction
    rate: float
    size: float
    alone: float


class Run(NamedTuple):
    """A run by the integrator; `unit` has the size of rounding errors of the final state."""

    status: str
    state: tuple[Fraction, ...]
    segments: tuple[Passed, ...]
    following: int
    energy: float
    unit: tuple[float, ...]

    @property
    def fields(self) -> tuple[int, ...]:
        """Numbers of the fields passed."""
        return tuple(segment.field for segment in self.segments)

    def off(self, state: Sequence[float]) -> float:
        """Error of a final state (x_r, v_r, v_c), in units of the run's rounding errors."""
        apart = (abs(Fraction(a) - b) for a, b in zip(state, self.state, strict=False))
        return max(float(a) / (UNIT * u) for a, u in zip(apart, self.unit, strict=False))


class Integrator(NamedTuple):
    """The compiled integrator."""

    program: Path

    def runs(
        self,
        form: Form,
        starts: Iterable[Start],
        periods: float = 4,
        most: int = 10**6,
        checked: bool = True,
    ) -> list[Run]:
        """A run from each start, over so many periods or segments."""
        rows = ([*form.general(s.parameters), *s.state, s.phase] for s in starts)
        text = "".join(" ".join(map(repr, map(float, row))) + "\n" for row in rows)
        numbers = (form.stops, int(form.pulsed), int(form.reacts), periods, most, int(checked))
        command = [str(self.program), *map(str, numbers)]
        done = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
        return [_run(json.loads(line)) for line in done.stdout.splitlines()]


def integrator(folder: Path, *flags: str) -> Integrator:
    """The integrator, compiled in a folder."""
    made = folder / "integrator"
    command = ["cc", "-O2", "-std=gnu11", "-Wall", "-Wextra", "-Werror", *flags]
    subprocess.run([*command, HERE / "integrator.c", "-lm", "-o", made], check=True)
    return Integrator(made)


def _sum(pair: Sequence[float]) -> Fraction:
    return Fraction(pair[0]) + Fraction(pair[1])


def _run(line: dict) -> Run:
    segments = (
        Passed(field, event, _sum(duration), rate, size, alone)
        for field, event, duration, rate, size, alone in line["segments"]
    )
    return Run(
        line["status"],
        tuple(map(_sum, line["state"])),
        tuple(segments),
        line["next"],
        line.get("energy", math.nan),
        tuple(line.get("unit", ())),
    )


def random_starts(form: Form, count: int, seed: int = 30) -> list[Start]:
    """Random parameters, states and phases."""
    r = random.Random(f"{seed} {form}")
    return [random_start(form, r) for _ in range(count)]


FLOW = ("omega", "zeta", "gamma", "beta", "beta_1", "beta_2")
"""Parameters of the linear flows, which runs share that go side by side."""


def grouped(starts: Sequence[Start], many: int) -> list[Start]:
    """The same starts, so many after the other with the linear flows of the first of these."""
    found = []
    for i, start in enumerate(starts):
        first = starts[i - i % many].parameters
        shared = {name: first[name] for name in FLOW if name in first}
        phase = 0.999 * start.phase * start.parameters["omega"] / shared["omega"]
        found.append(Start({**start.parameters, **shared}, start.state, phase))
    return found


def typical_starts(form: Form, count: int) -> list[Start]:
    """Runs of one parameter set from random states, to be timed."""
    typical = {
        **{"alpha": 1.5, "omega": 0.8, "zeta": 0.05, "gamma": 3.3, "f_b": 1.0, "s": 0.05},
        **{"f_plus": 1.1, "f_minus": 0.9, "alpha_low": -0.3, "D": 0.4, "delta": 0.1, "beta": 1.5},
        **{"delta_1": 0.1, "beta_1": 1.5, "delta_2": 0.6, "beta_2": 2.5},
    }
    parameters = {name: typical[name] for name in form.names}
    r = random.Random(7)
    return [
        Start(parameters, (r.uniform(-1, 1), r.uniform(-1, 1), r.uniform(-1, 1)))
        for _ in range(count)
    ]


def random_start(form: Form, r: random.Random) -> Start:
    """One random start; every ninth or so has an extreme parameter."""
    bounds = {
        "s": r.uniform(-0.3, 0.3),
        "f_plus": r.uniform(0.3, 1.5),
        "f_minus": r.uniform(0.3, 1.5),
    }
    drawn = {
        "alpha": r.uniform(0.1, 2.5),
        "omega": r.uniform(0.3, 2.0),
        "zeta": r.choice([0.0, 0.02, 0.05, 0.4, 1.0]),
        "gamma": r.uniform(0.3, 5.0),
        "f_b": r.choice([1.0, r.uniform(0.3, 1.5)]),
        "alpha_low": r.choice([0.0, r.uniform(-2, 1)]),
        "D": r.choice([0.5, 0.8, r.uniform(0.02, 0.98)]),
        **bounds,
    }
    for gap in ("delta", "delta_1", "delta_2"):
        drawn[gap] = r.choice([0.02, r.uniform(0, 1.5)])
    for stiffness in ("beta", "beta_1", "beta_2"):
        drawn[stiffness] = r.choice([1.5, r.uniform(0, 20), 900.0])
    state = r.uniform(-1, 1), r.uniform(-1, 1), r.choice([0.0, r.uniform(-1, 1)])
    parameters = {name: drawn[name] for name in form.names}
    phase = r.choice([0.0, r.random()]) * 2 * math.pi / drawn["omega"]
    return Start(parameters, state, phase)
