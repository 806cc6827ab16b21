"""Results of the cells of one chunk. A failed cell records its reason and stops no other cell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._attractors.destinations import KnownOrbits
from capsule_sym._errors import CapsuleError, Outcome
from capsule_sym._map import simulate
from capsule_sym._map.backend import default_backend
from capsule_sym._map.simulate import run
from capsule_sym._map.steady import LONGEST
from capsule_sym._native import Watch, core_of
from capsule_sym._orbits.metrics.many import closed_many
from capsule_sym._orbits.metrics.performance import performance
from capsule_sym._orbits.shooting.search import solve_orbit
from capsule_sym._orbits.shooting.stability import floquet_multipliers, lyapunov_exponents
from capsule_sym._parameters import Scene
from capsule_sym._sweeps import itineraries
from capsule_sym._sweeps.quantities import OF_ORBIT, VARIABLES, CellOutcome, variables
from capsule_sym._sweeps.sweep import Sweep

_ROOM = 512  # bytes for the switches of two periods of a motion; longer motions are run by `slow`
_FURTHER = 1000  # largest number of excitation periods for the Lyapunov exponent of a run
_AT_ONCE = 256  # cells that `settle` closes between two looks at the watch


class Block(NamedTuple):
    """Results of a chunk: columns (n, ...) by variable, and further records.

    `itineraries` has code and number of cells of each itinerary by its text, `reasons` the reason
    of each failed cell by its index in the chunk.
    """

    columns: dict[str, NDArray[np.generic]]
    itineraries: dict[str, tuple[int, int]]
    reasons: dict[str, str]


class Abandoned(CapsuleError):
    """Raised if the results of a chunk are no longer wanted."""


def compute(part: Sweep, watch: Watch | None = None) -> Block:
    """Results of all cells of a chunk. No exception of a cell leaves this function.

    Raises Abandoned soon after the watch is over.
    """
    cells = _Cells(part, watch or Watch())
    cells.run(np.arange(part.size))
    cells.settle()
    if OF_ORBIT & set(part.compute):
        open_ = (cells.columns["outcome"] != CellOutcome.FAILED) & ~cells.closed
        for i in np.flatnonzero(open_).tolist():
            cells.guarded(i, cells.close)
    kept = {name: cells.columns[name][cells.back] for name in variables(part.compute)}
    reasons = {int(cells.order[i]): reason for i, reason in cells.reasons.items()}
    return Block(
        kept,
        cells.counted() if "itinerary" in part.compute else {},
        {str(i): reasons[i] for i in sorted(reasons)},
    )


def _shared(scene: Scene) -> list[int]:
    """Indices of the parameters that runs in the lanes of the core share."""
    stiffnesses = (stiffness for _, stiffness in scene.facts.STOPS)
    return [*map(scene.facts.PARAMETERS.index, ("gamma", *stiffnesses, "zeta", "omega"))]


class _Cells:
    """Cells of a chunk, sorted so that neighbours share parameters.

    `order` is the sorting permutation, `back` its inverse. Columns and indices are in this order.
    """

    def __init__(self, part: Sweep, watch: Watch) -> None:
        self.part, self.watch, self.periods = part, watch, part.periods
        self.scene = part.parameters.scene
        rows, states, phases = part.columns()
        self.order = np.lexsort([rows[:, i] for i in _shared(self.scene)])
        self.back = np.argsort(self.order)
        self.rows, self.states, self.phases = (one[self.order] for one in (rows, states, phases))
        self.columns: dict[str, NDArray[Any]] = {}
        for name, v in variables().items():
            shape = (part.size, v.dimension[1]) if v.dimension else (part.size,)
            blank = np.nan if v.dtype[0] in "fc" else 0
            self.columns[name] = np.full(shape, blank, v.dtype)
        self.closed = np.zeros(part.size, bool)  # True: the core has solved the orbit
        self.itineraries: dict[int, str] = {}
        self.reasons: dict[int, str] = {}

    def guarded(self, i: int, work: Callable[[int], None]) -> None:
        """Do some work on a cell; an exception lets the cell fail, and no other."""
        self.look()
        try:
            work(i)
        except Abandoned:
            raise
        except Exception as error:
            self.fail(i, f"{type(error).__name__}: {error}")

    def look(self) -> None:
        """Raise Abandoned if the watch is over."""
        if self.watch.over:
            raise Abandoned("the run was stopped")

    def fail(self, i: int, reason: str) -> None:
        self.columns["outcome"][i] = CellOutcome.FAILED
        self.reasons[i] = reason

    def run(self, chosen: NDArray[np.intp]) -> None:
        """Run some of the cells, by their indices."""
        core = core_of(self.scene)
        for i in (chosen if core is None else self.fast(core, chosen)).tolist():
            self.guarded(i, self.slow)

    def settle(self) -> None:
        """Run again the cells that have not repeated, from the stable orbit that they approach.

        Sets `periods` to the length of these runs.
        """
        outcome, number = self.columns["outcome"], self.columns["period_number"]
        every = np.flatnonzero((outcome != CellOutcome.FAILED) & (number == 0))
        self.periods = 2 * LONGEST
        for first in range(0, len(every), _AT_ONCE):
            self.look()
            # Each twice: one that shares its flows with none is run by other code of the core, and
            # its last digits would depend on the chunk.
            some = np.repeat(every[first : first + _AT_ONCE], 2)
            cycles = KnownOrbits(self.rows[some], self.scene).approached(
                self.columns["final"][some]
            )
            for i, cycle in zip(some.tolist(), cycles, strict=True):
                if cycle is not None:
                    self.states[i], self.phases[i] = cycle.states[0], 0.0
            self.run(some[[cycle is not None for cycle in cycles]])

    def fast(self, core: Any, chosen: NDArray[np.intp]) -> NDArray[np.intp]:
        """Run cells in the C core; returns the indices of those that are left to `slow`.

        It cannot decide them, or their motion has too many switches.
        """
        count, last, watch = len(chosen), min(self.periods, 2 * LONGEST), self.watch
        rows, states, phases = self.rows[chosen], self.states[chosen], self.phases[chosen]
        records, motions = np.empty(count, core.records.STATE), np.zeros(count, core.records.MOTION)
        stops, switches = np.empty(count, np.int8), np.zeros((count, _ROOM), np.uint8)
        strobe = np.empty((count, last + 1, self.states.shape[1]))
        core.start_many(rows, states, phases, records, watch)
        core.run_many(rows, records, self.periods - last, stops, watch=watch)
        ahead = stops != core.DONE
        records["period"] = 0
        core.run_many(rows, records, last, stops, strobe, watch=watch)
        stops[ahead] = core.OPEN
        tolerance = self.part.tolerance
        core.steady_many(rows, records, strobe, tolerance, stops, motions, switches, watch)
        self.look()
        columns, done, period_number = self.columns, stops == core.DONE, motions["period_number"]
        periodic, never = period_number > 0, motions["never"] != 0
        columns["period_number"][chosen] = period_number
        columns["final"][chosen] = np.stack([records[name] for name in self.scene.facts.STATE], -1)
        pace = motions["advance"][periodic] / period_number[periodic]
        columns["progression"][chosen[periodic]] = pace
        columns["outcome"][chosen] = np.where(
            never,
            CellOutcome.NEVER_SWITCHES,
            np.where(periodic, CellOutcome.CONVERGED, CellOutcome.NOT_SETTLED),
        )
        codes: dict[bytes, int] = {}
        field, passed = motions["field"].tolist(), motions["switches"].tolist()
        for i in np.flatnonzero(done & (periodic | never)).tolist():
            key = switches[i, : passed[i]].tobytes() or bytes([field[i]])
            if key not in codes:
                codes[key] = self.code([*key])
            columns["itinerary"][chosen[i]] = codes[key]
        if OF_ORBIT & set(self.part.compute):
            self.close_many(chosen[done & periodic], switches[done & periodic])
            self.look()
        return np.asarray(chosen[~done])

    def close_many(self, chosen: NDArray[np.intp], switches: NDArray[np.uint8]) -> None:
        """Requested quantities of closed orbits, for cells with a periodic motion.

        A cell without such an orbit, or whose orbit has another itinerary than its motion, is left
        to `close`.
        """
        asked, numbers = self.part.compute, self.columns["period_number"][chosen]
        motions = self.rows[chosen], self.columns["final"][chosen], numbers
        what = "energies" in asked, "forces" in asked, False
        found = closed_many(self.watch, *motions, what, scene=self.scene)
        # The run starts at the angle 0 and ends in the field in which it began.
        fields = found.fields.copy()
        fields[np.arange(len(chosen)), found.records["segments"] - 1] = 0
        same = (fields == switches[:, : fields.shape[1]]).all(axis=1)
        good = found.closed & same
        cells, found = chosen[good], found.of(good)
        self.closed[cells] = True
        self.columns["multipliers"][cells] = found.multipliers
        self.columns["lyapunov"][cells] = self.exponents(cells, found.multipliers[:, 0])
        for name in (*VARIABLES["energies"], *VARIABLES["forces"]):
            self.columns[name][cells] = found[name]

    def exponents(
        self, cells: NDArray[np.intp], largest: NDArray[np.complex128]
    ) -> NDArray[np.float64]:
        """Lyapunov exponents of cells, from their largest multipliers."""
        with np.errstate(divide="ignore"):  # the logarithm of a multiplier 0 is -inf
            grown = np.log(abs(largest))
        omega = self.rows[cells, self.scene.facts.PARAMETERS.index("omega")]
        times = self.columns["period_number"][cells] * (2 * np.pi / omega)
        return np.asarray(grown / times)

    def counted(self) -> dict[str, tuple[int, int]]:
        """Code and number of cells of each itinerary, by its text."""
        codes, counts = np.unique(self.columns["itinerary"], return_counts=True)
        cells = dict(zip(codes.tolist(), counts.tolist(), strict=True))
        texts = {text: code for code, text in self.itineraries.items() if code in cells}
        return {text: (texts[text], cells[texts[text]]) for text in sorted(texts)}

    def code(self, fields: list[int]) -> int:
        """Code of a cyclic itinerary; its text is added to `itineraries`."""
        text = itineraries.text(fields, self.scene)
        found = itineraries.code(text)
        self.itineraries[found] = text
        return found

    def slow(self, i: int) -> None:
        """Run one cell alone, with escalation to 50 digits."""
        parameters, part = self.scene.Parameters(*self.rows[i].tolist()), self.part
        state, phase = tuple(self.states[i].tolist()), float(self.phases[i])
        # The last run is long enough to detect the longest period.
        last, escalations = min(self.periods, 2 * LONGEST + 1), 0
        for periods, keep in ((self.periods - last, "final"), (last, "segments")):
            if periods:
                start = state, phase, periods
                chosen = default_backend(self.scene)
                trajectory = run(parameters, start, keep, None, self.watch, chosen)
                self.look()
                if not trajectory.success:
                    return self.fail(i, trajectory.message)
                escalations += trajectory.statistics.escalations
                _, state, phase = *trajectory.final, 0.0
        motion = trajectory.steady(part.tolerance)
        never = trajectory.segments[-1].outcome is Outcome.NEVER
        self.columns["final"][i] = state
        if motion is not None:
            self.columns["period_number"][i] = motion.period_number
            self.columns["progression"][i] = motion.progression
        if motion is not None or never:
            passed = trajectory.segments[-1:] if motion is None else motion.segments
            self.columns["itinerary"][i] = self.code([segment.field for segment in passed])
        if never:
            outcome = CellOutcome.NEVER_SWITCHES
        elif motion is None:
            outcome = CellOutcome.NOT_SETTLED
        else:
            outcome = CellOutcome.ESCALATED if escalations else CellOutcome.CONVERGED
        self.columns["outcome"][i] = outcome

    def close(self, i: int) -> None:
        """Requested quantities of the closed orbit of one cell.

        The cell fails if no orbit is found, or one of another itinerary. A cell without a periodic
        motion gets the Lyapunov exponent alone, that of a further run.
        """
        columns, part = self.columns, self.part
        parameters = self.scene.Parameters(*self.rows[i].tolist())
        state = tuple(columns["final"][i].tolist())
        if not columns["period_number"][i]:
            if "lyapunov" in part.compute:
                further = simulate(parameters, state, 0.0, min(part.periods, _FURTHER))
                columns["lyapunov"][i] = lyapunov_exponents(further)[0]
            return
        number, code = (int(columns[name][i]) for name in ("period_number", "itinerary"))
        orbit = solve_orbit(parameters, state, 0.0, 2 * number + 1)
        if not orbit.success:
            return self.fail(i, f"{orbit.status}: {orbit.message}")
        solved = orbit.itinerary.period_number
        text = itineraries.text(orbit.itinerary.fields, self.scene)
        if (solved, itineraries.code(text)) != (number, code):
            return self.fail(i, f"the orbit's itinerary is {text}, its period number {solved}")
        found = floquet_multipliers(orbit)
        columns["multipliers"][i] = found
        columns["lyapunov"][[i]] = self.exponents(np.array([i]), found[:1])
        if {"energies", "forces"} & set(part.compute):
            value = performance(orbit)
            for name in (*VARIABLES["energies"], *VARIABLES["forces"]):
                columns[name][i] = getattr(value, name).value
