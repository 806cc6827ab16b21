"""Pictures of sweeps: cost of transport as the energies of an orbit give it, and the command."""

from __future__ import annotations

import json
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import capsule_sym as cs
from capsule_sym import InvalidInput, Parameters, continue_orbit, figures, performance, solve_orbit
from capsule_sym._attractors.neighbourhoods import stroboscopic
from capsule_sym._figures import style
from capsule_sym._orbits.continuation.records import branch_record
from capsule_sym._units import METRIC_UNITS, UNITS
from tests.figures import DEVICE
from tests.figures.test_command import run_here

pytest.importorskip("zarr")


@pytest.fixture(scope="module")
def stores(tmp_path_factory) -> Path:
    where = tmp_path_factory.mktemp("sweeps")
    axes = cs.inputs.Axis.linear("alpha", 0.3, 1.5, 3), cs.inputs.Axis.linear("omega", 0.7, 0.9, 2)
    cs.run_sweep(
        cs.inputs.Sweep(axes, Parameters(), compute=("itinerary", "energies")), where / "grid"
    )
    starts = cs.inputs.Axis.linear("x_r", -1.0, 1.0, 3), cs.inputs.Axis.linear("v_r", -1.0, 1.0, 2)
    for name, line in (
        ("line", axes[:1]),
        ("row", (axes[0], cs.inputs.Axis.linear("omega", 0.8, 0.8, 1))),
    ):
        cs.run_sweep(cs.inputs.Sweep(line, Parameters(), compute=("itinerary",)), where / name)
    cs.run_sweep(cs.inputs.Sweep(axes[:1], compute=("progression",)), where / "pace")
    cs.run_basin(
        cs.inputs.Sweep(starts, Parameters(), compute=("itinerary", "progression", "final")),
        where / "basin",
    )
    return where


def test_stars_of_basins_are_the_attractors_and_numbers_stand_in_their_areas(stores: Path) -> None:
    with cs.results.open_results(stores / "basin") as results:
        figure = figures.plot_basin(results)
    (axes,) = figure.axes
    (star,) = (np.transpose(line.get_data()) for line in axes.lines)
    (mark,) = stroboscopic(solve_orbit(Parameters()))
    assert star == pytest.approx(mark[None, :2], abs=1e-3)
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    # The numbers are those of the results, with the itineraries that they have there.
    with cs.results.open_results(stores / "basin") as results:
        known = results["attractor"].attrs["attractors"]
    each = [
        f"{k}  {one['itinerary']} ({100 * one['fraction']:.3g} %)" for k, one in enumerate(known)
    ]
    assert shown[:-1] == each
    assert shown[-1] == "attractor, once a period"
    assert {text.get_text() for text in axes.texts} <= {text[0] for text in shown}


@pytest.mark.parametrize(
    ("store", "more"), [("grid", []), ("basin", []), ("grid", ["--of", "work"])]
)
def test_the_command_draws_what_the_store_holds(stores: Path, tmp_path, store, more) -> None:
    done = run_here(
        "figure", str(stores / store), "--out", "x.png", "--dpi", "30", *more, cwd=tmp_path
    )
    assert (done.returncode, done.stderr) == (0, "wrote x.png\n")
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("alone", [False, True])
def test_curves_that_the_command_wrote_are_drawn(alone, stores, tmp_path, monkeypatch) -> None:
    drawn = []
    draw = lambda _, curves, width: drawn.append(curves) or Figure()  # noqa: E731
    monkeypatch.setattr("capsule_sym._figures.sweeps.plot_chart", draw)
    line = ["curve", "--alpha", "0.8:1.1", "--omega", "0.79:0.81", "--bifurcation", "adding"]
    done = run_here(*line, "--points", "1", "--json", cwd=tmp_path)
    whole = json.loads(done.stdout)
    (tmp_path / "c.json").write_text(json.dumps(whole["curves"][0] if alone else whole))
    line = ["figure", str(stores / "grid"), "--out", "x.png", "--curve", "c.json"]
    assert run_here(*line, cwd=tmp_path).returncode == 0
    ((curve,),) = drawn
    assert (curve["type"], curve["points"]) == ("adding-sliding", whole["curves"][0]["points"])


METRICS = {"velocity": "velocity", "speed": "velocity", "work": "work", "cost_of_transport": "work"}


