"""Figures of a device: in SI units throughout, or with a word that they are dimensionless."""

from __future__ import annotations

import math
import re
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._figures.curves import plot_curves
from tests.figures import DEVICE
from tests.figures.test_branches import SMALL
from tests.figures.test_layout import crowd, swept

FORCE = 0.2 * (0.02 + 0.05) * 9.81  # N
LENGTH = FORCE / 40.0  # m
RATE = math.sqrt(40.0 / 0.02)  # 1/s


@pytest.fixture(scope="module")
def run():
    return cs.simulate(DEVICE.dimensionless(), periods=64)


def test_a_motion_is_in_seconds_and_millimetres(run) -> None:
    left, right = cs.figures.plot_motion(run, device=DEVICE).axes
    assert (left.get_xlabel(), left.get_ylabel()) == ("time (s)", "displacements (mm)")
    assert right.get_xlabel() == "relative displacement (mm)"
    assert right.get_ylabel() == "relative velocity (m/s)"
    time, way = left.lines[-1].get_data()
    assert time[-1] == pytest.approx(3 * 2 * math.pi / 36.0)
    assert way[-1] == pytest.approx(3 * run.steady().progression * LENGTH * 1e3)
    state = np.array(run.final[1])
    drawn = np.concatenate([line.get_xydata() for line in right.lines if line.get_zorder() == 3])
    ends = state[:2] * (LENGTH * 1e3, LENGTH * RATE)
    assert np.abs(drawn - ends).min(axis=0) == pytest.approx((0, 0), abs=1e-9)
    (wall,) = {line.get_xdata()[0] for line in right.lines if line.get_label() in ("L6", "L7")}
    assert wall == pytest.approx(0.4)  # the gap in mm


def test_a_motion_is_that_of_the_device(run) -> None:
    other = cs.simulate(DEVICE.dimensionless().replace(omega=1.6), periods=4)
    for draw in (cs.figures.plot_motion, cs.figures.plot_margins):
        with pytest.raises(
            cs.InvalidInput, match=r"omega = 1\.6: must be 0\.80.*, as of the device"
        ):
            draw(other, device=DEVICE)
    with pytest.raises(cs.InvalidInput, match="parameter = 'gamma': must be one of alpha, omega"):
        cs.figures.plot_bifurcations({**SMALL, "parameter": "gamma"}, device=DEVICE)


def test_guards_are_in_si_units(run) -> None:
    bar, gap, velocity, force = cs.figures.plot_margins(run, device=DEVICE).axes
    labels = [axes.get_ylabel() for axes in (gap, velocity, force)]
    assert labels == ["gap (mm)", "capsule velocity (m/s)", "force (N)"]
    bounds = [line.get_ydata()[0] for line in force.lines if line.get_linestyle() == "--"]
    assert bounds == pytest.approx([FORCE, -FORCE])
    assert len(bar.texts) >= 2
    x_r = np.concatenate([line.get_ydata() for line in gap.lines if line.get_linestyle() == "-"])
    assert x_r[-1] == pytest.approx(float(run.final[1][0]) * LENGTH * 1e3 - 0.4)


def test_branches_are_in_si_units() -> None:
    plain = {**SMALL, "parameter": "alpha"}
    figure = cs.figures.plot_bifurcations(plain, device=DEVICE)
    x_r, v_r, velocity = figure.axes
    assert velocity.get_xlabel() == "excitation amplitude (N)"
    assert x_r.get_ylabel().replace("\n", " ") == "strobed displacement (mm)"
    assert velocity.get_xlim() == pytest.approx((FORCE * 1.0, FORCE * 1.3))
    assert x_r.lines[0].get_ydata()[0] == pytest.approx(0.1 * LENGTH * 1e3)
    assert v_r.lines[0].get_ydata()[0] == pytest.approx(0.2 * LENGTH * RATE)
    assert velocity.lines[0].get_ydata()[0] == pytest.approx(0.5 * LENGTH * RATE)
    key = figure.legends[1].get_texts()[1].get_text()
    assert key == f"LP1  fold, {1.16 * FORCE:.6f} N"
    upper, _ = cs.figures.plot_energies(plain, device=DEVICE).axes
    assert upper.get_ylabel() == "energy per period (mJ)"
    (work,) = [line for line in upper.lines if line.get_label() == "work of the drive"]
    assert work.get_ydata()[0] == pytest.approx(3.0 * FORCE * LENGTH * 1e3)


