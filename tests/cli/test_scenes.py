"""Scene of a line: from its options, its file, and refusals in one line."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from capsule_sym import InvalidInput, load_parameters, results, scenes
from capsule_sym._commands.options import scene_of

Command = Callable[..., CompletedProcess[str]]

_DEVICE = "M_m=1\nM_c=3\nk1=1\nk2=1\nc=0\nG=0\nP_d=1\nOmega=1\nmu=0.1\nmu_back=0.2\n"
_PULSED = (
    "M_m=1.8e-3\nM_c=1.7e-3\nk1=62\nk_front=54e3\nk_back=28e3\nc=0.016\nG_front=1.6e-3\n"
    "G_back=4e-4\nP_d=0.016\nP_low=0\nduty=0.4\nOmega=130\nmu=0.23\nmu_back=0.23\n"
)
_FILES = {
    "slope.toml": "scene = 'slope'\ns = 0.1\n",
    "plain.toml": "\ufeffalpha = 0.5\n",  # with the mark of byte order of some editors
    "plan.toml": "\ufeff[axes]\nalpha = [0.5]\n",
    "a.json": '{"format": 4, "bifurcations": []}',
    "capsule.toml": "scene = 'capsule'\nalpha = 0.5\n",
    "of_another.toml": "f_b = 1.0\nscene = 'slope'\n",
    "of_slope.toml": "f_plus = 1.0\n",
    "nowhere.toml": "scene = 'nowhere'\n",
    "number.toml": "scene = 1\n",
    "device.toml": f"scene = 'slope'\nslope = -0.05\n{_DEVICE}",
    "steep.toml": f"scene = 'slope'\nslope = -1.5\n{_DEVICE}".replace("mu=0.1", "mu=0.3"),
    "duty.toml": f"scene = 'prototype'\n{_PULSED}".replace("0.4", "35"),
    "preload.toml": f"scene = 'prototype'\npreload = 0.05\n{_PULSED}",
    "part.toml": "scene = 'slope'\nM_m = 1\nslope = 0.1\n",
    "mixed.toml": f"scene = 'slope'\ns = 0.1\n{_DEVICE}",
}
_KNOWN = ", ".join(scenes.SHIPPED)


@pytest.fixture
def files(tmp_path: Path) -> Path:
    for name, text in _FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


REFUSED = [
    ("run --scene nowhere", f"--scene = 'nowhere': must be {_KNOWN}, or a folder that"),
    ("run --scene=", f"--scene = '': must be {_KNOWN}, or a folder that"),
    ("run --params nowhere.toml", f"scene = 'nowhere': must be {_KNOWN}, or a folder that"),
    ("run --params number.toml", f"scene = 1: must be {_KNOWN}, or a folder that"),
    ("run --scene slope --f-b 1", "No such option '--f-b'"),
    ("run --params duty.toml", "duty = 35.0: must be such that D, the duty cycle, is in [1e-09,"),
    (
        "run --params preload.toml",
        "preload = 0.05: must be such that delta_2, the gap behind, is finite and >= 0",
    ),
    (
        "run --params steep.toml",
        "slope = -1.5: must be such that f_plus, the friction bound forward, is finite and > 0",
    ),
    ("run --params plain.toml --s 0.1", "No such option '--s'"),
    (
        "run --params of_another.toml",
        "parameter = 'f_b': must be one of alpha, omega, delta, zeta, beta, gamma, s, f_plus, "
        "f_minus, or of M_m, M_c, k1, k2, c, G, P_d, Omega, mu, mu_back, g, slope (scene slope)",
    ),
    ("run --scene slope --params capsule.toml", "--scene = 'slope': must be capsule, as in caps"),
    ("run --scene capsule --params slope.toml", "--scene = 'capsule': must be slope, as in slop"),
    (
        "run --params part.toml",
        "--params = 'part.toml': must be a whole device, with M_c, k1, k2, c, G, P_d, Omega, mu, "
        "mu_back too (scene slope)",
    ),
    ("run --params mixed.toml", "s = 0.1: must be absent where M_m is given in SI units"),
    ("run --params device.toml --s 0.1", "s = 0.1: must be absent if device.toml is in SI"),
    ("branch --scene slope --f-b 1:2", "No such option '--f-b'"),
    ("branch --restart a.json PD1 --to 2 --scene slope", "--scene = 'slope': must be capsule, as"),
    ("sweep plan.toml --out s --scene slope", "--scene = 'slope': must be capsule, as in plan"),
]


@pytest.mark.parametrize(("line", "told"), REFUSED)
def test_what_contradicts_a_scene_is_refused_in_one_line(line, told, inside, files) -> None:
    done = inside(*line.split(), cwd=files)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    assert told in done.stderr


@pytest.mark.parametrize("name", scenes.SHIPPED)
def test_help_lists_the_parameters_of_the_line_s_scene_alone(name: str, inside: Command) -> None:
    facts = {one: set(scenes.load(one).facts.PARAMETERS) for one in scenes.SHIPPED}
    every = set().union(*facts.values())
    for command in ("run", "branch", "optimise"):
        shown = inside(command, "--scene", name, "--help").stdout
        listed = {
            one for one in every if re.search(rf"^  --{one.replace('_', '-')}\b(?!-)", shown, re.M)
        }
        assert listed == facts[name], command


def test_the_overview_says_which_scenes_there_are(inside: Command) -> None:
    assert f"Scenes: {_KNOWN}." in inside("--help").stdout


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("", "capsule"),
        ("--scene slope", "slope"),
        ("--scene=slope", "slope"),
        ("--scene capsule --scene slope", "slope"),
        ("--scene=slope --scene capsule", "capsule"),
        ("--params slope.toml --s 0.2", "slope"),
        ("--params=slope.toml", "slope"),
        ("--params slope.toml --scene capsule", "capsule"),
        ("--params none.toml", "capsule"),
        ("--params nowhere.toml", "capsule"),
        ("-- --scene slope", "capsule"),
        ("--scene", "capsule"),
    ],
)
def test_a_line_has_a_scene(words, name, files, monkeypatch) -> None:
    monkeypatch.chdir(files)
    assert scene_of(words.split()).name == name


def test_a_file_has_parameters_of_its_scene(files: Path) -> None:
    slope = scenes.load("slope")
    assert load_parameters(files / "slope.toml") == slope.Parameters(s=0.1)
    assert load_parameters(files / "capsule.toml").scene is scenes.load("capsule")
    device = load_parameters(files / "device.toml")
    assert device.slope == -0.05
    assert device == slope.PhysicalParameters(**device.to_dict())
    with pytest.raises(InvalidInput, match=r"^scene = 'nowhere': must be "):
        scenes.load("nowhere")


def test_commands_follow_orbits_in_a_parameter_of_the_scene(inside: Command, files: Path) -> None:
    line = "branch --params slope.toml --alpha 0.8 --s -0.05:0.02 --points 8 --out found --json"
    done = inside(*line.split(), cwd=files)
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert (record["scene"], record["parameter"]) == ("slope", "s")
    assert [point["value"] for point in (record["points"][0], record["points"][-1])] == [
        -0.05,
        0.02,
    ]
    again = inside(
        *["branch", "--restart", "found/branch.json", "EP2", "--to", "0.03", "--json"], cwd=files
    )
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["points"][-1]["parameters"]["s"] == 0.03
    run = inside(
        *["run", "--params", "slope.toml", "--alpha", "0.8", "--periods", "5", "--json"], cwd=files
    )
    assert json.loads(run.stdout)["scene"] == "slope"
    assert "scene" not in json.loads(inside("run", "--periods", "2", "--json").stdout)


@pytest.mark.long
def test_a_sweep_over_options_is_of_the_scene_of_its_line(command: Command, tmp_path: Path) -> None:
    line = f"sweep --scene prototype --D 0.2:0.4:2 --periods 3 --out {tmp_path / 'store'}"
    assert command(*line.split()).returncode == 0
    assert results.open_results(tmp_path / "store").attrs["scene"] == "prototype"


def test_stops_that_overlap_are_refused_in_one_line(command: Command) -> None:
    done = command(*["run", "--scene", "prototype", "--delta-1", "0", "--delta-2", "0"])
    assert (done.returncode, done.stdout) == (2, "")
    assert "delta_1 + delta_2 = 0.0: must be > 0, or the stops overlap" in done.stderr
