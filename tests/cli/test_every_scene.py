"""Every command in every scene, dimensionless and of a device: it works, or gives the reason."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest

from capsule_sym import load_parameters, scenes, simulate
from capsule_sym._cli import group

Command = Callable[..., CompletedProcess[str]]

_LARGE = "M_m=0.5\nM_c=1.65\nk1=50\nk2=75\nc=0.5\nG=0.0017\nP_d=6\nOmega=8\nmu=0.2\n"
DEVICES = {
    "capsule": _LARGE,
    "slope": f"{_LARGE}mu_back=0.25\n",
    "reaction": _LARGE,
    "reaction_pulse": f"{_LARGE}P_low=-2\nduty=0.5\n",
    "prototype": "M_m=1.8e-3\nM_c=1.7e-3\nk1=62\nk_front=54e3\nk_back=28e3\nc=0.016\n"
    "G_front=1.6e-3\nG_back=4e-4\nP_d=0.016\nP_low=0\nduty=0.4\nOmega=130\nmu=0.23\nmu_back=0.23\n",
}
SMALL = {"prototype": (0.016, 130.0)}
"""Drive and frequency of the devices that are not as the others."""

# Lines with motion in a scene: X is the varied value, over 2 % of it, Y the frequency.
RUNS = {
    "run": "--periods 20",
    "orbit": "",
    "shock": "--samples 100 --largest 0.01",
    "branch": "--X --points 2 --out branch",
    "sweep": "--X:2 --Y:2 --compute itinerary,energies,forces --periods 200 --out grid",
    "basin": "--x-r 0:0.1:2 --v-r 0:0.1:2 --periods 50 --out basin",
    "attractors": "--x-r 0:0.1 --starts 5 --periods 200",
    "optimise": "--maximise speed --over X --samples 1",
    "fit": "measured.csv --unknown x",
    "check": "switches.csv --end 0.001",
    "tolerances": "--tolerance x=0.01 --samples 64",
}
DRAWN = {
    "curve": "--XX --Y --bifurcation all --points 1 --max-seconds 5",
}
STORED = ("sweep --info grid", "figure grid --out a.png", "figure basin --out a.png")
STORED += ("figure grid --of progression --out a.png", "figure branch/branch.json --out a.png")


def test_every_command_is_here() -> None:
    named = {name.split()[0] for name in (*RUNS, *DRAWN, *STORED)}
    # `verify` is about declarations, `pulse` needs two motions, `explore` is a page: each has tests
    # of its own.
    assert named | {"verify", "pulse", "explore"} == set(group.commands)


def lines(name: str, device: bool) -> dict[str, str]:
    """Each command with a line of its own."""
    facts = scenes.load(name).facts
    drive, rate = SMALL.get(name, (6.0, 8.0)) if device else (1.6, facts.DEFAULTS["omega"])
    x, y = ("P_d", "Omega") if device else ("alpha", "omega")
    chosen = f"--params {name}.toml" if device else f"--scene {name}"

    def written(options: str) -> str:
        near, wide = f"{drive}:{1.02 * drive}", f"{0.45 * drive}:{drive}"
        words = options.replace("--XX", f"--{x} {wide}").replace("--X", f"--{x} {near}")
        words = words.replace("--Y", f"--{y} {rate}:{1.01 * rate}").replace("X", f"{x}={near}")
        return words.replace("--unknown x", f"--unknown {x}").replace("e x=", f"e {x}=")

    every = {of: f"{of} {written(options)} {chosen}" for of, options in (RUNS | DRAWN).items()}
    return every | {of: of for of in STORED}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in DEVICES.items():
        (tmp_path / f"{name}.toml").write_text(f"scene = '{name}'\n{text}")
    (tmp_path / "switches.csv").write_text("time,entered\n")
    return tmp_path


def measured(name: str, device: bool, folder: Path) -> str:
    """Motion of a scene from rest, with a drive that is a little larger than the first guess."""
    if device:
        system = load_parameters(folder / f"{name}.toml")
        p = system.replace(P_d=1.02 * system.P_d).dimensionless()
    else:
        p = scenes.load(name).Parameters()
        p = p.replace(alpha=1.02 * p.alpha)
    times = np.linspace(0.0, 2 * p.period, 41)
    columns = times, simulate(p, periods=3)(times)[:, 0]
    if device:
        columns = system.scale("duration") * columns[0], system.scale("x_r") * columns[1]
    return "t,x_r\n" + "".join(f"{t},{x_r}\n" for t, x_r in zip(*columns, strict=True))


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name == "prototype" else [pytest.mark.long])
        for name in scenes.SHIPPED
    ],
)
@pytest.mark.parametrize(
    ("device", "commands"),
    [
        (False, tuple(RUNS)),
        pytest.param(True, tuple(RUNS), marks=pytest.mark.long),
        pytest.param(False, ("branch", "sweep", "basin", *DRAWN, *STORED), marks=pytest.mark.long),
        pytest.param(True, ("branch", "sweep", "basin", *DRAWN, *STORED), marks=pytest.mark.long),
    ],
)
def test_a_command_works_in_every_scene(name, device, commands, inside, folder) -> None:
    every = lines(name, device)
    (folder / "measured.csv").write_text(measured(name, device, folder))
    for command in commands:
        done = inside(*every[command].split(), cwd=folder)
        assert done.returncode == 0, (every[command], done.stderr)
