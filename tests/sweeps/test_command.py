"""The commands `sweep` and `basin`."""

import json
import os
import re
import sys
from pathlib import Path

import pytest

from capsule_sym._cli import main
from capsule_sym.results import open_results

FILE = """
periods = 40
compute = ["itinerary", "progression"]
[axes]
alpha = { from = 0.01, to = 2.0, count = 9 }
gamma = { from = 1.0, to = 5.0, count = 9, spacing = "log" }
"""
BASIN = ["basin", "--x-r", "-1:1:3", "--v-r", "-1:1:4", "--periods", "200"]


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "chart.toml"
    path.write_text(FILE)
    return str(path)


def said(capsys: pytest.CaptureFixture[str], arguments: list[str], status: int = 0) -> str:
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    captured = capsys.readouterr()
    assert exit_.value.code == status, captured.err
    return captured.out if status == 0 else captured.err


def test_a_sweep_is_run_and_told(file, tmp_path, capsys) -> None:
    store = str(tmp_path / "store")
    line = ["sweep", file, "--out", str(tmp_path / "other"), "--workers", "1", "--json"]
    record = json.loads(said(capsys, line))
    rate = record["computed"] * 40 / record["seconds"] / record["workers"]
    assert record["periods_per_second_and_core"] == pytest.approx(rate)
    assert (record["computed"], record["damaged"], record["workers"]) == (81, 0, 1)
    text = said(capsys, ["sweep", file, "--out", store])
    for expected in ("axes", "periods per second and core", "converged", "F5"):
        assert expected in text
    record = json.loads(said(capsys, ["sweep", "--info", store, "--json"]))
    assert (record["cells"], record["done"]) == (81, 81)
    assert sum(record["outcomes"].values()) == 81
    assert [axis["name"] for axis in record["axes"]] == ["alpha", "gamma"]
    assert record["provenance"]["versions"]["capsule-sym"]
    with open_results(store) as results:
        assert sum(record["itineraries"].values()) == int((results["period_number"] > 0).sum())
    assert re.search("^done +81 *$", said(capsys, ["sweep", "--info", store]), re.M)


def test_a_store_may_have_brackets_and_colons_in_its_name(tmp_path, capsys, monkeypatch) -> None:
    store = str(tmp_path / "a[/b][red]:cat:")
    line = ["sweep", "--alpha", "0.1:0.2:2", "--periods", "2", "--out", store]
    monkeypatch.setattr(sys, "argv", ["capsule-sym", *line])
    assert store in "".join(said(capsys, line).split())
    assert store in "".join(said(capsys, ["sweep", "--info", store]).split())


def test_help_shows_a_file_line_by_line(capsys: pytest.CaptureFixture[str]) -> None:
    lines = [line.strip() for line in said(capsys, ["sweep", "--help"]).splitlines()]
    assert "omega = 0.8" in lines
    assert 'compute = ["itinerary", "progression"]' in lines


