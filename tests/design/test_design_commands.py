"""The commands `optimise` and `fit`: what they print, write, and refuse."""

import csv
import json
import re

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._commands.optimise import optimise as optimise_command
from capsule_sym._units import METRIC_UNITS
from tests.design.conftest import DEVICE


def test_optimise_prints_the_optimum_of_a_device_in_its_units(call) -> None:
    status, out, err = call(
        *("optimise", "--params", "device.toml", "--maximise", "speed-per-work"),
        *("--over", "P_d=3:5", "--over", "Omega=7:9", "--samples", "4"),
    )
    assert (status, err) == (0, [])
    lines = {line.strip().split("  ")[0]: line for line in out.splitlines()}
    device = cs.PhysicalParameters(0.5, 1.65, 50, 75, 0.5, 0.0017, 3.0, 8.0, 0.2)
    found = cs.optimise("speed_per_work", {"P_d": (3, 5), "Omega": (7, 9)}, device, samples=4)
    assert lines["value"].split()[1:] == [f"{found.value:.9g}"]
    assert lines["speed per work"].rstrip().endswith(f" {found.value:.9g} m/J")
    assert lines["velocity"].split()[1:] == [f"{found.metrics['velocity']:.9g}", "m/s"]
    assert lines["peak force"].rstrip().endswith(" N")
    assert lines["work"].rstrip().endswith(" J")
    assert lines["power"].rstrip().endswith(" W")


def test_optimise_writes_its_record(call, tmp_path) -> None:
    status, out, err = call(
        *("optimise", "--minimise", "cost_of_transport", "--over", "alpha=0.8:1.1"),
        *("--samples", "4", "--json", "--out", "found"),
    )
    assert status == 0
    assert err == ["wrote found/optimum.json"]
    record = json.loads(out)
    assert record == json.loads((tmp_path / "found" / "optimum.json").read_text())
    assert record["residual"] < 1e-9
    assert record["metrics"]["cost_of_transport"] == record["value"]


def test_a_front_is_written_with_its_table_and_its_picture(call, tmp_path) -> None:
    status, out, err = call(
        *("optimise", "--maximise", "speed", "--pareto", "cost_of_transport", "--points", "4"),
        *("--over", "alpha=0.8:1.2", "--over", "omega=0.7:0.9", "--samples", "8", "--out", "found"),
    )
    assert status == 0
    assert err == ["wrote found/front.json, found/front.csv, found/front.svg"]
    rows = list(csv.DictReader((tmp_path / "found" / "front.csv").read_text().splitlines()))
    assert len(rows) == 4
    assert out.count("F5 F4 F1 F2") >= 4
    assert (tmp_path / "found" / "front.svg").read_text().startswith("<?xml")


def series(path, **changed) -> None:
    """A file of measurements of known parameters."""
    run = cs.simulate(cs.Parameters(alpha=0.83, zeta=0.06), periods=6)
    times = np.linspace(0.0, 45.0, 120)
    x_r, _, _, x_c = run(times, position=True).T
    table = {"t": times, "x_m": x_r + x_c, "x_c": x_c} | changed
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(table)
        writer.writerows(zip(*table.values(), strict=True))


def test_fit_finds_the_parameters_of_a_file(call, tmp_path) -> None:
    series(tmp_path / "data.csv")
    status, out, err = call(
        *("fit", "data.csv", "--alpha", "0.85", "--unknown", "alpha", "--unknown", "zeta=0.01:0.2"),
        *("--json", "--out", "found"),
    )
    assert status == 0
    assert err == ["wrote found/fit.json, found/fit.csv, found/fit.svg"]
    record = json.loads(out)
    assert record["values"]["alpha"] == pytest.approx(0.83, abs=1e-9)
    assert record["values"]["zeta"] == pytest.approx(0.06, abs=1e-9)
    assert (
        len(list(csv.DictReader((tmp_path / "found" / "fit.csv").read_text().splitlines()))) == 240
    )
    status, out, _ = call("fit", "data.csv", "--alpha", "0.85", "--unknown", "alpha")
    assert "120 rows: t, x_m, x_c" in out
    assert "values           alpha 0.8" in out


@pytest.mark.parametrize("changed", [{"G": 5.0}, {"G": 5.0, "c": 0.0}, {"k2": 0.0}])
def test_a_device_that_cannot_drift_says_so(changed, call, tmp_path) -> None:
    lines = [line for line in DEVICE.splitlines() if line.split()[0] not in changed]
    lines += [f"{name} = {value}" for name, value in changed.items()]
    (tmp_path / "device.toml").write_text("\n".join(lines).replace(" M_c", "\nM_c"))
    words = ("--maximise", "speed", "--over", "P_d=3:8", "--samples", "8")
    status, out, err = call("optimise", "--params", "device.toml", *words)
    told = "flat: speed is 0 at each of 8 surveyed places"
    assert (status, out.splitlines()[-1], err) == (3, told, [told])


TIMED = {
    "fit": ("data.csv", "--unknown", "alpha"),
    "optimise": ("--maximise", "speed", "--over", "alpha=0.8:1"),
    "optimise --pareto": ("work", "--maximise", "speed", "--over", "alpha=0.8:1"),
}


@pytest.mark.parametrize("name", TIMED)
def test_a_command_that_is_out_of_time_says_so(name, call, tmp_path) -> None:
    series(tmp_path / "data.csv")
    status, out, err = call(*name.split(), *TIMED[name], "--max-seconds", "1e-9", "--json")
    assert (status, len(err)) == (3, 1)
    assert "time" in err[0]
    assert "time-limit" in out
    json.loads(out)
    status, out, err = call(*name.split(), *TIMED[name], "--max-seconds", "nan")
    assert (status, out, len(err)) == (2, "", 1)
    assert "max-seconds" in err[0]


