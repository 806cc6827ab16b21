"""Pictures of sweeps: cost of transport as the energies of an orbit give it, and the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import capsule_sym
from capsule_sym import InvalidInput, Parameters, performance, solve_orbit
from capsule_sym._figures import sweeps
from tests.figures.test_command import run_here

pytest.importorskip("zarr")


@pytest.fixture(scope="module")
def stores(tmp_path_factory) -> Path:
    from capsule_sym import Axis, Sweep, run_basin, run_sweep

    where = tmp_path_factory.mktemp("sweeps")
    axes = Axis.linear("alpha", 0.3, 1.5, 3), Axis.linear("omega", 0.7, 0.9, 2)
    run_sweep(Sweep(axes, Parameters(), compute=("itinerary", "energies")), where / "grid")
    starts = Axis.linear("x_r", -1.0, 1.0, 3), Axis.linear("v_r", -1.0, 1.0, 2)
    for name, line in (("line", axes[:1]), ("row", (axes[0], Axis.linear("omega", 0.8, 0.8, 1)))):
        run_sweep(Sweep(line, Parameters(), compute=("itinerary",)), where / name)
    run_basin(
        Sweep(starts, Parameters(), compute=("itinerary", "progression", "final")), where / "basin"
    )
    return where


def test_speed_and_cost_are_those_of_the_orbits(stores: Path) -> None:
    from capsule_sym import open_results

    with open_results(stores / "grid") as results:
        speed, cost = sweeps.speed_and_cost(results)
    expected = []
    for alpha in (0.3, 0.9, 1.5):
        for omega in (0.7, 0.9):
            orbit = solve_orbit(Parameters(alpha=alpha, omega=omega))
            way = abs(float(orbit.progression))
            if way > 1e-12:
                work = float(performance(orbit).work.value)
                expected.append((abs(float(orbit.average_velocity)), work / way))
    assert len(expected) >= 4
    assert np.column_stack([speed, cost]) == pytest.approx(np.array(expected), rel=1e-9)


def test_what_a_sweep_does_not_hold_is_not_drawn(stores: Path) -> None:
    from capsule_sym import open_results

    with open_results(stores / "grid") as results:
        with pytest.raises(InvalidInput, match="a basin over two coordinates"):
            sweeps.plot_basin(results)
        still = results.isel(alpha=[0])
        if float(abs(still["velocity"]).max()) <= 1e-12:
            with pytest.raises(InvalidInput, match="no cell in which the capsule advances"):
                sweeps.plot_pareto(still)
    with (
        open_results(stores / "basin") as results,
        pytest.raises(InvalidInput, match="a sweep that computes energies"),
    ):
        sweeps.plot_pareto(results)


@pytest.mark.parametrize(
    ("store", "more"),
    [("grid", []), ("basin", []), ("grid", ["--as", "pareto"])],
)
def test_the_command_draws_what_the_store_holds(stores: Path, tmp_path, store, more) -> None:
    done = run_here("sweep-figure", str(stores / store), "--out", "x.png", *more, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "wrote x.png\n")
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("alone", [False, True])
def test_curves_that_the_command_wrote_are_drawn(
    alone: bool, stores: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = []
    monkeypatch.setattr(
        capsule_sym, "plot_chart", lambda _, lines, width: drawn.append(lines) or Figure()
    )
    line = ["curve", "--alpha", "0.8:1.1", "--omega", "0.79:0.81", "--bifurcation", "adding"]
    done = run_here(*line, "--points", "1", "--json", cwd=tmp_path)
    whole = json.loads(done.stdout)
    (tmp_path / "c.json").write_text(json.dumps(whole["curves"][0] if alone else whole))
    line = ["sweep-figure", str(stores / "grid"), "--out", "x.png", "--curve", "c.json"]
    assert run_here(*line, cwd=tmp_path).returncode == 0
    ((curve,),) = drawn
    assert (curve["type"], curve["points"]) == ("adding-sliding", whole["curves"][0]["points"])


def test_json_says_what_was_drawn(stores: Path, tmp_path: Path) -> None:
    line = ["sweep-figure", str(stores / "basin"), "--out", "x.png", "--json"]
    done = run_here(*line, cwd=tmp_path)
    size = (tmp_path / "x.png").stat().st_size
    told = {"figure": "basin", "files": [{"path": "x.png", "bytes": size}]}
    assert (json.loads(done.stdout), done.stderr) == (told, "")


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["nowhere"], "nowhere"),
        (["STORE", "--curve", "none.json"], "--curve = 'none.json': must be readable"),
        (["STORE", "--as", "basin"], "a basin over two coordinates"),
        (["LINE"], "itineraries over two parameters"),
        (["ROW"], "two values or more of each parameter"),
    ],
)
def test_bad_input_is_one_line(stores: Path, tmp_path: Path, arguments, part) -> None:
    named = {"STORE": "grid", "LINE": "line", "ROW": "row"}
    given = [str(stores / named[one]) if one in named else one for one in arguments]
    done = run_here("sweep-figure", *given, "--out", "x.png", cwd=tmp_path)
    assert done.returncode == 2
    assert part in done.stderr
    assert done.stderr.count("\n") == 1