@pytest.mark.parametrize("metric", METRICS)
def test_a_metric_over_two_parameters_is_that_of_the_orbits(stores: Path, metric: str) -> None:
    with cs.results.open_results(stores / "grid") as results:
        axes, bar = figures.plot_metric(results, metric).axes
    (mesh,) = axes.collections
    drawn = np.ma.filled(mesh.get_array().astype(float), np.nan)
    for i, alpha in enumerate((0.9, 1.5), 1):
        for j, omega in enumerate((0.7, 0.9)):
            orbit = solve_orbit(Parameters(alpha=alpha, omega=omega))
            value = float(getattr(performance(orbit), METRICS[metric]).value)
            value = abs(value) if metric == "speed" else value
            if metric == "cost_of_transport":
                value /= abs(float(orbit.progression))
            assert drawn[j, i] == pytest.approx(value, rel=1e-9)
    assert bar.get_ylabel().startswith({"velocity": "average velocity"}.get(metric, metric[:4]))
    if metric == "velocity":  # of both signs or not, 0 is the middle of two hues
        low, high = mesh.get_clim()
        assert low == -high or low >= 0 or high <= 0


OF_PERFORMANCE = ("velocity", "progression", "work", "damper_loss", "friction_loss", "lift")
OF_PERFORMANCE += ("peak_force", "peak_contact")


@pytest.mark.parametrize("scene", ["capsule", "slope"])
@pytest.mark.parametrize("metric", [*METRIC_UNITS, "lift", "lyapunov"])
def test_every_metric_of_a_device_is_drawn_in_its_unit(of_devices, scene: str, metric: str) -> None:
    """In sweeps and along branches, against the energies, forces and multipliers of the orbit."""
    device, results, orbit, record = of_devices[scene]
    if (metric, scene) == ("lift", "capsule"):
        with pytest.raises(InvalidInput, match="a metric that the sweep has: velocity"):
            figures.plot_metric(results, metric)
        return
    figures.plot_metric(results, metric, axes=(axes := Figure().subplots()))
    own, found = device.dimensionless(), performance(orbit)
    length, force = device.length_scale, device.friction_force
    energy, rate = length * force, device.natural_frequency
    turn = 2 * np.pi / (own.omega * rate)  # s
    way, work = abs(float(orbit.progression)) * length, float(found.work.value) * energy
    scales = dict.fromkeys(OF_PERFORMANCE, energy) | {"velocity": length * rate}
    scales |= {"progression": length, "peak_force": force, "peak_contact": force}
    if metric in OF_PERFORMANCE:
        expected = float(getattr(found, metric).value) * scales[metric]
    else:
        bound = force * getattr(own, "f_plus" if orbit.progression > 0 else "f_minus", 1.0)
        expected = {
            "speed": way / turn,
            "power": work / turn,
            "speed_per_work": way / work,
            "cost_of_transport": work / (bound * way),
            "lyapunov": np.log(abs(orbit.multipliers[0])) / turn,
        }[metric]
    unit = re.findall(r"\(([^)]*)\)$", axes.get_ylabel())
    prefixes = {"m": 1e-3, "µ": 1e-6, "k": 1e3}
    prefix, base = 1.0, UNITS[metric].name
    if unit and unit[0] != base:
        assert unit[0][1:] == base
        prefix = prefixes[unit[0][0]]
    assert unit or not base
    assert axes.lines[0].get_ydata()[1] * prefix == pytest.approx(expected, rel=1e-8)
    figures.plot_diagram(record, metric, device=device, axes=(along := Figure().subplots()))
    assert along.get_ylabel() == axes.get_ylabel()
    assert along.lines[0].get_ydata()[0] * prefix == pytest.approx(expected, rel=1e-8)


@pytest.fixture(scope="module")
def of_devices(tmp_path_factory) -> dict[str, Any]:
    """A device of two scenes, a sweep of its amplitude, and the branch from its last motion."""
    where, found = tmp_path_factory.mktemp("devices"), {}
    slope = cs.scenes.slope.PhysicalParameters(**asdict(DEVICE) | {"mu_back": 0.3, "slope": 0.05})
    for name, device in (("capsule", DEVICE), ("slope", slope)):
        axis = cs.inputs.Axis.of_device(device, "P_d", np.array([0.1, 0.15]))
        compute = ("itinerary", "progression", "energies", "forces", "lyapunov")
        cs.run_sweep(cs.inputs.Sweep((axis,), device=device, compute=compute), where / name)
        with cs.results.open_results(where / name) as results:
            first = device.dimensionless().replace(alpha=float(results["alpha"][1]))
            orbit = solve_orbit(first)
            branch = continue_orbit(orbit, "alpha", first.alpha * 1.01, points=1)
            found[name] = device, results.load(), orbit, branch_record(branch)
    return found


