"""`--certify`, as a user calls it."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from capsule_sym import InvalidInput, Parameters, certify_run, scenes, simulate
from capsule_sym._cli import group
from capsule_sym._commands import present
from capsule_sym._enclosures.certificates import checker
from capsule_sym._enclosures.numbers.balls import Unproved
from capsule_sym._enclosures.passage.runs import enclose_run
from capsule_sym._map.trajectory import Kept
from capsule_sym._native import Watch
from capsule_sym._orbits.continuation.records import FORMAT


def certificates(path: Path) -> list[dict]:
    return json.loads(path.read_text())["certificates"]


def test_orbit_is_certified(tmp_path: Path) -> None:
    file = tmp_path / "orbit.json"
    run = CliRunner().invoke(group, ["orbit", "--alpha", "0.7", "--certify", str(file)])
    assert run.exit_code == 0, run.output
    assert f"proved 1 (existence, uniqueness, itinerary; 1 stable), wrote {file}" in run.output
    (certificate,) = certificates(file)
    checker.check_certificate(certificate)
    assert certificate["parameters"]["alpha"] == "0.7"


def test_branch_certifies_its_bifurcations(tmp_path: Path) -> None:
    file = tmp_path / "branch.json"
    options = ["--alpha", "0.3:0.6"]
    run = CliRunner().invoke(group, ["branch", *options, "--certify", str(file)])
    assert run.exit_code == 0, run.output
    assert f"proved 2 (existence, uniqueness, itinerary), wrote {file}" in run.output
    assert [one["fields"] for one in certificates(file)] == [[4, 5, 2, 5], [5, 2, 5, 4]]
    for one in certificates(file):
        checker.check_certificate(one)


def test_stable_and_unstable_orbits_are_counted(tmp_path: Path, monkeypatch, capsys) -> None:
    known = [{"kind": "orbit", "stable": one} for one in (False, True, False)]
    found = "capsule_sym._enclosures.certificates.certify.certificates"
    monkeypatch.setattr(found, lambda proved, _: (proved, []))
    for proved, said in (
        (known, "proved 3 (existence, uniqueness, itinerary; 1 stable; 2 unstable), "),
        (known[:1], "proved 1 (existence, uniqueness, itinerary; 1 unstable), "),
    ):
        present.certificates(tmp_path / "a.json", proved, Watch())
        assert said in capsys.readouterr().err


def test_what_the_checker_cannot_take_is_said(tmp_path: Path) -> None:
    file = tmp_path / "branch.json"
    options = ["--alpha", "1.6", "--gamma", "3.0:3.3"]
    run = CliRunner().invoke(group, ["branch", *options, "--certify", str(file)])
    assert run.exit_code == 4
    assert "not proved" in run.output


DEVICE = "M_m=0.5\nM_c=1.65\nk1=50\nk2=75\nc=0.5\nG=0.0017\nP_d=6\nOmega=8\nmu=0.2\n"
TIED = {"format": FORMAT, "parameter": "omega", "ties": {"alpha": "omega"}, "bifurcations": []}


@pytest.mark.parametrize(
    "line",
    [
        "--alpha 0.9 --omega 0.8:0.81 --with alpha=omega",
        "--params device.toml --P-d 6:7",
        "--restart tied.json EP2 --to 0.82",
        "--restart tied.json EP2 --to zeta=0.06 --with alpha=15*zeta",
    ],
)
def test_a_certificate_of_tied_parameters_is_refused_before_the_branch(
    tmp_path: Path, monkeypatch, line: str
) -> None:
    """No motion is simulated, no orbit continued."""
    monkeypatch.chdir(tmp_path)
    Path("device.toml").write_text(DEVICE)
    Path("tied.json").write_text(json.dumps(TIED))
    for name in ("capsule_sym.continue_from", "capsule_sym._commands.branch.settled"):
        monkeypatch.setattr(name, lambda *_, **__: pytest.fail("the work has begun"))
    words = ["branch", *line.split(), "--certify", "a.json"]
    with pytest.raises(InvalidInput, match=r"certify = 'a\.json': must be absent if several"):
        CliRunner().invoke(group, words, catch_exceptions=False)
    assert not Path("a.json").exists()


@pytest.mark.parametrize("name", ["slope", "reaction"])
def test_a_motion_of_another_scene_is_refused_and_not_proved_of_this_one(name: str) -> None:
    words = ["run", "--scene", name, "--alpha", "0.1", "--certify", "a.json"]
    with pytest.raises(InvalidInput, match=f"--certify = 'a.json': .* absent for the scene {name}"):
        CliRunner().invoke(group, words, catch_exceptions=False)
    with pytest.raises(InvalidInput, match=f"scene = '{name}': must be capsule"):
        certify_run(simulate(getattr(scenes, name).Parameters(alpha=0.1), periods=2))


@pytest.mark.parametrize("backend", ["numpy", "mpmath"])
def test_run_is_enclosed_and_its_end_is_that_of_the_map(backend: str) -> None:
    trajectory = simulate(Parameters(alpha=1.2), (0.1, 0.3, 0.05), 0.5, 2, backend=backend)
    passed = enclose_run(trajectory)
    assert len(passed.times) == len(trajectory.segments) - 1
    for k in range(3):
        value = passed.state[k, 0]
        assert value.rad() < 1e-20
        assert float(value) == pytest.approx(float(trajectory.final[1][k]), abs=1e-12)


def test_run_with_a_switch_left_out_is_not_proved() -> None:
    from dataclasses import replace

    trajectory = simulate(Parameters(alpha=1.2), periods=2)
    first, second, *rest = trajectory.segments
    longer = replace(first, duration=first.duration + second.duration)
    with pytest.raises((Unproved, ValueError)):
        enclose_run(replace(trajectory, kept=Kept("segments", (longer, *rest))))
    later = replace(first, duration=first.duration + 1e-3)
    enclose_run(
        replace(trajectory, kept=Kept("segments", (later, second, *rest)))
    )  # a guess, no more


@pytest.mark.long
def test_points_of_a_curve_are_certified(tmp_path: Path) -> None:
    file = tmp_path / "curve.json"
    line = "--alpha 0.36:0.37 --gamma 3.29:3.3 --bifurcation adding"
    options = [*line.split(), "--points", "1", "--at", "3.3", "--certify", str(file)]
    run = CliRunner().invoke(group, ["curve", *options])
    assert run.exit_code == 0, run.output
    held = certificates(file)
    assert len(held) >= 2
    assert {one["parameters"]["gamma"] for one in held} >= {"3.3", "3.29"}
    for one in held:
        checker.check_certificate(one)
        assert float(one["free"]["alpha"]) == pytest.approx(0.3688, abs=1e-3)