def test_a_branch_is_that_of_the_device(run) -> None:
    own = DEVICE.dimensionless()
    (first, *rest) = SMALL["points"]
    for field, draw in (
        ("gamma", cs.figures.plot_bifurcations),
        ("omega", cs.figures.plot_energies),
        ("f_b", lambda record, device: cs.figures.plot_itineraries([run], record, device=device)),
    ):
        known = own.replace(**{field: 3.5}).to_dict()
        record = {**SMALL, "parameter": "alpha", "points": [{**first, "parameters": known}, *rest]}
        with pytest.raises(cs.InvalidInput, match=rf"{field} = 3\.5: must be .*, as of the device"):
            draw(record, device=DEVICE)
    other = cs.simulate(own.replace(gamma=4.0), periods=64)
    with pytest.raises(cs.InvalidInput, match=r"gamma = 4\.0"):
        cs.figures.plot_itineraries([run, other], {**SMALL, "parameter": "alpha"}, device=DEVICE)


def test_itineraries_are_over_the_force(run) -> None:
    other = cs.simulate(DEVICE.dimensionless().replace(alpha=1.0), periods=64)
    record = {**SMALL, "parameter": "alpha"}
    axes = cs.figures.plot_itineraries([run, other], record, device=DEVICE).axes[0]
    assert axes.get_xlim() == pytest.approx((0.12, FORCE))
    assert axes.get_xlabel() == "excitation amplitude (N)"
    assert axes.lines[0].get_xdata()[0] == pytest.approx(1.15 * FORCE)


def test_curves_without_units_say_so() -> None:
    curves = plot_curves({"curves": crowd()["curves"][:1]})
    assert curves.legends[1].get_texts()[-1].get_text() == "all quantities are dimensionless"


def test_sweeps_of_a_device_are_in_si_units() -> None:
    results = swept()
    results["velocity"].attrs = {"si_units": "m/s", "si_scale": 0.5}
    results["progression"] = results["velocity"].assign_attrs(si_units="m", si_scale=0.25)
    axes = cs.figures.plot_pareto(results).axes[0]
    assert axes.get_ylabel() == "speed (m/s)"
    assert set(axes.lines[0].get_ydata()) == {0.5}
    starts = results.rename(alpha="x_r", gamma="v_r")
    starts["x_r"].attrs = {"si_units": "m", "si_scale": 0.25}
    starts["v_r"].attrs = {"si_units": "m/s", "si_scale": 0.002}
    (basin,) = cs.figures.plot_basin(starts).axes
    assert basin.get_xlabel() == "relative displacement (m)"
    assert basin.get_ylabel() == "relative velocity (mm/s)"
    assert basin.get_xlim() == pytest.approx((-0.25 / 23, 0.5 + 0.25 / 23))
    (chart,) = cs.figures.plot_chart(results.rename(alpha="P_d", gamma="Omega")).axes
    assert (chart.get_xlabel(), chart.get_ylabel()) == ("$P_d$ (N)", r"$\Omega$ (rad/s)")


def test_the_command_takes_the_device_of_its_file(tmp_path: Path) -> None:
    from tests.figures.test_command import run_here

    lines = [f"{name} = {value}" for name, value in asdict(DEVICE).items()]
    (tmp_path / "device.toml").write_text("\n".join(lines))
    arguments = ["figure", "motion", "--params", "device.toml", "--out", "motion.svg"]
    assert run_here(*arguments, cwd=tmp_path).returncode == 0
    # Texts are paths, under comments that tell them.
    told = re.findall(r"<!-- (.*?) -->", (tmp_path / "motion.svg").read_text(encoding="utf-8"))
    assert "displacements (mm)" in told