def test_a_device_has_the_fixed_parameters_of_every_branch(of_devices) -> None:
    device, _, orbit, record = of_devices["capsule"]
    other = orbit.parameters.replace(gamma=1.1 * orbit.parameters.gamma)
    other_record = branch_record(continue_orbit(solve_orbit(other), "alpha", 1.01 * other.alpha))
    for records in ([record, other_record], [other_record, record]):
        with pytest.raises(InvalidInput, match="device"):
            cs.figures.plot_diagram(records, device=device)
    cs.figures.plot_diagram([record, record], device=device)


def test_outliers_do_not_squeeze_a_metric() -> None:
    over = {"alpha": np.linspace(0, 1, 10), "gamma": np.linspace(1, 3, 10)}
    speed, work = np.linspace(0.1, 0.2, 100), np.linspace(0.1, 0.2, 100) ** 2
    work[:3] = 1e4
    cells = {"velocity": speed.reshape(10, 10), "work": work.reshape(10, 10)}
    cells["velocity"][9, 9] = 0.0
    data = {name: (tuple(over), values) for name, values in cells.items()}
    results = xr.Dataset(data, coords=over, attrs={"omega": 2 * np.pi, "f_b": 1.0})
    figure = figures.plot_metric(results, "cost_of_transport")
    (mesh,) = figure.axes[0].collections
    assert mesh.get_clim()[1] == pytest.approx(work[98] / speed[98])
    assert mesh.colorbar.extend == "max"
    (said,) = figure.legends[0].get_texts()
    assert said.get_text() == "not settled, infinite, or no result"


def test_a_range_about_zero_with_all_values_has_no_arrow() -> None:
    over = {"alpha": np.linspace(0, 1, 10), "gamma": np.linspace(1, 3, 10)}
    speed = np.linspace(-0.02, 0.2, 100)
    speed[0] = -0.15  # beyond the bulk, and within its mirror image
    results = xr.Dataset(
        {"velocity": (tuple(over), speed.reshape(10, 10))},
        coords=over,
        attrs={"omega": 2 * np.pi, "f_b": 1.0},
    )
    (mesh,) = figures.plot_metric(results, "velocity").axes[0].collections
    low, high = mesh.get_clim()
    assert -high == low < speed[0]
    assert mesh.colorbar.extend == "neither"


def test_stars_of_a_devices_basin_are_in_its_units() -> None:
    from tests.figures.test_layout import swept

    starts = swept().rename(alpha="x_r", gamma="v_r")
    starts["x_r"].attrs = {"si_units": "m", "si_scale": 0.25}
    starts["v_r"].attrs = {"si_units": "m/s", "si_scale": 0.002}
    final = np.tile([1.0, 2.0, 0.0], (*starts["attractor"].shape, 1))
    starts["final"] = (("x_r", "v_r", "component"), final)
    (axes,) = figures.plot_basin(starts).axes
    (star,) = (line.get_xydata().tolist() for line in axes.lines)
    assert star == [pytest.approx([0.25, 4.0])]  # m, mm/s


def test_all_of_a_page_of_ones_own_is_laid_out(stores: Path) -> None:
    """A chart, and a metric that was drawn after it."""
    from tests.figures.layout import problems

    with cs.figures.figure_style():
        figure = Figure(figsize=(7, 3), layout="constrained")
        left, right = figure.subplots(1, 2)
        with cs.results.open_results(stores / "grid") as grid:
            cs.figures.plot_chart(grid, axes=left)
            figures.plot_metric(grid, axes=right)
        assert problems(figure) == []


def test_a_metric_over_one_parameter_is_dots_and_others_are_refused(stores: Path) -> None:
    with cs.results.open_results(stores / "grid") as results:
        (axes,) = figures.plot_metric(results.isel(omega=0), "velocity").axes
        (line,) = axes.lines
        assert list(line.get_xdata()) == pytest.approx([0.3, 0.9, 1.5])
        assert line.get_linestyle() == "None"
        with pytest.raises(InvalidInput, match="that the sweep has: velocity, speed, prog"):
            figures.plot_metric(results, "lyapunov")


