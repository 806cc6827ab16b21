"""Refusals of commands before work begins, and their messages when they are interrupted."""

import re
import subprocess
import sys
from collections.abc import Callable

import pytest

from capsule_sym import InvalidInput, Parameters, PhysicalParameters, simulate, solve_orbit
from capsule_sym._cli import _status
from capsule_sym._map.steady import shown_progression

Command = Callable[..., subprocess.CompletedProcess[str]]
DEVICE = PhysicalParameters(M_m=1, M_c=3, k1=1, k2=1, c=0, G=0, P_d=1, Omega=1, mu=0.1)

PHYSICAL = "M_m=1\nM_c=3\nk1=1\nk2=1\nc=0\nG=0\nP_d=1\nOmega=1\nmu=0.1\n"
FILES = {
    "not.toml": "alpha = = 1\n",
    "binary.toml": "\udcff",
    "nested.toml": "[parameters]\nalpha = 1\n",
    "mixed.toml": f"{PHYSICAL}alpha = 1\n",
    "partial.toml": "M_m = 1\n",
    "unknown.toml": "alhpa = 1\n",
    "text.toml": 'alpha = "0.7"\n',
    "physical.toml": PHYSICAL,
}


REFUSED = [
    # values, and what reads them
    ("run --json --zeta -0.1", "zeta = -0.1: must be finite and >= 0"),
    ("run --omega 0", "omega = 0.0: must be finite and > 0"),
    ("run --alpha nan", "alpha = nan: must be finite and >= 0"),
    ("run --f-b 0", "--f-b = 0.0: must be finite and > 0"),
    ("run --gamma 1e400", "gamma = inf: must be finite and > 0"),
    ("run --json --alpha x", "--alpha ... 'x' ... float"),
    ("run --periods 0", "periods = 0: must be a whole number"),
    ("run --periods 1.5", "--periods ... '1.5' ... integer"),
    ("run --phase -1", "phase = -1.0: must be ... [0, 2 pi/omega)"),
    ("run --phase 7.9", "phase = 7.9: must be ... [0, 2 pi/omega)"),
    ("run --phase nan", "phase = nan: must be"),
    ("run --state 0 inf 0", "state = (0.0, inf, 0.0): must be three numbers"),
    ("run --state 0 0", "--state ... 3 arguments"),
    ("run --backend abacus", "--backend ... 'abacus' ... 'c', 'numpy', 'mpmath'"),
    ("run --alhpa 1", "--alhpa"),
    ("run stray", "stray"),
    ("run --params missing.toml", "--params = 'missing.toml' ... readable ... No such file"),
    ("run --params .", "--params = '.' ... readable"),
    ("run --params not.toml", "--params = 'not.toml' ... a TOML file"),
    ("run --params binary.toml", "--params = 'binary.toml' ... a TOML file"),
    ("run --params nested.toml", "parameter = 'parameters' ... one of alpha"),
    ("run --params mixed.toml", "alpha = 1 ... absent"),
    (
        "run --params partial.toml",
        "--params = 'partial.toml' ... with M_c, k1, k2, c, G, P_d, Omega, mu too",
    ),
    ("run --params unknown.toml", "parameter = 'alhpa' ... one of alpha"),
    ("run --params text.toml", "alpha = '0.7' ... a real number"),
    ("run --params physical.toml --beta 2", "beta = 2.0 ... absent ... physical.toml"),
    ("jog", "jog"),
    ("branch --along speed=0:1", "--along = 'speed': must be one of"),
    ("branch --alpha 0.5:0.5", "--alpha = 0.5: must be other than 0.5"),
    ("branch --gamma 3:0", "gamma = 0.0: must be"),
    (
        "curve --alpha 0.9:1 --gamma 3:4 --bifurcation fold",
        "bifurcation = 'fold': must be type or label of a bifurcation on the branch over alpha "
        "from 0.9 to 1 at gamma = 3.3, which has ['adding-sliding']",
    ),
    (
        "curve --points 4 --alpha 1:2 --gamma 2:3 --at 4 --bifurcation all",
        "gamma = 4.0: must be in its range 2:3",
    ),
    (
        "curve --points 4 --alpha 2:1 --gamma 2:3 --bifurcation all",
        "--alpha = (2.0, 1.0): must be two ascending finite numbers",
    ),
    (
        "curve --points 4 --alpha 0.96:1 --gamma 2:3 --bifurcation all",
        "on the branch over alpha from 0.96 to 1 at gamma = 2.5, which has none",
    ),
    (
        "curve --alpha 1:2 --gamma 3 --bifurcation all",
        "give two ranges, such as --alpha 1.5:2 --gamma 3:3.3",
    ),
    ("branch --alpha 1:2 --gamma 2:3", "gamma = '2:3': must be the only parameter"),
    ("branch --alpha 1:inf", "alpha = inf: must be finite"),
    ("branch --out taken/new", "not a writable directory"),
    ("branch --alpha 1:", "'1:' is not LOW:HIGH, such as 0.1:2"),
    ("basin --x-r 0:1 --out new", "'0:1' is not LOW:HIGH:COUNT, such as 0.1:2:20"),
    ("branch --along s=1:2", "--along = 's': must be one of"),
    ("branch --omega 1:2 --with alpha=1-omega", "alpha = -"),
    ("branch --omega 1:2 --with alpha", "NAME=FORMULA"),
    ("run --max-seconds 0", "'--max-seconds': 0.0 is not in the range x>0"),
    # an option that does nothing without another, or beside it
    ("orbit --seed 3", "--seed needs --starts, which is missing"),
    ("orbit --starts 2 --seed -1", "-1 is not in the range x>=0"),
    ("orbit --starts 3 --state 0 0 0", "--state and --starts exclude each other"),
    ("branch --restart a.json PD1 --to 2 --state 0 0 0", "--state and --restart exclude each"),
    ("branch --restart a.json PD1 --P-d 1:2", "--P-d and --restart exclude each other"),
    ("pulse --to 0 0 1 --x-r -1:1", "--x-r needs --between, which is missing"),
    ("pulse --to 0 0 1 --phase 0:1", "--phase needs --between, which is missing"),
    ("sweep a.toml --out s --alpha 0.1:2:20", "--alpha and FILE.toml exclude each other"),
    ("sweep a.toml --out s --periods 20", "--periods and FILE.toml exclude each other"),
    (
        "figure curves.json --of v_c --out a.svg",
        "--of is for branches and sweeps, which curves",
    ),
    ("branch --along alpha=1:2 --alpha 0.7", "--alpha and --along exclude each other"),
    ("branch --along s=1:2 --alpha 1:2", "--alpha and --along exclude each other"),
    ("branch --alpha 1:2 --to 3", "--to needs --restart, which is missing"),
    ("branch --P-d 1:2", "--P-d = '1:2': must be absent unless --params is a device"),
    ("sweep --P-d 1:2:3 --out s", "--P-d = '1:2:3': must be absent unless --params is a device"),
    ("curve --alpha 1:2 --P-d 1:2 --bifurcation all", "must be absent unless --params is a device"),
    ("sweep --alpha 1:2:3 --out s --workers 1025", "workers = 1025: must be a whole number from"),
    (
        "tolerances --tolerance zeta=0.1 --normal alpha=5",
        "--normal alpha = 5.0: must be a share",
    ),
    (
        "tolerances --tolerance zeta=5 --normal alpha=0.1",
        "--tolerance zeta = 5.0: must be a share",
    ),
    ("fit series.csv --unknown alpha=2:1", "--unknown alpha = (2.0, 1.0): must be two ascending"),
    ("explore --serve 0 --out a.html", "--serve and --out exclude each other"),
    # what is missing altogether
    ("branch", "give a range of a parameter, such as --alpha 0.1:2"),
    ("branch --restart a.json PD1", "--restart needs --to VALUE"),
    ("sweep --out s", "give a range, such as --alpha 0.1:2:41, or FILE.toml"),
    ("basin --out s", "give a range of starts, such as --x-r -1:1:40"),
    # times that are none
    ("run --max-seconds nan", "--max-seconds = nan: must be"),
    ("run --max-seconds -1", "'--max-seconds': -1.0 is not in the range x>0"),
    ("run --f_b 0", "--f-b = 0.0: must be finite and > 0"),
    # files that cannot be written
    ("run --certify=", "'--certify': '' is no path"),
    ("figure . --out=", "'--out': '' is no path"),
    ("figure . --out taken/below.svg", "taken is not a writable directory"),
    (f"explore --out {300 * 'a'}", "aaa' cannot be written (File name too long)"),
    (f"sweep --info {300 * 'a'}", "--info = 'aaa ... must be a directory that holds a sweep"),
    ("sweep none.toml --out s", "alpha = []: must be one value or more"),
    # no numbers and no ranges
    ("run --state 0 0,1 0", "'0,1' is not a valid float"),
    ("branch --alpha 0.1-2", "'0.1-2' is not LOW:HIGH, such as 0.1:2."),
    ("branch --P-d 3", "'3' is not LOW:HIGH, such as 0.1:2."),
    ("sweep --out s --alpha 0.1:2", "'0.1:2' is not LOW:HIGH:COUNT, such as 0.1:2:20."),
    ("sweep --out s --alpha 0.1:2:0", "'0.1:2:0' has COUNT = 0: must be 1 or more."),
    ("basin --x-r 0:1:-3 --out new", "'0:1:-3' has COUNT = -3: must be 1 or more."),
    ("branch --alpha 0.1:2:0", "'0.1:2:0' is not LOW:HIGH, such as 0.1:2."),
    ("run --params part.toml", "with c, G, P_d, Omega, mu too"),
    ("sweep device.toml --out s", "must be a table with c, G, P_d, Omega, mu too"),
]


