"""Ends of runs told apart by orbits, where Newton's method leads to given places on a line."""

import numpy as np

from capsule_sym import Parameters
from capsule_sym._attractors.destinations import Cycle, KnownOrbits
from capsule_sym._attractors.neighbourhoods import NONE


class OnALine(KnownOrbits):
    """Newton's method leads to the nearest of some places, and orbits have no neighbourhood."""

    def __init__(self, places: list[float], fails: tuple[float, ...] = ()) -> None:
        super().__init__(np.array([[*Parameters().to_dict().values()]]), Parameters().scene)
        self.places, self.fails = places, fails

    def _surround(self, new) -> None:
        pass

    def closed(self, groups, states, periods):
        return [None if state[0] in self.fails else self.nearest(state[0]) for state in states]

    def nearest(self, at: float) -> Cycle:
        place = min(self.places, key=lambda place: abs(place - at))
        return Cycle(np.array([[place, 0.0, 0.0]]), 0.5)

    def identified(self, ends: list[float], periods: list[int], settled: list[bool]) -> list[int]:
        states, rows = np.array([[x, 0.0, 0.0] for x in ends]), np.zeros(len(ends), int)
        return self.identify(rows, states, np.array(periods), np.array(settled)).tolist()


def test_two_orbits_are_told_apart_however_near() -> None:
    """A threshold on distance alone would merge these; Newton's method from the ends does not."""
    line = OnALine([0.0, 1e-6])
    chance = np.random.default_rng(3)
    which = chance.integers(0, 2, 500)
    ends = which * 1e-6 + chance.uniform(-2e-7, 2e-7, 500)
    numbers = line.identified(ends.tolist(), [1] * 500, [True] * 500)
    assert [line.cycles[0][n].states[0, 0] for n in numbers] == (which * 1e-6).tolist()


def test_ends_that_close_no_orbit_or_have_not_settled_have_no_number() -> None:
    line = OnALine([0.0], fails=(0.5, 0.25))
    ends, settled = [0.5, 0.1, 0.25, 0.2, 0.0, 0.1, 0.2], [True] * 5 + [True, False]
    numbers = line.identified(ends, [1, 1, 1, 1, 1, 0, 1], settled)
    assert numbers == [NONE, 0, NONE, 0, 0, NONE, NONE]


def test_orbits_are_the_same_if_all_of_their_states_are() -> None:
    one = Cycle(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 0.5)
    turned = Cycle(one.states[::-1], 0.5)
    other = Cycle(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]), 0.5)
    assert one.same(turned)
    assert not one.same(other)