OVER = {"alpha": (0.8, 1.0)}
COUNTS = {
    "optimise samples": (lambda n: cs.optimise("speed", OVER, samples=n), 1, 1_000_000),
    "pareto points": (lambda n: cs.pareto("speed", "work", OVER, points=n), 2, 10_000),
    "fit starts": (lambda n: cs.fit(DATA, cs.Parameters(), ("alpha",), starts=n), 0, 100_000),
    "fit follow": (lambda n: cs.fit(DATA, cs.Parameters(), ("alpha",), follow=n), 1, 1000),
    "fit steps": (lambda n: cs.fit(DATA, cs.Parameters(), ("alpha",), steps=n), 1, 100_000),
}
DATA = {"t": [0.0, 1.0, 2.0], "x_r": [0.0, 1.0, 0.0]}


@pytest.mark.parametrize("name", COUNTS)
def test_a_count_beyond_its_range_is_refused_before_anything_is_made(name) -> None:
    call, least, most = COUNTS[name]
    for count in (least - 1, most + 1, 10**12):
        with pytest.raises(cs.InvalidInput, match=f"{name.split()[1]} = .* from {least} to {most}"):
            call(count)


def test_options_have_the_ranges_of_the_functions(call) -> None:
    words = {
        "optimise": ("--maximise", "speed", "--over", "alpha=0.8:1", "--pareto", "work"),
        "fit": ("data.csv", "--unknown", "alpha"),
    }
    for command, names in (("optimise", ("samples", "points")), ("fit", ("starts",))):
        for name in names:
            found = next(one for key, one in COUNTS.items() if key.endswith(f" {name}"))
            status, out, err = call(command, *words[command], f"--{name}", str(found[2] + 1))
            assert (status, out, len(err)) == (2, "", 1)
            assert f"{found[1]}<=x<={found[2]}" in err[0]


OPTIMISE = ("optimise", "--maximise", "speed", "--samples", "2")
REFUSED = {
    "no metric": (("optimise", "--over", "alpha=1:2"), "--maximise or --minimise"),
    "two metrics": (("optimise", "--maximise", "speed", "--minimise", "work"), "--minimise"),
    "nothing varies": (OPTIMISE, "over"),
    "unknown metric": (("optimise", "--maximise", "joy", "--over", "alpha=1:2"), "--maximise = "),
    "empty bounds": ((*OPTIMISE, "--over", "alpha=2:1"), "--over alpha = "),
    "twice": ((*OPTIMISE, "--over", "alpha=1:2", "--over", "alpha=1:2"), "--over"),
    "points of no front": ((*OPTIMISE, "--over", "alpha=1:2", "--points", "5"), "--points"),
    "a seed of no draw": (("fit", "data.csv", "--unknown", "alpha", "--seed", "1"), "--seed"),
    "phase": (("fit", "data.csv", "--unknown", "alpha", "--phase", "nan"), "phase"),
    "a tolerance twice": (
        (*OPTIMISE, "--over", "alpha=1:2", *(2 * ("--tolerance", "zeta=0.1"))),
        "--tolerance",
    ),
    "no range": ((*OPTIMISE, "--over", "alpha"), "NAME=LOW:HIGH"),
    "a device's name": ((*OPTIMISE, "--over", "P_d=1:2"), "over"),
    "no file": (("fit", "none.csv", "--unknown", "alpha"), "file"),
    "nothing unknown": (("fit", "data.csv"), "give --unknown"),
    "missing column": (("fit", "missing.csv", "--unknown", "alpha"), "columns"),
    "constant column": (("fit", "constant.csv", "--unknown", "alpha"), "x_c"),
    "times that go back": (("fit", "back.csv", "--unknown", "alpha"), "t in row"),
    "units of another kind": (
        ("fit", "data.csv", "--params", "device.toml", "--unknown", "alpha"),
        "unknown",
    ),
}


def test_constraints_that_no_point_satisfies_leave_no_optimum(call) -> None:
    line = (*OPTIMISE, "--over", "alpha=0.5:0.9", "--subject-to", "peak_force <= 0.5", "--json")
    for more in ((), ("--pareto", "work", "--points", "3")):
        status, out, err = call(*line, *more)
        found = json.loads(out)
        assert (status, found["status"], found["success"]) == (3, "infeasible", False)
        assert err == [f"infeasible: {found['message']}"]
        assert "peak_force <= 0.5 by " in err[0]


@pytest.mark.parametrize("name", REFUSED)
def test_bad_input_is_one_line_and_nothing_is_written(name, call, tmp_path) -> None:
    times = np.linspace(0.0, 45.0, 120)
    series(tmp_path / "data.csv")
    series(tmp_path / "constant.csv", x_c=np.ones(120))
    series(tmp_path / "back.csv", t=np.append(times[:-1], 1.0))
    (tmp_path / "missing.csv").write_text("t\n0\n1\n")
    before = sorted(one.name for one in tmp_path.iterdir())
    arguments, said = REFUSED[name]
    status, out, err = call(*arguments, "--out", "found")
    assert (status, out, len(err)) == (2, "", 1)
    assert err[0].startswith("error: ")
    assert said in err[0]
    assert sorted(one.name for one in tmp_path.iterdir()) == before


def test_the_help_names_every_metric() -> None:
    for text in (cs.optimise.__doc__, optimise_command.help):
        assert {*METRIC_UNITS} <= {*re.findall(r"\w+", str(text))}
