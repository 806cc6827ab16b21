"""A run certified switch by switch: accepted as it is, and not if anything is changed."""

import json
from collections.abc import Iterator
from fractions import Fraction
from itertools import count
from pathlib import Path
from time import perf_counter

import pytest
from click.testing import CliRunner

import capsule_sym as cs
from capsule_sym._cli import group
from capsule_sym._enclosures.numbers.balls import Unproved
from capsule_sym._native import watch
from tests.enclosures.certified import digits_changed, rejected


@pytest.fixture(scope="module")
def run_certificate() -> dict:
    return cs.certify_run(cs.simulate(cs.Parameters(alpha=1.2), (0.01, 0.0, 1e-5), 0.3, periods=2))


def test_run_certificate_is_accepted_and_no_digit_may_change(run_certificate: dict) -> None:
    assert run_certificate["kind"] == "run"
    assert len(run_certificate["fields"]) > 10
    assert not rejected(run_certificate)
    for changed in digits_changed(run_certificate, 8):
        assert rejected(changed)


def test_run_certificate_ends_where_50_digits_do(run_certificate: dict) -> None:
    start = (0.01, 0.0, 1e-5)
    exact = cs.simulate(cs.Parameters(alpha=1.2), start, 0.3, periods=2, backend="mpmath")
    for told, value in zip(run_certificate["end"], exact.final[1], strict=True):
        assert abs(Fraction(told) - Fraction(str(value))) < Fraction(1, 10**12)
    assert [one.field for one in exact.segments] == run_certificate["fields"]


def test_checker_rejects_runs_that_are_none(run_certificate: dict) -> None:
    fields = run_certificate["fields"]
    assert rejected({**run_certificate, "stable": True})
    assert rejected({**run_certificate, "still": [0], "free": {"alpha": "1.2"}})
    assert rejected({**run_certificate, "periods": 1})
    assert rejected({k: v for k, v in run_certificate.items() if k != "end"})
    other = 5 if fields[-1] == 2 else 2
    assert rejected({**run_certificate, "fields": [*fields[:-1], other]})


def test_a_run_is_certified_from_the_decimals_that_its_doubles_print_as() -> None:
    certificate = cs.certify_run(
        cs.simulate(cs.Parameters(alpha=1e-5), (0.0, 0.0, 0.0), 0.7, periods=1)
    )
    assert certificate["parameters"]["alpha"] == "0.00001"
    assert certificate["angle"] == "0.56"
    assert certificate["fields"] == [2]
    assert not rejected(certificate)
    # In stick the capsule is at rest, also at the start.
    assert rejected({**certificate, "states": [["0", "0", "0.5"]]})


def test_a_motion_at_rest_is_certified_however_long() -> None:
    certificate = cs.certify_run(cs.simulate(cs.Parameters(alpha=0.0), periods=20))
    assert certificate["fields"] == [2]
    assert {abs(float(x)) for x in certificate["end"]} == {0.0}
    assert not rejected(certificate)


def test_a_run_that_ended_early_is_not_certified() -> None:
    run = cs.simulate(cs.Parameters(alpha=1.2), periods=10**7, max_seconds=0.01)
    assert not run.success
    with pytest.raises(Unproved, match=r"first switch|seconds"):
        cs.certify_run(run)


def test_the_command_writes_what_the_checker_accepts(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    arguments = ["run", "--alpha", "0.9", "--periods", "2", "--certify", str(path)]
    result = CliRunner().invoke(group, arguments)
    assert result.exit_code == 0
    (certificate,) = json.loads(path.read_text())["certificates"]
    assert f"proved 1 ({len(certificate['fields'])} segments" in result.stderr
    assert not rejected(certificate)


def test_the_command_says_what_is_not_proved_and_leaves_the_file(tmp_path: Path) -> None:
    # At rest on the bound of stick it is open which field comes next: no switch is proved.
    path = tmp_path / "run.json"
    path.write_text("as it was")
    start = ["--beta", "0", "--zeta", "0", "--state", "1.0", "0.0", "0.0"]
    arguments = ["run", *start, "--periods", "1", "--certify", str(path)]
    result = CliRunner().invoke(group, arguments)
    assert result.exit_code == 4, result.output
    (line,) = result.stderr.splitlines()
    assert line.startswith("not proved: the run: ")
    assert path.read_text() == "as it was"


@pytest.fixture
def ticking(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A clock on which each look at it takes a second."""
    clock = count(int(perf_counter()))
    monkeypatch.setattr(watch, "perf_counter", lambda: next(clock))
    return clock


@pytest.mark.usefixtures("ticking")
def test_the_time_is_looked_at_within_a_segment() -> None:
    # With many bits one segment takes as long as thousands with few.
    run = cs.simulate(cs.Parameters(alpha=0.0), periods=1)
    assert len(run.segments) == 1
    with pytest.raises(Unproved, match="the time was over"):
        cs.certify_run(run, max_seconds=3)


@pytest.mark.usefixtures("ticking")
def test_orbits_and_bifurcations_are_certified_in_time_or_not_at_all() -> None:
    orbit = cs.solve_orbit(cs.Parameters(alpha=0.7))
    with pytest.raises(Unproved, match="the time was over before the orbit was proved"):
        cs.certify_orbit(orbit, max_seconds=10)
    (found, *_) = cs.continue_orbit(orbit, "alpha", 0.2).bifurcations
    with pytest.raises(Unproved, match="the time was over before the bifurcation was proved"):
        cs.certify_bifurcation(found, max_seconds=10)


def test_a_run_that_is_not_certified_in_time_is_unproved(monkeypatch, tmp_path) -> None:
    run, file = cs.simulate(cs.Parameters(alpha=1.2), periods=20), tmp_path / "run.json"
    clock = count(perf_counter())  # which each segment looks at once
    monkeypatch.setattr(watch, "perf_counter", lambda: next(clock))
    with pytest.raises(Unproved, match="the time was over before every switch was proved"):
        cs.certify_run(run, max_seconds=10)
    line = ["run", "--periods", "20", "--certify", str(file), "--max-seconds", "30"]
    ended = CliRunner().invoke(group, line)
    assert ended.exit_code == 4
    assert "the time was over" in ended.output
    assert not file.exists()
