"""The package's public side: `plot`, lazy names, style, and files that are equal when redrawn."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from capsule_sym import InvalidInput, figure_style, plot, plot_motion, save_figure
from capsule_sym._figures.layout import new_figure
from capsule_sym._figures.sizes import COLUMN, PAGE
from tests.figures.test_parts import fitted


def test_matplotlib_is_imported_when_something_is_drawn() -> None:
    code = (
        "import sys\nfrom capsule_sym import Parameters, simulate, plot\n"
        "print('matplotlib' in sys.modules)\n"
        "plot(simulate(Parameters(), periods=4))\n"
        "print('matplotlib' in sys.modules, 'matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\nTrue False\n"


def test_plot_draws_what_it_is_given(settled, branch) -> None:
    from capsule_sym import continue_orbit, solve_orbit

    run = settled(1.2)
    orbit = solve_orbit(run.parameters)
    for result in (run, orbit):
        left, right = plot(result, colours="paper").axes
        assert {line.get_color() for line in left.lines} >= {"green", "magenta"}
        assert right.get_xlabel().startswith("relative displacement")
    followed = plot(continue_orbit(orbit, "alpha", 1.21, points=2))
    assert followed.axes[2].get_xlim() == (1.2, 1.21)
    with pytest.raises(InvalidInput, match=r"result = 'str': must be a Traj.*are drawn by plot_ch"):
        plot("alpha")


def test_plot_draws_a_fit() -> None:
    x_c, x_m = plot(fitted(), width=4.0).axes
    assert x_c.get_ylabel() == "x_c, residual over noise"
    assert x_m.get_ylabel() == "x_m, residual over noise"


def test_the_users_settings_are_left_alone(settled) -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    plot_motion(settled(1.2))
    with figure_style():
        assert matplotlib.rcParams["font.size"] == 7
    assert dict(matplotlib.rcParams) == before


def test_widths_are_those_of_a_two_column_page() -> None:
    assert pytest.approx(90, abs=0.5) == COLUMN * 25.4
    assert pytest.approx(190, abs=0.5) == PAGE * 25.4


MAGIC = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


@pytest.mark.parametrize("kind", MAGIC)
def test_equal_figures_are_equal_files(tmp_path: Path, kind: str) -> None:
    for name in ("one", "two"):
        figure = new_figure(1, 1)
        figure.subplots().plot([0, 1], [0, 1], label=r"$\Sigma_5$")
        figure.legend()
        save_figure(figure, tmp_path / f"{name}.{kind}")
    assert (tmp_path / f"one.{kind}").read_bytes().startswith(MAGIC[kind])
    save_figure(figure, str(tmp_path / f"named.{kind}"))  # a name will do as well
    assert (tmp_path / f"named.{kind}").read_bytes() == (tmp_path / f"one.{kind}").read_bytes()
    assert (tmp_path / f"one.{kind}").read_bytes() == (tmp_path / f"two.{kind}").read_bytes()


def test_the_style_is_found_by_matplotlib_too() -> None:
    import matplotlib.style

    with matplotlib.style.context("capsule_sym._figures.capsule"):
        assert matplotlib.rcParams["svg.hashsalt"] == "capsule-sym"


_DRAWN = "plot(capsule_sym.solve_orbit(capsule_sym.Parameters()))"


@pytest.mark.parametrize("name", ["plot_motion", "animate", "figure_style", "save_figure", _DRAWN])
def test_without_matplotlib_a_message_says_how_to_install_it(name: str) -> None:
    code = (
        "import sys\nsys.modules['matplotlib'] = None\nimport capsule_sym\n"
        f"try: capsule_sym.{name}\nexcept capsule_sym.NotInstalled as missing: print(missing)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "matplotlib is missing: pip install 'capsule-sym[plot]'\n"