@pytest.mark.parametrize(("line", "told"), REFUSED)
def test_a_wrong_line_is_refused_in_one_line(line, told, inside, tmp_path) -> None:
    part = "M_m = 1\nM_c = 3\nk1 = 1\nk2 = 1\n"
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8", errors="surrogateescape")
    (tmp_path / "taken").write_text("a file")
    (tmp_path / "series.csv").write_text("t,x_r\n0,0\n1,0.1\n2,0\n3,0.2\n")
    (tmp_path / "none.toml").write_text("axes.alpha = []")
    (tmp_path / "curves.json").write_text('{"curves": [{}]}')
    (tmp_path / "part.toml").write_text(part)
    (tmp_path / "device.toml").write_text(f"[device]\n{part}[axes]\nalpha = [1.0]\n")
    done = inside(*line.split(), cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    for part in told.split(" ... "):
        assert part in done.stderr


def test_a_device_is_told_how_to_become_parameters() -> None:
    with pytest.raises(InvalidInput, match=r"or \.dimensionless\(\) of a device"):
        simulate(DEVICE)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="must be a Parameters, as"):
        simulate(None)  # type: ignore[arg-type]


LACKING = [
    ("matplotlib", "figure . --out a.svg", "plot"),
    ("xarray zarr", "sweep --alpha 0.1:2:3 --out s", "sweep"),
    ("xarray zarr", "basin --x-r 0:1:2 --out s", "sweep"),
    ("xarray zarr", "sweep --info s", "sweep"),
    ("xarray zarr", "figure . --out a.svg", "sweep"),
    ("flint", "run --certify a.json", "symbolic"),
    ("sympy", "verify", "symbolic"),
]


