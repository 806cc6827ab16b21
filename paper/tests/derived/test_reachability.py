"""Witnesses of local maps, against an independent integrator, and changed ones."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.symbols import v_c, x_r
from paper.derived.enclosure import RationalFlow, exceeds
from paper.derived.local_maps import LocalMap, local_maps
from paper.derived.reachability import Witness, proves, source, target, witnesses
from tests.sampling import sampled, some

SAMPLE = witnesses()[::9]


def _backwards(witness: Witness) -> np.ndarray:
    """State at the middle of the bracket, by DOP853 from the end, in another form of the model."""
    gap, damping = float(witness.delta), float(witness.zeta)
    stiffness, mass = float(witness.beta), float(witness.gamma)
    field = SEGMENTS[witness.local_map.field - 1]
    cosine, sine = map(float, witness.forcing)

    def rates(t: float, y: np.ndarray) -> list[float]:
        force = y[0] + 2 * damping * y[1] + field.contact * stiffness * (y[0] - gap)
        capsule = (force - field.drift) / mass if field.drift else 0.0
        wave = cosine * np.cos(t) - sine * np.sin(t)
        return [y[1], wave - force - capsule, capsule]

    span = (0.0, -float(sum(witness.bracket)) / 2)
    start = np.array(witness.end, dtype=float)
    return solve_ivp(rates, span, start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


@sampled
@pytest.mark.parametrize("witness", some(SAMPLE, 5), ids=lambda w: f"{w.local_map}{w.regime}")
def test_enclosure_follows_an_independent_integrator(witness: Witness) -> None:
    field = SEGMENTS[witness.local_map.field - 1]
    start = (*witness.end, *witness.forcing)
    flow = RationalFlow(field, witness.parameters, start, sense=-1, degree=40)
    short = RationalFlow(field, witness.parameters, start, sense=-1)
    middle = sum(witness.bracket) / 2
    for symbol, expected in zip((x_r, v_c), _backwards(witness)[[0, 2]], strict=True):
        value = sum(c * middle**k for k, c in enumerate(flow.series(symbol)))
        assert float(value) == pytest.approx(expected, rel=1e-9, abs=1e-9)
        truncated = sum(c * middle**k for k, c in enumerate(short.series(symbol)))
        assert abs(truncated - value) <= short.remainder(symbol, 0, middle)


@sampled
@pytest.mark.parametrize("witness", some(SAMPLE, 5), ids=lambda w: f"{w.local_map}{w.regime}")
def test_changed_witnesses_prove_nothing(witness: Witness) -> None:
    assert proves(witness)
    wrong = "Σ2" if witness.local_map.target != "Σ2" else "Σ5"
    assert not proves(replace(witness, local_map=replace(witness.local_map, target=wrong)))
    if not SEGMENTS[witness.local_map.field - 1].stick:
        late, early = witness.bracket
        assert source(replace(witness, bracket=(late / 2, early / 2))) is None
        assert source(replace(witness, bracket=(2 * late, 2 * early))) is None


def test_there_is_a_witness_for_every_local_map() -> None:
    assert {w.local_map for w in witnesses()} == set(local_maps())


def test_target_is_the_field_that_takes_over() -> None:
    free = Witness(
        LocalMap("Σ2", 1, "Σ8"),
        *map(Fraction, ("1/2", "1/20", "3/2", "3")),
        end=(Fraction(0), Fraction(-1), Fraction(0)),
        forcing=(Fraction(0), Fraction(0)),
        bracket=(Fraction(1, 10), Fraction(1, 5)),
    )
    assert target(free) == "Σ2"
    assert target(replace(free, end=(Fraction(1, 2), Fraction(2), Fraction(1)))) == "Σ7"


def test_bernstein_bound_is_sharp_enough_and_sound() -> None:
    hump = [Fraction(1, 100), Fraction(-2), Fraction(101, 100)]  # dips below zero near 1
    assert not exceeds(hump, Fraction(0), Fraction(0), Fraction(2))
    clear = [Fraction(101, 100), Fraction(-2), Fraction(1)]  # (t - 1)^2 + 1/100
    assert exceeds(clear, Fraction(0), Fraction(0), Fraction(2))
    assert not exceeds(clear, Fraction(2, 100), Fraction(0), Fraction(2))
