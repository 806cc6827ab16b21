"""Ends of runs told apart by orbits, where Newton's method leads to given places on a line."""

import numpy as np

from capsule_sym import Parameters
from capsule_sym._attractors.neighbourhoods import NONE
from capsule_sym._attractors.settling import Cycle, Settling


class OnALine(Settling):
    """Newton's method leads to the nearest of some places, and orbits have no neighbourhood."""

    def __init__(self, places: list[float], fails: tuple[float, ...] = ()) -> None:
        super().__init__(np.array([[*Parameters().to_dict().values()]]), Parameters().scene)
        self.places, self.fails, self.asked = places, fails, 0

    def add(self, found) -> None:
        for row, cycle in found:
            self.cycles[row].append(cycle)

    def closed(self, groups, states, periods):
        self.asked += len(states)
        return [None if state[0] in self.fails else self.nearest(state[0]) for state in states]

    def nearest(self, at: float) -> Cycle:
        place = min(self.places, key=lambda place: abs(place - at))
        return Cycle(np.array([[place, 0.0, 0.0]]), 0.5)

    def numbered(self, ends: list[float], periods: list[int] | None = None) -> list[int]:
        states = np.array([[x, 0.0, 0.0] for x in ends])
        counts = np.array(periods or [1] * len(ends))
        return self.identify(np.zeros(len(ends), int), states, counts).tolist()


def test_two_orbits_are_told_apart_however_near() -> None:
    """A threshold on distance alone would merge these; Newton's method from the ends does not."""
    line = OnALine([0.0, 1e-6])
    chance = np.random.default_rng(3)
    which = chance.integers(0, 2, 500)
    numbers = line.numbered((which * 1e-6 + chance.uniform(-2e-7, 2e-7, 500)).tolist())
    assert [line.cycles[0][n].states[0, 0] for n in numbers] == (which * 1e-6).tolist()
    # Few ends need Newton's method: the others lie nearer to an orbit than one that leads there.
    assert line.asked < 10


def test_ends_that_close_no_orbit_have_no_number() -> None:
    line = OnALine([0.0], fails=(0.5, 0.25))
    assert line.numbered([0.5, 0.1, 0.25, 0.2, 0.0]) == [NONE, 0, NONE, 0, 0]


def test_ends_of_runs_that_do_not_repeat_themselves_have_no_number() -> None:
    assert OnALine([0.0]).numbered([0.0, 0.1], [1, 0]) == [0, NONE]