def test_a_basin_tells_its_attractors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [*BASIN, "--alpha", "1.2", "--out", str(tmp_path / "store")]
    record = json.loads(said(capsys, [*arguments, "--json"]))
    (only,) = record["attractors"]
    assert (only["itinerary"], only["period_number"]) == ("F5 F4 F1 F2 F3 F2", 1)
    assert (only["number"], only["fraction"]) == (0, 1.0)
    # The progression that the README prints for this motion.
    assert only["progression"] == pytest.approx(1.339272935, abs=1e-9)
    assert "attractors\n" in said(capsys, [*arguments, "--resume"])
    shown = json.loads(said(capsys, ["sweep", "--info", str(tmp_path / "store"), "--json"]))
    assert shown["attractors"] == record["attractors"]
    assert "attractors\n" in said(capsys, ["sweep", "--info", str(tmp_path / "store")])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["sweep", "FILE", "--out", "STORE"], "to continue it use --resume"),
        (["sweep", "none.toml", "--out", "new"], "must be readable"),
        (["sweep", "FILE", "--out", "STORE", "--resume", "--workers", "0"], "workers = 0"),
        (["sweep", "FILE"], "--out"),
        (["sweep", "FILE", "--info", "STORE"], "FILE.toml and --info exclude each other"),
        (["sweep", "--info", "STORE", "--resume"], "--resume and --info exclude each other"),
        (["basin", "--out", "new"], "give a range of starts"),
        (["sweep", "--out", "new"], "give a range"),
        (["sweep", "--out", "new", "--alpha", "0.1:2"], "is not LOW:HIGH:COUNT"),
        (["sweep", "--out", "new", "--alpha", "0.1:2:3", "--compute", "x"], "compute = 'x'"),
        (["sweep", "FILE", "--out", "new", "--periods", "3"], "--periods and FILE.toml exclude"),
        (["sweep", "FILE", "--out", "new", "--alpha", "0.1:2:3"], "--alpha and FILE.toml exclude"),
        (["sweep", "--info", "nowhere"], "a directory that holds a sweep"),
    ],
)
def test_bad_input_ends_with_2_and_says_what_is_allowed(
    arguments, message, file, tmp_path, capsys, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    store = str(tmp_path / "store")
    said(capsys, ["sweep", file, "--out", store])
    given = [file if a == "FILE" else store if a == "STORE" else a for a in arguments]
    assert message in said(capsys, given, status=2)


@pytest.mark.parametrize("more", [[], BASIN], ids=["sweep", "basin"])
def test_a_limit_of_time_ends_with_3_and_says_how_it_goes_on(more, file, tmp_path, capsys) -> None:
    line = more if more == BASIN else ["sweep", file, *more]
    line = [*line, "--out", str(tmp_path / "store")]
    assert "continue with --resume" in said(capsys, [*line, "--max-seconds", "1e-9"], status=3)
    with pytest.raises(SystemExit):
        main([*line, "--resume", "--max-seconds", "1e-9", "--json"])
    record = json.loads(capsys.readouterr().out)
    assert (record["success"], record["status"], record["computed"]) == (False, "time-limit", 0)
    assert json.loads(said(capsys, [*line, "--resume", "--json"]))["success"]


def test_a_run_that_cannot_write_ends_with_1(file, tmp_path, capsys, monkeypatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    text = said(capsys, ["sweep", file, "--out", str(tmp_path / "store")], status=1)
    assert "No space left on device" in text


VALUES = {"M_m": 0.5, "M_c": 1.65, "k1": 50.0, "k2": 75.0, "c": 0.5, "G": 0.0017}
VALUES |= {"P_d": 3.0, "Omega": 8.0, "mu": 0.2}
DEVICE = "".join(f"{name} = {value}\n" for name, value in VALUES.items())
FORCE = 0.2 * 2.15 * 9.81  # the friction that carries the device, in N


def test_a_basin_of_a_device_converts_to_its_units(tmp_path: Path, capsys) -> None:
    (tmp_path / "device.toml").write_text(DEVICE)
    store, ranges = str(tmp_path / "basin"), ["--x-r", "-1:1:2", "--v-r", "-1:1:2"]
    said(capsys, ["basin", "--params", str(tmp_path / "device.toml"), *ranges, "--out", store])
    with open_results(store) as results:
        length = FORCE / VALUES["k1"]
        for name in ("x_r", "progression"):
            about = results[name].attrs
            assert (about["si_units"], about["si_scale"]) == ("m", pytest.approx(length))


def test_ranges_are_axes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, one, other = (tmp_path / name for name in ("device.toml", "one", "other"))
    path.write_text(DEVICE)
    ask = ["--periods", "120", "--compute", "itinerary,energies"]
    newtons = ["--params", str(path), "--P-d", "2:4:3", "--Omega", "7.5:8.5:2"]
    said(capsys, ["sweep", *newtons, *ask, "--out", str(one)])
    plain = [f"--delta={50 * 0.0017 / FORCE!r}", "--gamma=3.3", "--zeta=0.05", "--beta=1.5"]
    ranges = ["--alpha", f"{2 / FORCE!r}:{4 / FORCE!r}:3", "--omega", "0.75:0.85:2"]
    said(capsys, ["sweep", *plain, *ranges, *ask, "--out", str(other)])
    with open_results(one) as si, open_results(other) as scaled:
        assert si["P_d"].values.tolist() == [2.0, 3.0, 4.0]
        assert si["P_d"].attrs["units"] == "N"
        assert si["alpha"].dims == ("P_d",)
        assert si["alpha"].values == pytest.approx(scaled["alpha"].values, rel=1e-14)
        assert (si["itinerary"].values == scaled["itinerary"].values).all()
        assert si["work"].values == pytest.approx(scaled["work"].values, rel=1e-9)
        about = si["work"].attrs
        assert (about["si_units"], about["si_scale"]) == ("J", pytest.approx(FORCE * FORCE / 50))
        assert "si_scale" not in scaled["work"].attrs
    # The same as a file, the device a table of it.
    text = f"periods = 120\ncompute = ['itinerary', 'energies']\n[device]\n{DEVICE}[axes]\n"
    text += "P_d = {from = 2.0, to = 4.0, count = 3}\nOmega = [7.5, 8.5]\n"
    (tmp_path / "plan.toml").write_text(text)
    line = ["sweep", str(tmp_path / "plan.toml"), "--out", str(one), "--resume", "--json"]
    told = json.loads(said(capsys, line))
    assert told["computed"] == 0
    ends = [(one["name"], one["first"], one["last"], one["unit"]) for one in told["axes"]]
    assert ends == [("P_d", [2.0], [4.0], "N"), ("Omega", [7.5], [8.5], "rad/s")]
