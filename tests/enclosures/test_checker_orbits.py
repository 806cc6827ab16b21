"""Certificates of orbits and bifurcations: what they claim, and the checker that works alone."""

import json
import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from types import ModuleType

import pytest

from capsule_sym import Parameters, certify_orbit, simulate, solve_orbit
from capsule_sym._enclosures.certificates import checker
from capsule_sym._enclosures.certificates.certify import file_of, rounded
from capsule_sym._enclosures.numbers.balls import Unproved, arb, precision
from tests.enclosures.certified import (
    bifurcations,
    digits_changed,
    orbit,
    produced,
    rejected,
    unstable,
)


@pytest.fixture
def module() -> ModuleType:
    """The checker."""
    return checker


@pytest.mark.parametrize("amplitude", [1.2, 1.9])
def test_no_digit_of_an_orbit_may_change(amplitude: float) -> None:
    assert orbit(amplitude)["stable"]
    for changed in digits_changed(orbit(amplitude), 20):
        assert rejected(changed)


def test_an_orbit_is_where_the_motion_settles() -> None:
    """It begins at the switch of least phase, with the state that the map has there."""
    run = simulate(Parameters(alpha=1.2), periods=60)
    certificate = orbit(1.2)
    last = [one for one in run.segments if one.start.period == 58]
    first = min(last, key=lambda one: float(one.start.phase))
    assert [one.field for one in last] == certificate["fields"]
    assert float(certificate["angle"]) == pytest.approx(0.8 * float(first.start.phase), abs=1e-9)


def test_a_motion_without_a_switch_begins_with_the_period() -> None:
    certificate = orbit(0.003)
    assert (certificate["angle"], certificate["periods"]) == ("0", 1)
    x, v, _ = map(float, certificate["states"][0])
    # x_r'' + 2 zeta x_r' + x_r = alpha cos(omega tau)
    response = 0.003 / complex(1 - 0.8**2, 2 * 0.05 * 0.8)
    assert (x, v) == pytest.approx((response.real, (0.8j * response).real), abs=1e-15)


def test_an_orbit_is_said_to_be_unstable_if_it_is() -> None:
    assert unstable()["stable"] is False
    assert not rejected(unstable())
    assert rejected({**unstable(), "stable": True})
    assert rejected({**orbit(0.7), "stable": False})


def test_bifurcations_are_certified_with_their_segment_of_duration_0() -> None:
    for one in bifurcations():
        (still,) = one["still"]
        assert Fraction(one["durations"][still]) == 0
        assert not rejected(one)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("0.5", "0.5" + 29 * "0"),
        ("-1e-40", "0." + 30 * "0"),
        ("-2.26e-29", "-0." + 28 * "0" + "23"),
    ],
)
def test_numbers_are_rounded_to_30_decimals(value: str, text: str) -> None:
    with precision(256):
        assert rounded(arb(value)) == text


def test_a_number_between_two_roundings_is_not_written() -> None:
    with precision(256), pytest.raises(Unproved, match="not known to 30 decimals"):
        rounded(arb("0.5e-30"))


def test_a_checker_works_from_its_file_alone(module: ModuleType, tmp_path: Path) -> None:
    source = Path(str(module.__file__)).read_text()
    assert not re.search(r"^ *(import|from) capsule_sym", source, re.M)  # but in an example
    name = Path(str(module.__file__)).name
    (tmp_path / name).write_text(source)
    held = tmp_path / "certificates.json"
    held.write_text(json.dumps(file_of([orbit(0.7), orbit(0.003)])))

    def ended(*files: Path) -> tuple[int, str, str]:
        words = [sys.executable, "-I", tmp_path / name, *files]
        run = subprocess.run(words, capture_output=True, text=True)
        return run.returncode, run.stdout, run.stderr

    assert ended(held) == (0, f"{held} [0]: accepted\n{held} [1]: accepted\n", "")
    held.write_text(json.dumps(file_of([{**orbit(0.7), "stable": False}])))
    assert ended(held) == (1, f"{held} [0]: rejected (stability)\n", "")
    assert ended() == (1, "", f"usage: python {name} FILE...\n")
    held.write_text("{")
    status, out, err = ended(held, held)
    assert (status, out, len(err.splitlines())) == (2, "", 2)


def test_certificates_are_small() -> None:
    assert max(len(json.dumps(one)) for one in produced().values()) < 4000


def test_orbits_at_other_parameters_are_certified() -> None:
    found = solve_orbit(Parameters(alpha=0.9, zeta=0.0, gamma=1e-1))
    assert found.success
    assert not rejected(certify_orbit(found))
