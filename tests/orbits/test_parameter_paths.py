"""Branches along paths of parameters: against branches in one parameter, and their derivatives."""

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._orbits.continuation.crossing import Rejoining
from capsule_sym._orbits.continuation.problem import computing
from capsule_sym._orbits.continuation.records import branch_record
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._records import dumps
from tests.orbits.branches import settled

ALPHA = PARAMETERS.index("alpha")


def test_base_excitation_meets_the_events_of_the_plain_parameter() -> None:
    start = settled(alpha=0.9 * 0.6**2, omega=0.6)
    branch = cs.continue_orbit(start, "omega", 0.72, points=3, ties={"alpha": "0.9*omega**2"})
    assert branch.status is cs.results.Status.REACHED
    for point in branch.points:
        assert point.orbit.values[ALPHA] == pytest.approx(0.9 * point.value**2, rel=1e-14)
    assert branch.bifurcations
    for one in branch.bifurcations[:1]:
        # At the event's omega, a branch in alpha alone meets it at the amplitude of the path.
        omega, amplitude = one.value, 0.9 * one.value**2
        plain = cs.continue_orbit(
            settled(alpha=amplitude - 3e-3, omega=omega), "alpha", amplitude + 3e-3, points=2
        )
        (known,) = (b for b in plain.bifurcations if (b.type, b.line) == (one.type, one.line))
        assert known.value == pytest.approx(amplitude, abs=1e-12)


def test_a_device_is_followed_in_newtons() -> None:
    device = cs.PhysicalParameters(
        M_m=1.8, M_c=5.94, k1=80.0, k2=120.0, c=1.2, G=0.02, P_d=4.0, Omega=5.3, mu=0.3
    )
    ties = cs.inputs.device_path(device, "P_d")
    base = device.dimensionless()
    branch = cs.continue_orbit(settled(**base.to_dict()), "P_d", 12.0, points=2, ties=ties)
    plain = cs.continue_orbit(
        settled(**base.to_dict()), "alpha", 12.0 / device.friction_force, points=2
    )
    assert branch.parameter == "P_d"
    assert branch.status is cs.results.Status.REACHED
    assert [one.label for one in branch.bifurcations] == [one.label for one in plain.bifurcations]
    assert branch.bifurcations
    for one, other in zip(branch.bifurcations, plain.bifurcations, strict=True):
        assert one.value == pytest.approx(other.value * device.friction_force, rel=1e-12)


def test_a_name_of_ones_own_and_a_python_function() -> None:
    def damping(s):
        return 0.04 + 0.02 * s / (1 + s)

    ties = {"alpha": lambda s: 0.5 + 0.2 * s, "zeta": damping}
    start = settled(alpha=0.5, zeta=0.04)
    branch = cs.continue_orbit(start, "s", 0.5, points=1, ties=ties)
    end = branch.points[-1].orbit
    assert end.parameters.alpha == pytest.approx(0.6)
    assert end.parameters.zeta == pytest.approx(0.04 + 0.01 / 1.5)
    other = settled(alpha=end.parameters.alpha, zeta=end.parameters.zeta)
    assert end.progression == pytest.approx(other.progression, abs=1e-11)


def test_a_path_goes_on_from_its_file(tmp_path) -> None:
    ties = {"alpha": "0.9*omega**2"}
    branch = cs.continue_orbit(
        settled(alpha=0.9 * 0.6**2, omega=0.6), "omega", 0.64, points=2, ties=ties
    )
    path = tmp_path / "branch.json"
    path.write_text(dumps(branch_record(branch)))
    (found,) = cs.continue_from(path, "EP2", 0.66, points=1)
    assert found.points[-1].orbit.values[ALPHA] == pytest.approx(0.9 * 0.66**2)


@pytest.mark.parametrize("text", ["3*s", "2 - s/4", "s**2/(1+s)", "-s**-1.5", "(s+1)**2*s", "1"])
def test_the_derivative_of_a_formula_is_exact(text: str) -> None:
    path = cs.inputs.parameter_path("s", {"gamma": text, "alpha": "s"})
    rows = np.eye(7)
    for value in (0.3, 1.7):
        step = 1e-20j  # a complex step has no difference in which digits could cancel
        slope = (path.placed([0.0] * 7, value + step)[5] / 1e-20).imag
        assert path.along(rows, value)[5] == pytest.approx(slope, rel=1e-14)