@pytest.mark.parametrize(("absent", "line", "extra"), LACKING)
def test_a_missing_extra_has_one_sentence_and_one_status(
    absent, line, extra, inside, tmp_path, monkeypatch
) -> None:
    for name in absent.split():
        monkeypatch.setitem(sys.modules, name, None)
    done = inside(*line.split(), cwd=tmp_path)
    brought = f"python -m pip install '.[{extra}]' in the checkout"
    told = f"error: {absent.split()[0]} is missing: {brought}\n"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", told)
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_while_an_error_is_told_is_one_line(capsys, monkeypatch) -> None:
    def cut(*_: object, **__: object) -> None:
        monkeypatch.undo()
        raise KeyboardInterrupt

    monkeypatch.setattr("click.echo", cut)
    assert _status(["run", "--alpha", "x"]) == 130
    assert capsys.readouterr() == ("", "error: interrupted\n")


@pytest.mark.parametrize("alpha", [1.2, 1.5, 4.0])
def test_rounding_of_a_symmetric_motion_is_shown_as_no_progression(alpha, inside) -> None:
    """Without the second spring every motion is its own mirror image, and goes nowhere."""
    line = ["--beta", "0", "--alpha", str(alpha), "--zeta", "0.3"]
    assert re.search("^progression +0 *$", inside("run", *line).stdout, re.M)
    shown = inside("orbit", *line).stdout.split()
    assert [shown[shown.index(name) + 1] for name in ("velocity", "progression")] == ["0", "0"]


def test_a_motion_without_contact_has_no_progression_however_weak_the_friction() -> None:
    """Newton's method leaves 1e-10 of the velocity that this friction hardly holds."""
    orbit = solve_orbit(Parameters(alpha=89.0, delta=1e6, zeta=0.2, gamma=1.2, f_b=0.011))
    assert orbit.itinerary.fields == (1, 3)
    assert shown_progression(orbit.motion) == 0.0


def test_a_progression_above_rounding_is_shown_as_it_is() -> None:
    orbit = solve_orbit(Parameters())
    assert shown_progression(orbit.motion) == float(orbit.progression) > 0.4