def test_an_itinerary_has_one_colour_on_a_page() -> None:
    figure = Figure()
    first = style.area_colours(figure, ["F5 F2", "F2"])
    assert style.area_colours(figure, ["F2", "F1 F2", "F5 F2"])[::2] == first[::-1]


@pytest.mark.parametrize("order", [("Omega", "duty"), ("duty", "Omega")])
def test_curves_of_a_device_bound_a_chart_in_its_units(order: tuple[str, str], tmp_path) -> None:
    known = {"M_m": 0.0018, "M_c": 0.0017, "k1": 62, "k_front": 54000, "k_back": 28000, "c": 0.016}
    known |= {"G_front": 0.0016, "G_back": 0.0004, "P_d": 0.016, "P_low": 0, "mu": 0.23}
    device = cs.scenes.prototype.PhysicalParameters(**known, mu_back=0.23, duty=0.4, Omega=130)
    ranges = {"Omega": (100.0, 200.0), "duty": (0.2, 0.5)}
    axes = tuple(
        cs.inputs.Axis.of_device(device, name, np.linspace(*ranges[name], 3)) for name in order
    )
    cs.run_sweep(cs.inputs.Sweep(axes, device=device), tmp_path / "grid")
    unit = device.natural_frequency
    ends = [{"omega": o / unit, "D": d, "si": {"Omega [rad/s]": o, "duty": d}}
            for o, d in ((100.0, 0.3), (150.0, 0.35), (200.0, 0.4))]  # fmt: skip
    curve = {"type": "edge", "points": [ends[0], ends[2]], "codimension_two": [ends[1]]}
    with cs.results.open_results(tmp_path / "grid") as results:
        figure = cs.figures.plot_chart(results, [curve])
        line, point = figure.axes[0].lines
        expected = {"Omega": [100.0, 200.0], "duty": [0.3, 0.4]}
        assert [list(line.get_xdata()), list(line.get_ydata())] == [expected[o] for o in order]
        middle = {"Omega": [150.0], "duty": [0.35]}
        assert [list(point.get_xdata()), list(point.get_ydata())] == [middle[o] for o in order]
        other = {"type": "edge", "points": [{"alpha": 1.0, "omega": 2.0}], "codimension_two": []}
        with pytest.raises(InvalidInput, match=r"curve = \['alpha', 'omega'\]: must be of "):
            cs.figures.plot_chart(results, [other])


def test_the_phase_of_a_dimensionless_start_has_no_unit(tmp_path: Path) -> None:
    starts = cs.inputs.Axis.linear("x_r", -1.0, 1.0, 2), cs.inputs.Axis.linear("phase", 0.0, 6.0, 2)
    compute = ("itinerary", "progression", "final")
    cs.run_basin(cs.inputs.Sweep(starts, Parameters(), compute=compute), tmp_path / "basin")
    with cs.results.open_results(tmp_path / "basin") as results:
        assert cs.figures.plot_basin(results).axes[0].get_ylabel() == r"phase $\tau$"


def test_json_says_what_was_drawn(stores: Path, tmp_path: Path) -> None:
    line = ["figure", str(stores / "basin"), "--out", "x.png", "--dpi", "30", "--json"]
    done = run_here(*line, cwd=tmp_path)
    size = (tmp_path / "x.png").stat().st_size
    told = {"files": [{"path": "x.png", "bytes": size}]}
    assert (json.loads(done.stdout), done.stderr) == (told, "")


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["nowhere"], "nowhere"),
        (["STORE", "--curve", "none.json"], "'--curve': Path 'none.json' does not exist"),
        (["BASIN", "--curve", "c.json"], "--curve is for sweeps over two parameters, not "),
        (["PACE", "--of", "speed", "--curve", "c.json"], "--curve is for sweeps over two"),
        (["LINE"], "give --of, a metric that the sweep has: none; compute progression"),
        (["PACE"], "give --of, a metric that the sweep has: velocity, speed, progression"),
    ],
)
def test_bad_input_is_one_line(stores: Path, tmp_path: Path, arguments, part) -> None:
    named = {"STORE": "grid", "LINE": "line", "ROW": "row", "PACE": "pace", "BASIN": "basin"}
    (tmp_path / "c.json").write_text('{"curves": []}')
    given = [str(stores / named[one]) if one in named else one for one in arguments]
    done = run_here("figure", *given, "--out", "x.png", cwd=tmp_path)
    assert done.returncode == 2
    assert part in done.stderr
    assert done.stderr.count("\n") == 1