@pytest.mark.parametrize(
    ("name", "ties", "itineraries"),
    [
        ("omega", {"alpha": "omega**omega"}, r"numbers, omega, \+ - \* / \*\* and parentheses"),
        ("omega", {"alpha": "__import__('os')"}, "numbers, omega"),
        ("omega", {"alpha": "2*s"}, "numbers, omega"),
        ("omega", {"alpha": "2*"}, "numbers, omega"),
        ("omega", {"weight": "2"}, "one of alpha, delta"),
        ("omega", {"omega": "2"}, "one of alpha, delta"),
        ("s", None, "one of alpha, omega"),
        ("s", {"alpha": "s**2"}, "depends affinely"),
        ("omega", {"alpha": "0.5*omega"}, "hold for the orbit"),
        ("omega", {"alpha": "0.324 + (omega - 0.6)*(omega - 2.9)"}, "alpha = -.*>= 0"),
        ("omega", {"alpha": "0.324*(1 + 0*(1.3 - omega)**0.5)"}, "arithmetic of omega"),
    ],
)
def test_a_path_that_is_none_is_refused(name: str, ties: dict[str, str], itineraries: str) -> None:
    orbit = settled(alpha=0.324, omega=0.6)
    with pytest.raises(cs.InvalidInput, match=itineraries):
        cs.continue_orbit(orbit, name, 2.0, ties=ties)


def test_only_what_scales_a_parameter_is_followed_of_a_device() -> None:
    device = cs.PhysicalParameters(
        M_m=1.8, M_c=5.94, k1=80.0, k2=120.0, c=1.2, G=0.02, P_d=4.0, Omega=5.3, mu=0.3
    )
    for name in ("P_d", "Omega", "G", "c", "k2"):
        path = cs.inputs.parameter_path(name, cs.inputs.device_path(device, name))
        values = tuple(device.dimensionless().to_dict().values())
        assert path.value(values) == pytest.approx(getattr(device, name), rel=1e-14)
        assert path.placed(values, getattr(device, name)) == pytest.approx(values, rel=1e-14)
    with pytest.raises(cs.InvalidInput, match="one of P_d, Omega, G, c, k2"):
        cs.inputs.device_path(device, "mu")
    assert cs.Parameters(*values)


@pytest.mark.parametrize("text", ["9**9**9**9", "-" * 5000 + "1", "+".join(["1"] * 2000)])
def test_a_function_that_asks_too_much_is_refused(text: str) -> None:
    with pytest.raises(cs.InvalidInput):
        cs.inputs.parameter_path("omega", {"alpha": text}).check(cs.Parameters(), 0.8, 0.9)


def test_a_path_ends_where_its_function_does() -> None:
    """The root of a has no real values beyond the end, where a step may come out."""
    ties = {"alpha": "0.3+a", "delta": "0.05*a**0.5"}
    start = settled(alpha=0.8, delta=0.05 * 0.5**0.5)
    branch = cs.continue_orbit(start, "a", 0.001, points=5, ties=ties)
    assert all(isinstance(value, float) for value in branch.points[-1].orbit.values)
    assert branch.points[-1].value < 0.1


def test_a_branch_leaves_the_end_of_its_path() -> None:
    """Below its start the power has no real values."""
    ties = {"zeta": "0.01+(alpha-0.9)**1.5"}
    branch = cs.continue_orbit(settled(alpha=0.9, zeta=0.01), "alpha", 1.0, points=4, ties=ties)
    (found,) = cs.continue_from(branch, "EP1", 1.0, points=4)
    assert found.status is cs.results.Status.REACHED
    end, there = found.points[-1].orbit, settled(alpha=1.0, zeta=0.01 + 0.1**1.5)
    assert end.values == pytest.approx(there.values, rel=1e-14)
    assert end.progression == pytest.approx(there.progression, abs=1e-11)
    # Runs beyond find no orbit there either.
    with computing(4, 60.0, branch.axis) as problem:
        begin = branch.points[0].orbit
        assert Rejoining(problem, begin.itinerary, begin, -1.0, 1.0).junction() is None


def test_values_between_those_tried_are_refused_where_a_branch_comes_to_them() -> None:
    beta = "1e4*(omega-.8501)*(omega-.8515)"
    start = settled(alpha=0.7, omega=0.84, beta=1e4 * (0.84 - 0.8501) * (0.84 - 0.8515))
    with pytest.raises(cs.InvalidInput, match="beta"):
        cs.continue_orbit(start, "omega", 0.86, points=100, ties={"beta": beta})
