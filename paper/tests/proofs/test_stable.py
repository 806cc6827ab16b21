"""Orbits proved with guards and stability: each condition made to fail."""

from __future__ import annotations

from typing import Any

import pytest
from flint import arb_mat

from capsule_sym import Parameters, solve_orbit
from capsule_sym._enclosures.numbers.balls import Unproved, ball
from capsule_sym._enclosures.orbits.proof import guess_of, shooting_of
from capsule_sym._enclosures.passage.guards import Signs
from paper.proofs import stable as module
from paper.proofs.case import EXACT
from tests.enclosures.case import precise

bits = precise(128)


def orbit_at(alpha: float, gamma: float = 3.3) -> Any:
    orbit = solve_orbit(Parameters(alpha=alpha, gamma=gamma))
    assert orbit.success, orbit.message
    return orbit


def test_a_condition_that_may_fail_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A multiplier 1, and a ball of them about it."""
    for wide, stable in ((0.0, False), (0.25, False), (-0.5, True)):
        entry = 1 + wide if stable else ball(1, wide)
        period = arb_mat([[entry, 0, 0], [0, 0, 0], [0, 0, 0]])
        monkeypatch.setattr(module, "monodromy", lambda found, period=period: period)
        if stable:
            assert module.prove_stable(None).trace == entry
        else:
            with pytest.raises(Unproved, match="Jury's condition 1 "):
                module.prove_stable(None)


def test_an_orbit_is_proved_with_guards_and_stability(monkeypatch: pytest.MonkeyPatch) -> None:
    orbit = orbit_at(0.7)
    shooting = shooting_of(orbit.itinerary, orbit.values, ("alpha",), EXACT)
    given = guess_of(shooting, orbit), {shooting.parameter("alpha"): 0.0}
    module.prove(shooting, *given)

    def fails(*_: object) -> None:
        raise Unproved("told", "so")

    for owner, name in ((Signs, "segment"), (module, "prove_stable")):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, fails)
            with pytest.raises(Unproved, match="told: so"):
                module.prove(shooting, *given)
