"""Results of attractors: closed orbits, and the starts that lead to each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.destinations import Cycle
from capsule_sym._attractors.neighbourhoods import NONE, stroboscopic
from capsule_sym._errors import Status, counted
from capsule_sym._map.itinerary import begun
from capsule_sym._map.labelled import Labelled, package
from capsule_sym._map.result import Result, brief, record
from capsule_sym._map.steady import shown_progression
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import orbit_at, solve_orbit
from capsule_sym._parameters import SceneParameters


@dataclass(frozen=True, eq=False)
class Attractor:
    """Stable closed orbit, and how many starts lead to it; dimensionless.

    `number` is its number in a basin or a list, from 0 on. `count` is the number of starts, 0 for
    an orbit that was found near a run that did not settle on it. `fraction` is the share of all
    starts, those without an attractor included. `interval` is the 95 % confidence interval of the
    attractor's fraction of the region that the starts represent, by Clopper and Pearson. It holds
    for practically independent starts.
    """

    number: int
    orbit: Orbit
    count: int
    fraction: float
    interval: tuple[float, float]

    def __repr__(self) -> str:
        return brief(self, self.orbit.summary, f"of {self.fraction:.3g}")

    @cached_property
    def states(self) -> Vector:
        """States at phase 0, shape (period_number, 3), dimensionless."""
        return stroboscopic(self.orbit)

    @cached_property
    def itinerary(self) -> str:
        """Fields of the orbit, such as "F5 F2", from its standard first field."""
        return shown_itinerary(self.orbit)

    @property
    def period_number(self) -> int:
        """Excitation periods of one period of the orbit."""
        return self.orbit.itinerary.period_number

    @cached_property
    def progression(self) -> float:
        """Advance of x_c per excitation period, 0 without drift; dimensionless."""
        return shown_progression(self.orbit.motion)

    @property
    def multiplier(self) -> float:
        """Largest modulus of the Floquet multipliers."""
        return float(abs(self.orbit.multipliers[0]))

    def to_dict(self) -> dict[str, Any]:
        """Itinerary, multipliers, states and counts by name, as numbers, texts and lists."""
        return orbit_record(self.orbit) | record(self, "number count fraction interval states")


@dataclass(frozen=True, eq=False, repr=False)
class Attractors(Result, Labelled):
    """Attractors of one parameter set, that of the most starts first; dimensionless.

    `numbers` has for each start the number of its attractor among `attractors`, or -1 if it has not
    settled on a closed orbit within the run: chaos, an orbit of more than 16 periods, a slow
    approach, a motion that repeats but does not attract, an orbit whose equations are not solved,
    or a run that could not be decided, or was ended by a time limit or Ctrl-C. `unsettled` is the
    number of these.
    """

    parameters: SceneParameters
    attractors: tuple[Attractor, ...]
    states: Vector
    """Start states (x_r, v_r, v_c), shape (n, 3)."""
    phases: Vector
    """Phases of the starts (times in the excitation period), shape (n,)."""
    numbers: NDArray[np.int16]
    """Attractor number of each start, shape (n,)."""
    periods: int
    """Excitation periods after which a run counts as unsettled."""
    status: Status
    _recorded = "parameters starts unsettled periods attractors"

    @property
    def starts(self) -> int:
        """Number of starts."""
        return len(self.numbers)

    @property
    def unsettled(self) -> int:
        """Number of starts that did not settle."""
        return int((self.numbers == NONE).sum())

    @property
    def message(self) -> str:
        """Numbers of starts, attractors and, if not 0, of unsettled starts, as a sentence."""
        found = sum(one.count > 0 for one in self.attractors)
        lead = "leads" if self.starts == 1 else "lead"
        text = f"{counted(self.starts, 'start')} {lead} to {counted(found, 'attractor')}"
        late = f"{counted(self.unsettled, 'has', 'have')} not settled"
        if self.status is not Status.FINISHED:
            return f"{text}; time limit reached, or interrupted: {late}"
        periods = counted(self.periods, "excitation period")
        return f"{text}; {late} within {periods}" if self.unsettled else text

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns, shape (k,), with a row for each attractor."""
        names = "itinerary", "period_number", "progression", "multiplier", "count", "fraction"
        found = {name: np.array([getattr(one, name) for one in self.attractors]) for name in names}
        ends = np.reshape([one.interval for one in self.attractors], (-1, 2))
        found |= {"fraction_low": ends[:, 0], "fraction_high": ends[:, 1]}
        return found | {"largest_multiplier": found.pop("multiplier")}


def closed_orbit(parameters: SceneParameters, cycle: Cycle) -> Orbit | None:
    """Orbit of a cycle, solved in its itinerary, or on which a short run from it settles; or None.

    Raises TimeUp if the present watch is over.
    """
    state, number = cycle.states[0].tolist(), len(cycle.states)
    found = orbit_at(parameters, state, number)
    settled = found or solve_orbit(parameters, state, 0.0, 2 * number + 1)
    return settled if settled.success else None


def collected(
    numbers: NDArray[Any], orbits: Sequence[Orbit | None]
) -> tuple[tuple[Attractor, ...], NDArray[np.int16]]:
    """Attractors, that of the most starts first, and the number of each start in this order.

    `numbers` has for each start the index of its orbit, or NONE. Orbits that are None are left out;
    their starts have the number NONE. Orbits that no start leads to are included, with count 0.
    """
    counts = np.bincount(numbers[numbers >= 0], minlength=len(orbits))
    order = [i for i in np.argsort(-counts, kind="stable").tolist() if orbits[i] is not None]
    rank, total = np.full(len(orbits) + 1, NONE), numbers.size  # NONE counts from the end
    rank[order] = np.arange(len(order))
    chosen = [orbit for i in order if (orbit := orbits[i]) is not None]
    found = tuple(
        Attractor(number, orbit, count, count / total, interval(count, total))
        for number, (orbit, count) in enumerate(zip(chosen, counts[order].tolist(), strict=True))
    )
    return found, rank[numbers].astype(np.int16)


def interval(count: int, total: int) -> tuple[float, float]:
    """95 % Clopper-Pearson interval of a fraction, from the count of its starts."""
    low, high = package("scipy.stats").binomtest(count, total).proportion_ci()
    return float(low), float(high)


def orbit_record(orbit: Orbit) -> dict[str, Any]:
    """Itinerary, period number, progression and multipliers of an orbit as plain values."""
    return {
        "itinerary": shown_itinerary(orbit),
        "period_number": orbit.itinerary.period_number,
        "progression": shown_progression(orbit.motion),
        **record(orbit, "multipliers"),
    }


def shown_itinerary(orbit: Orbit) -> str:
    """Fields of an orbit, such as "F5 F2", from its standard first field."""
    return " ".join(f"F{field}" for field in begun(orbit.itinerary.fields, orbit.scene))
