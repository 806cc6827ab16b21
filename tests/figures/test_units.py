"""Figures of a device: in SI units throughout, or with a word that they are dimensionless."""

from __future__ import annotations

import math

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._figures.curves import plot_curves
from tests.figures import DEVICE
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
    with pytest.raises(cs.InvalidInput, match=r"omega = 1\.6: must be 0\.80.*, as of the device"):
        cs.figures.plot_motion(other, device=DEVICE)


def test_curves_without_units_say_so() -> None:
    curves = plot_curves({"curves": crowd()["curves"][:1]})
    said = curves.legends[1].get_texts()[-1].get_text()
    assert said == "quantities without a unit are dimensionless"


def test_sweeps_of_a_device_are_in_si_units() -> None:
    results = swept()
    results["velocity"].attrs = {"si_units": "m/s", "si_scale": 0.5}
    starts = results.rename(alpha="x_r", gamma="v_r")
    starts["x_r"].attrs = {"si_units": "m", "si_scale": 0.25}
    starts["v_r"].attrs = {"si_units": "m/s", "si_scale": 0.002}
    (basin,) = cs.figures.plot_basin(starts).axes
    assert basin.get_xlabel() == "relative displacement (m)"
    assert basin.get_ylabel() == "relative velocity (mm/s)"
    assert basin.get_xlim() == pytest.approx((-0.25 / 23, 0.5 + 0.25 / 23))
    (chart,) = cs.figures.plot_chart(results.rename(alpha="P_d", gamma="Omega")).axes
    assert (chart.get_xlabel(), chart.get_ylabel()) == ("$P_d$ (N)", r"$\Omega$ (rad/s)")
