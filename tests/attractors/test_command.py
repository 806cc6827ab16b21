"""The command `attractors`, and the picture of what it follows."""

import csv
import json
import re

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from capsule_sym import attractors, continue_attractors, load_parameters, plot
from capsule_sym._cli import main
from capsule_sym.inputs import device_path
from tests.attractors.test_attractors import BOX
from tests.attractors.test_destinations import BISTABLE

DEVICE = "M_m=0.5\nM_c=1.65\nk1=50\nk2=75\nc=0.5\nG=0.0017\nP_d=6\nOmega=8\nmu=0.2\n"
SYSTEM = ("--alpha", "2.8", "--omega", "0.4", "--zeta", "0.01", "--beta", "5", "--gamma", "5")


@pytest.fixture
def call(capfd):
    def run(*arguments: str):
        with pytest.raises(SystemExit) as done:
            main(["attractors", *arguments])
        shown = capfd.readouterr()
        return done.value.code, shown.out, shown.err.splitlines()

    return run


def test_it_prints_what_the_function_finds(call) -> None:
    box = ("--x-r", "-2:2", "--v-r", "-2:2", "--starts", "50")
    status, out, err = call(*SYSTEM, *box)
    assert (status, err) == (0, [])
    assert "50 starts lead to 2 attractors" in out
    assert repr(attractors(BISTABLE, BOX, count=50)).startswith("<Attractors: 50 starts lead to 2")
    status, out, _ = call(*SYSTEM, *box, "--json")
    assert json.loads(out) == json.loads(json.dumps(attractors(BISTABLE, BOX, count=50).to_dict()))


def test_along_a_parameter_it_writes_table_record_and_picture(call, tmp_path) -> None:
    box = ("--x-r", "-2:2", "--v-r", "-2:2", "--starts", "30", "--out", str(tmp_path / "out"))
    status, out, err = call(*SYSTEM, *box, "--alpha", "2.1:2.2:3")
    assert status == 0
    head = next(line for line in out.splitlines() if line.startswith("alpha "))
    assert head.split()[:2] == ["alpha", "attractor"]
    assert "2.14808" in out
    assert "2.1 to 2.2" in out
    assert err[0].startswith("wrote ")
    with (tmp_path / "out" / "attractors.csv").open() as table:
        rows = list(csv.DictReader(table))
    record = json.loads((tmp_path / "out" / "attractors.json").read_text())
    assert sum(int(row["count"]) for row in rows) + sum(record["unsettled"]) == 90
    assert (tmp_path / "out" / "attractors.svg").stat().st_size > 0


def test_along_a_quantity_of_a_device(call, tmp_path) -> None:
    file = tmp_path / "device.toml"
    file.write_text(DEVICE)
    system = ("--params", str(file), "--x-r", "-1:1", "--starts", "5")
    status, out, _ = call(*system, "--P-d", "3:6:2", "--json")
    record = json.loads(out)
    assert (status, record["parameter"], record["values"]) == (0, "P_d", [3.0, 6.0])
    assert record["message"] == "1 attractor at 2 values of P_d"
    how = {"count": 1, "ties": device_path(load_parameters(file), "P_d")}
    along = continue_attractors(load_parameters(file).dimensionless(), "P_d", [3, 6], BOX, **how)
    assert plot(along).axes[0].get_xlabel() == "$P_d$ (N)"
    (one,), device = record["attractors"], load_parameters(file)
    metres = [device.replace(P_d=3.0).scale("x_r") * value for value in one["progression"]]
    assert one["si"] == {"progression [m]": pytest.approx(metres, rel=1e-15)}
    status, out, _ = call(*system)
    (table,) = re.findall(r"attractors\n(.*)─\n", out, re.DOTALL)
    assert sorted(table.strip("─\n ").split()).count("progression") == 2  # one of them in metres
    assert "[m]" in table
    assert f"{metres[1]:.6g}" in out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((), "give a range of starts"),
        (("--x-r", "1:1"), "extent"),
        (("--x-r", "0:1", "--starts", "0"), "--starts"),
        (("--x-r", "0:1", "--alpha", "1:2:3", "--beta", "1:2:3"), "only parameter with a range"),
        (("--x-r", "0:1", "--alpha", "1:2:0"), "'1:2:0' has COUNT = 0: must be 1 or more"),
        (("--x-r", "0:1", "--alpha", "1:2:1000000000"), "COUNT of alpha = 1000000000: must be a"),
        (("--x-r", "0:1", "--alpha", "2:1:3"), "ascending"),
        (("--x-r", "0:1", "--alpha", "1:2"), "LOW:HIGH:COUNT"),
        (("--phase", "0:100"), "phases = 50.0: must be times in"),
    ],
)
def test_bad_input_is_one_line(call, arguments, told) -> None:
    status, out, err = call(*arguments)
    assert (status, out, len(err)) == (2, "", 1)
    assert told in err[0]


def test_attractors_beside_each_other_look_different(monkeypatch) -> None:
    monkeypatch.setattr("capsule_sym._figures.attractors.AREAS", ("#88ccee",))
    found = continue_attractors(BISTABLE, "alpha", [2.2, 2.3, 2.4], BOX, count=30, periods=2048)
    (axes,) = plot(found).axes
    areas = [one for one in axes.collections if isinstance(one, PolyCollection)]
    assert len({one.get_hatch() for one in areas}) == len(areas) == 2


def test_areas_of_the_picture_are_the_fractions() -> None:
    found = continue_attractors(BISTABLE, "alpha", [2.2, 2.3, 2.4], BOX, count=30, periods=2048)
    (axes,) = plot(found).axes
    areas = [one for one in axes.collections if isinstance(one, PolyCollection)]
    assert len(areas) == len(found.branches) == 2
    for area, branch in zip(areas, found.branches, strict=True):
        (path,) = area.get_paths()
        at = path.vertices[np.isclose(path.vertices[:, 0], 2.3), 1]
        assert np.ptp(at) == pytest.approx(branch.fractions[1])
