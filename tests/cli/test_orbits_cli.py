"""`capsule-sym orbit`, `branch` and `curve`: what they print, write, and how they fail."""

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import capsule_sym
from capsule_sym import PhysicalParameters, simulate
from capsule_sym._cli import main


def call(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    out, err = capsys.readouterr()
    return stopped.value.code, out, err


def test_an_orbit_as_json(capsys) -> None:
    status, out, err = call(capsys, "orbit", "--alpha", "1.2", "--json")
    assert (status, err) == (0, "")
    record = json.loads(out)
    assert record["itinerary"] == ["F5", "F4", "F1", "F2", "F3", "F2"]
    assert record["stable"] is True
    assert (record["status"], record["success"]) == ("converged", True)
    assert len(record["multipliers"]) == 3
    assert record["admissibility"]["value"] > 0
    assert abs(record["imbalance"]) < 1e-12
    # The motion's own value of `run`, in the README.
    assert record["progression"]["value"] == pytest.approx(1.339272935, abs=1e-9)
    assert set(record["velocity"]["gradient"]) == set(record["parameters"])
    assert sum(record["durations"]) == pytest.approx(2 * 3.141592653589793 / 0.8, abs=1e-12)


def test_an_orbit_as_text(capsys) -> None:
    status, out, _ = call(capsys, "orbit", "--alpha", "1.2")
    assert status == 0
    for text in ("F5 F4 F1 F2 F3 F2", "multipliers", "stable", "admissibility", "friction loss"):
        assert text in out


def test_several_orbits(capsys) -> None:
    arguments = ("--alpha", "1.2", "--omega", "1.5", "--delta", "2", "--beta", "50", "--gamma", "5")
    status, out, _ = call(capsys, "orbit", *arguments, "--starts", "4", "--json")
    assert status == 0
    itineraries = {tuple(orbit["itinerary"]) for orbit in json.loads(out)["orbits"]}
    assert len(itineraries) >= 2


def test_a_branch(capsys, tmp_path: Path) -> None:
    arguments = ("--alpha", "0.9:1.0", "--points", "10")
    status, out, err = call(capsys, "branch", *arguments, "--out", str(tmp_path), "--json")
    assert status == 0
    assert err.startswith("wrote ")
    record = json.loads(out)
    assert (record["parameter"], record["status"]) == ("alpha", "reached")
    values = [point["value"] for point in record["points"]]
    assert (values[0], values[-1]) == (0.9, 1.0)
    assert {"itinerary", "multipliers", "progression", "admissibility", "state"} <= set(
        record["points"][0]
    )
    (one,) = record["bifurcations"]
    assert (one["type"], one["line"], one["parameter"]) == ("adding-sliding", "L2^(2)", "alpha")
    assert one["value"] == pytest.approx(0.940998003446, abs=1e-12)
    assert one["uncertainty"] < 1e-12
    assert one["itinerary_before"] == ["F5", "F4", "F1", "F2"]
    assert one["itinerary_after"] == ["F5", "F4", "F1", "F2", "F3", "F2"]
    assert one["orbit"]["durations"][one["segment"] - 1] == 0
    assert json.loads((tmp_path / "branch.json").read_text()) == record
    with (tmp_path / "points.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["alpha"]) for row in rows] == values
    with (tmp_path / "bifurcations.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["value"]) for row in rows] == [one["value"]]


def test_a_branch_whose_halves_become_one_is_written(capsys, tmp_path) -> None:
    """Its last bifurcation has no multipliers on the other side."""
    given = ("--omega", "0.91:0.9", "--alpha", "1.4", "--zeta", "0.02", "--out", str(tmp_path))
    status, _, err = call(capsys, "branch", *given)
    assert status == 3
    assert "period-halved" in err
    with (tmp_path / "bifurcations.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    kept = json.loads((tmp_path / "branch.json").read_text())["bifurcations"]
    assert [row["label"] for row in rows] == [one["label"] for one in kept]
    assert (kept[-1]["type"], kept[-1]["multipliers_after"]) == ("period doubling", [])
    assert "multipliers_after" not in rows[0]


def test_a_range_is_what_varies_from_its_first_number_to_its_second(capsys) -> None:
    """Down or up, as --along has it."""
    arguments = ("branch", "--points", "3", "--json")
    _, named, _ = call(capsys, *arguments, "--along", "alpha=1.0:0.9")
    status, out, _ = call(capsys, *arguments, "--alpha", "1.0:0.9")
    assert (status, out) == (0, named)
    assert json.loads(out)["points"][0]["value"] == 1.0


def test_a_branch_as_text(capsys) -> None:
    arguments = ("--alpha", "0.9:0.95", "--points", "5")
    status, out, _ = call(capsys, "branch", *arguments)
    assert status == 0
    assert re.search(r"line +value +uncertainty", out)
    assert "0.940998003446" in out
    assert "minimum of lower in segment 4, F2" in out


def test_a_branch_that_ends_early_says_why(capsys) -> None:
    arguments = ("--alpha", "0.3", "--delta", "0.3", "--zeta", "0.01", "--beta", "30")
    arguments += ("--omega", "1.6:0.7", "--points", "20")
    status, out, err = call(capsys, "branch", *arguments, "--json")
    assert status == 3
    assert err.startswith("the branch ends (turned-back): omega = 1.6")
    assert json.loads(out)["status"] == "turned-back"


def test_curves(capsys, tmp_path: Path) -> None:
    arguments = ("--alpha", "1.5:1.65", "--gamma", "3.0:3.3", "--at", "3.2", "--points", "8")
    arguments += ("--bifurcation", "crossing-sliding", "--out", str(tmp_path), "--json")
    status, out, _ = call(capsys, "curve", *arguments)
    assert status == 0
    (curve,) = json.loads(out)["curves"]
    assert curve["parameters"] == ["alpha", "gamma"]
    gammas = [point["gamma"] for point in curve["points"]]
    assert gammas == sorted(gammas)
    meetings = [(one["types"][1], one["gamma"]) for one in curve["codimension_two"]]
    assert [name for name, _ in meetings] == ["switching-sliding", "grazing-sliding"]
    assert [value for _, value in meetings] == pytest.approx([3.0955278438, 3.1854565282], abs=1e-9)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"curves.json", "points.csv", "codimension_two.csv"}


CURVE = ("curve", "--points", "4")


def test_a_curve_begins_in_its_range_where_the_default_lies_outside(capsys) -> None:
    arguments = (*CURVE, "--alpha", "1.4:1.7", "--gamma", "2.4:2.6")
    arguments += ("--bifurcation", "crossing-sliding", "--json")
    status, out, err = call(capsys, *arguments)
    assert status == 0
    assert err == "bifurcations are sought at gamma = 2.5, the middle of its range\n"
    (curve,) = json.loads(out)["curves"]
    assert [point["gamma"] for point in curve["points"]][:: len(curve["points"]) - 1] == [2.4, 2.6]
    # The same curve as from a value that is given.
    status, out, err = call(capsys, *arguments, "--at", "2.5")
    assert (status, err) == (0, "")
    assert json.loads(out)["curves"] == [curve]


def test_a_curve_of_events_that_happen_in_pairs_is_followed(capsys) -> None:
    arguments = "--alpha .1:2 --gamma 1:5 --bifurcation adding-sliding"
    status, out, err = call(
        capsys, "curve", "--delta", "1.2", *arguments.split(), "--points", "4", "--json"
    )
    assert (status, err) == (0, "")
    (curve,) = json.loads(out)["curves"]
    assert [one["status"] for one in curve["endings"]] == ["reached", "reached"]
    gammas = [point["gamma"] for point in curve["points"]]
    assert (min(gammas), max(gammas)) == (1.0, 5.0)


def test_the_curve_of_one_labelled_bifurcation_is_followed(capsys) -> None:
    line = ("curve", "--alpha", "0.3:1.1", "--gamma", "3.2:3.4", "--points", "1", "--json")
    wholes = []
    for kind in ("adding-sliding", "AS1"):
        status, out, err = call(capsys, *line, "--bifurcation", kind)
        assert (status, err) == (0, "")
        wholes.append(json.loads(out)["curves"])
    by_type, by_label = wholes
    assert len(by_type) > 1
    assert by_label == by_type[:1]


def test_branch_curve_and_run_write_an_itinerary_alike(capsys) -> None:
    # On the way down segments are taken out of the itinerary, which is then begun elsewhere.
    settings = ("--alpha", "1.53")
    _, out, _ = call(capsys, "run", *settings, "--periods", "300", "--json")
    itinerary = json.loads(out)["itinerary"]
    _, out, _ = call(capsys, "orbit", *settings, "--json")
    assert json.loads(out)["itinerary"] == itinerary
    arguments = ("--alpha", "1.53:1.5", "--points", "2")
    _, out, _ = call(capsys, "branch", *arguments, "--json")
    branch = json.loads(out)
    assert branch["points"][0]["itinerary"] == itinerary
    ends = branch["points"][-1]["itinerary"]
    assert branch["message"].endswith(f"itinerary {' '.join(ends)}")
    arguments = (*CURVE, "--alpha", "1.5:1.53", "--gamma", "3.29:3.31")
    status, out, _ = call(capsys, *arguments, "--bifurcation", "all", "--json")
    assert status == 0
    for curve in json.loads(out)["curves"]:
        ends = curve["points"][:: len(curve["points"]) - 1]
        for end, point in zip(curve["endings"], ends, strict=True):
            assert end["message"].endswith(f"itinerary {' '.join(point['itinerary'])}")


def test_no_orbit_as_json_has_the_reason(capsys) -> None:
    # Undamped and without contact the response keeps its beat for ever.
    arguments = ("--alpha", "0.3", "--delta", "5", "--zeta", "0", "--f-b", "10", "--json")
    status, out, err = call(capsys, "orbit", *arguments)
    assert status == 3
    assert err.startswith("no orbit (not-periodic): the run from (0.0, 0.0, 0.0) at phase 0.0 has")
    record = json.loads(out)
    assert (record["status"], record["success"]) == ("not-periodic", False)
    assert record["message"] in err
    assert err.count("\n") == 1


def test_no_orbit_exits_with_3(capsys, monkeypatch) -> None:
    from capsule_sym._orbits.shooting.orbit import NoOrbit

    nothing = NoOrbit(capsule_sym.results.Status.NOT_PERIODIC, "it wanders", None, (), 0.0)
    monkeypatch.setattr(capsule_sym, "solve_orbit", lambda *arguments, **_: nothing)
    for arguments in (("orbit",), ("branch", "--alpha", "0.5:1")):
        status, out, err = call(capsys, *arguments)
        assert (status, out) == (3, "")
        assert err == "no orbit (not-periodic): it wanders\n"


def test_a_branch_is_restarted_from_its_file_by_a_label(capsys, tmp_path) -> None:
    first = ("branch", "--zeta", "0.005", "--alpha", "0.04:0.05")
    status, _, _ = call(capsys, *first, "--points", "5", "--cascade", "1", "--out", str(tmp_path))
    assert status == 0
    record = json.loads((tmp_path / "branch.json").read_text())
    assert [one["origin"] for one in (record, *record["switched"])] == [None, "PD1"]
    rows = csv.DictReader((tmp_path / "points.csv").read_text().splitlines())
    assert {row["origin"] for row in rows} == {"", "PD1"}
    file = str(tmp_path / "branch.json")
    again = ("--restart", str(tmp_path), "PD1", "--to", "0.045", "--points", "2", "--json")
    status, out, err = call(capsys, "branch", *again)
    assert (status, err) == (0, "")
    record = json.loads(out)
    period_numbers = [one["points"][-1]["period_number"] for one in (record, *record["switched"])]
    assert period_numbers == [1, 2]
    for line, words in (
        (
            ("--restart", file, "PD2", "--to", "1"),
            "--restart = 'PD2': must be one of PD1, EP1, EP2",
        ),
        (("--restart", file, "PD1", "--to", "zeta="), "'' is not a valid float"),
    ):
        status, out, err = call(capsys, "branch", *line)
        assert (status, out) == (2, "")
        assert words in err
        assert err.count("\n") == 1


@pytest.mark.parametrize("name", ["f-b", "f_b"])
def test_a_branch_in_the_friction_bound_is_asked_for_either_way(capsys, name: str) -> None:
    arguments = ("--along", f"{name}=1:1.001", "--points", "2", "--json")
    status, out, _ = call(capsys, "branch", *arguments)
    assert (status, json.loads(out)["parameter"]) == (0, "f_b")


DEVICE = {
    **{"M_m": 0.5, "M_c": 1.65, "k1": 50.0, "k2": 75.0, "c": 0.5, "G": 0.0017},
    **{"P_d": 3.0, "Omega": 8.0, "mu": 0.2},
}
FORCE = 0.2 * 2.15 * 9.81  # the friction that carries the device, in N
RATE = 10.0  # sqrt(50 / 0.5), in 1/s


@pytest.fixture
def device(tmp_path: Path) -> str:
    path = tmp_path / "device.toml"
    path.write_text("".join(f"{name} = {value}\n" for name, value in DEVICE.items()))
    return str(path)


def test_an_orbit_of_a_device_is_told_in_si_units(capsys, device: str) -> None:
    record = json.loads(call(capsys, "orbit", "--params", device, "--json")[1])
    si = record["si"]
    for name, unit in (("work", "J"), ("damper_loss", "J"), ("friction_loss", "J")):
        expected = record[name]["value"] * FORCE * FORCE / 50.0
        assert si[f"{name} [{unit}]"] == pytest.approx(expected, rel=1e-13)
    assert si["peak_force [N]"] == pytest.approx(record["peak_force"]["value"] * FORCE, rel=1e-13)
    speed = record["velocity"]["value"] * FORCE / 50.0 * RATE
    assert si["velocity [m/s]"] == pytest.approx(speed, rel=1e-13)
    # A period is 2 pi / 8 s.
    period = 2 * 3.141592653589793 / 8.0
    assert si["progression [m]"] == pytest.approx(speed * period, rel=1e-12)
    text = call(capsys, "orbit", "--params", device)[1]
    assert "velocity [m/s]" in text
    assert "si" not in json.loads(call(capsys, "orbit", "--json")[1])


def test_a_branch_of_a_device_is_given_by_a_range(capsys, device: str, tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    line = ("branch", "--params", device, "--P-d", "3:3.05", "--points", "2", "--json")
    record = json.loads(call(capsys, *line, "--out", str(folder))[1])
    assert record["parameter"] == "P_d"
    rows = list(csv.DictReader((folder / "points.csv").read_text().splitlines()))
    assert len(rows) == len(record["points"])
    for point, row in zip(record["points"], rows, strict=True):
        assert point["parameters"]["alpha"] == pytest.approx(point["value"] / FORCE, rel=1e-13)
        speed = point["average_velocity"] * FORCE / 50.0 * RATE
        assert point["si"]["average_velocity [m/s]"] == pytest.approx(speed, rel=1e-13)
        assert float(row["average_velocity [m/s]"]) == pytest.approx(speed, rel=1e-12)


def test_a_curve_of_a_device_is_that_of_its_parameters(capsys, device: str) -> None:
    line = ("curve", "--bifurcation", "all", "--points", "2", "--json")
    ranges = ("--P-d", "3:4", "--Omega", "7.9:8.1")
    found = json.loads(call(capsys, *line, "--params", device, *ranges)[1])["curves"]
    assert found
    assert found[0]["parameters"] == ["alpha", "omega"]
    for point in found[0]["points"]:
        assert point["si"]["P_d [N]"] == pytest.approx(point["alpha"] * FORCE, rel=1e-13)
        assert point["si"]["Omega [rad/s]"] == pytest.approx(point["omega"] * RATE, rel=1e-13)
        assert 3 * (1 - 1e-9) <= point["si"]["P_d [N]"] <= 4 * (1 + 1e-9)


def test_figures_in_si_units_are_those_of_the_motion(capsys, device: str) -> None:
    """Forces and energies from the device's own constants and its states in m and m/s."""
    d = PhysicalParameters(**DEVICE)
    si = json.loads(call(capsys, "orbit", "--params", device, "--json")[1])["si"]

    p, periods, steps = d.dimensionless(), 200, 4000
    run = simulate(p, periods=periods)
    period = 2 * np.pi / d.Omega
    t = (periods - 1 + np.arange(steps) / steps) * p.period
    x, v, v_c = run(t).T * [[d.scale(name)] for name in ("x_r", "v_r", "v_c")]
    spring = d.k2 * np.maximum(x - d.G, 0)
    drive = d.P_d * np.cos(d.Omega * d.scale("duration") * t)
    friction = d.mu * (d.M_m + d.M_c) * d.g
    # Sums over a whole period, whose integrands have kinks: off by the steps squared.
    expected = {
        "velocity [m/s]": v_c.mean(),
        "progression [m]": v_c.mean() * period,
        "work [J]": (drive * (v + v_c)).mean() * period,
        "damper_loss [J]": d.c * (v**2).mean() * period,
        "friction_loss [J]": friction * abs(v_c).mean() * period,
        "power [W]": (drive * (v + v_c)).mean(),
        "peak_force [N]": abs(d.k1 * x + d.c * v + spring).max(),
        "peak_contact [N]": spring.max(),
    }
    assert {name: si[name] for name in expected} == pytest.approx(expected, rel=1e-4)


def test_a_pulsed_branch_with_a_start_at_a_rise_is_drawn_and_restarted(capsys, tmp_path) -> None:
    """The phase of such a start is a whole period, or 0: rounding decides."""
    scene = ("--scene", "prototype", "--D", "0.3:0.35", "--points", "3")
    assert call(capsys, "branch", *scene, "--out", str(tmp_path))[0] == 0
    file = tmp_path / "branch.json"
    record = json.loads(file.read_text())
    at_rise = next(one for one in record["bifurcations"] if one["type"] == "edge")
    period = 2 * math.pi / at_rise["orbit"]["parameters"]["omega"]
    for phase in (0.0, at_rise["orbit"]["phase"], period):
        assert math.remainder(phase, period) == pytest.approx(0, abs=1e-12)
        at_rise["orbit"]["phase"] = phase
        file.write_text(json.dumps(record))
        again = ("--restart", str(file), at_rise["label"], "--to", "0.345", "--points", "1")
        status, _, err = call(capsys, "branch", *again)
        assert (status, err) == (0, "")
    picture = tmp_path / "diagram.png"
    assert call(capsys, "figure", str(file), "--out", str(picture))[0] == 0
    assert picture.exists()


def test_a_device_that_its_drive_drags_is_called_so(capsys) -> None:
    scene, why = ("--scene", "prototype", "--D", "0.55"), "it drags the device forward without end"
    status, out, _ = call(capsys, "run", *scene, "--periods", "5")
    assert status == 0
    assert f"friction, 1, so that {why}" in " ".join(out.split())
    status, out, err = call(capsys, "orbit", *scene)
    assert (status, out) == (3, "")
    assert err.startswith("no orbit (not-periodic): the mean force of drive and load, 1.1, exceeds")
