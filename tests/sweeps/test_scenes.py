"""Sweeps of scenes other than the paper's: their axes, plans and stores."""

from pathlib import Path

import numpy as np
import pytest

from capsule_sym import InvalidInput, run_basin, run_sweep, scenes, simulate_many, solve_orbit
from capsule_sym._sweeps import itineraries
from capsule_sym._sweeps.results import Held
from capsule_sym.inputs import Axis, Sweep, read_plan
from capsule_sym.results import open_results

SLOPE = scenes.slope


def of_slope(axis: Axis) -> Sweep:
    return Sweep((axis,), SLOPE.Parameters())


def test_an_axis_has_the_names_and_ranges_of_its_scene() -> None:
    (axis,) = of_slope(Axis.linear("s", -0.1, 0.1, 3)).axes
    assert axis.values[:, 0].tolist() == [-0.1, 0.0, 0.1]
    with pytest.raises(InvalidInput, match=r"^axis = 's': must be one of alpha, .*, phase$"):
        Sweep((axis,))
    with pytest.raises(InvalidInput, match=r"^axis = 'f_b': must be .* \(scene slope\)$"):
        of_slope(Axis.of("f_b", [1.0]))
    with pytest.raises(InvalidInput, match=r"^f_plus = 0\.0: must be a number in \[1e-10, 1e\+10"):
        of_slope(Axis.of("f_plus", [0.0]))
    (drawn,) = of_slope(Axis.sobol({"s": [-1, 0], "f_plus": [1, 2]}, 4, 0)).axes
    assert drawn.quantities == ("s", "f_plus")


def test_a_sweep_takes_axes_of_its_own_scene_alone() -> None:
    axes = Axis.of("alpha", [0.5, 0.6]), Axis.of("f_minus", [0.8])
    rows, states, phases = Sweep(axes, SLOPE.Parameters(s=-0.1)).columns()
    assert rows.shape == (2, 9)
    assert states.shape == (2, 3)
    assert phases.tolist() == [0.0, 0.0]
    for row, alpha in zip(rows, (0.5, 0.6), strict=True):
        expected = SLOPE.Parameters(alpha=alpha, f_minus=0.8, s=-0.1)
        assert SLOPE.Parameters(*row.tolist()) == expected
    with pytest.raises(InvalidInput, match=r"^axis = 'f_minus': must be one of alpha"):
        Sweep(axes)
    with pytest.raises(InvalidInput, match=r"^axis = 'f_b': must be .* \(scene slope\)"):
        Sweep((Axis.of("f_b", [1.0]),), SLOPE.Parameters())


PLAN = """scene = "slope"
periods = 20
[parameters]
s = -0.05
[axes]
f_plus = [1.0, 1.2]
s_ = { sobol = { alpha = [0.4, 0.9] }, count = 4, seed = 1 }
"""


def test_a_plan_names_its_scene(tmp_path: Path) -> None:
    (tmp_path / "plan.toml").write_text(PLAN)
    read = read_plan(tmp_path / "plan.toml")
    assert read.parameters == SLOPE.Parameters(s=-0.05)
    assert [axis.quantities for axis in read.axes] == [("f_plus",), ("alpha",)]
    (tmp_path / "plan.toml").write_text(PLAN.replace('"slope"', '"capsule"'))
    with pytest.raises(InvalidInput, match=r"^parameters = 's': must be one of alpha"):
        read_plan(tmp_path / "plan.toml")
    with pytest.raises(InvalidInput, match=r"^scene = 'jog': must be capsule, "):
        read_plan({"scene": "jog", "axes": {"alpha": [1.0]}})


def test_a_plan_has_a_device_of_its_scene() -> None:
    device = {"M_m": 1, "M_c": 3, "k1": 1, "k2": 1, "c": 0, "G": 0, "P_d": 1, "Omega": 1}
    plan = {
        "scene": "slope",
        "device": device | {"mu": 0.1, "mu_back": 0.2, "slope": 0.1},
        "axes": {"P_d": [1.0, 2.0]},
    }
    read = read_plan(plan)
    assert read.device is not None
    assert read.device.slope == 0.1
    alphas = [read.device.replace(P_d=force).dimensionless().alpha for force in (1.0, 2.0)]
    np.testing.assert_allclose(read.axes[0].values[:, 0], alphas, rtol=1e-15)
    with pytest.raises(InvalidInput, match=r"^device = 'slop': must be .* \(scene slope\)"):
        read_plan(plan | {"device": device | {"slop": 0.1}})


def test_a_store_goes_on_with_its_scene_alone(tmp_path: Path) -> None:
    axis = Axis.linear("alpha", 0.4, 0.9, 3)
    run_sweep(Sweep((axis,), SLOPE.Parameters(), periods=5), tmp_path / "store")
    assert Held(tmp_path / "store").head["sweep"]["scene"] == "slope"
    with pytest.raises(InvalidInput, match=r"^scene = 'capsule': must be 'slope', as in "):
        run_sweep(Sweep((axis,), periods=5), tmp_path / "store", resume=True)


@pytest.mark.parametrize("name", ["slope", "reaction", "reaction_pulse"])
def test_orbits_of_cells_are_those_of_the_map(name: str, tmp_path: Path) -> None:
    scene = scenes.load(name)
    axis, compute = Axis.linear("alpha", 0.9, 1.4, 4), ("itinerary", "multipliers", "energies")
    given = Sweep((axis,), scene.Parameters(), periods=300, compute=compute)
    run_sweep(given, tmp_path / "store")
    with open_results(tmp_path / "store") as results:
        assert results.attrs["scene"] == name
        for cell in range(4):
            one = results.isel(alpha=cell)
            orbit = solve_orbit(scene.Parameters(alpha=float(one["alpha"])))
            if not orbit.success or not int(one["period_number"]):
                continue
            texts = itineraries.texts(results)
            found = itineraries.text(orbit.itinerary.fields, scene)
            assert texts[int(one["itinerary"])] == found
            assert float(one["velocity"]) == pytest.approx(float(orbit.average_velocity), abs=1e-9)


def test_basins_of_a_slope_have_closed_attractors(tmp_path: Path) -> None:
    axes = Axis.linear("x_r", -1, 1, 4), Axis.linear("v_r", -1, 1, 3)
    _, found = run_basin(Sweep(axes, SLOPE.Parameters(alpha=0.8)), tmp_path / "store")
    assert sum(one.fraction for one in found.attractors) == pytest.approx(1.0)
    assert all(one.orbit.residual < 1e-10 and one.multiplier < 1 for one in found.attractors)


def test_a_duty_cycle_of_a_whole_period_is_refused_by_its_range_with_all_digits() -> None:
    allowed = r"D = 1\.0: must be (a number )?in \[1e-09, 0\.999999999\] for a run"
    with pytest.raises(InvalidInput, match=allowed):
        Sweep((Axis.linear("D", 0.5, 1.0, 2),), scenes.prototype.Parameters())
    rows = np.array([list(scenes.prototype.Parameters().to_dict().values())])
    rows[0, scenes.prototype.facts.PARAMETERS.index("D")] = 1.0
    with pytest.raises(InvalidInput, match=allowed):
        simulate_many(rows, scene=scenes.prototype)
