"""The package's public side: `plot`, lazy names, style, and files that are equal when redrawn."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

from capsule_sym import InvalidInput, continue_orbit, plot, solve_orbit
from capsule_sym._figures.notebook import new_figure
from capsule_sym._figures.sizes import COLUMN, PAGE, UNLISTED
from capsule_sym._figures.style import styled
from capsule_sym.figures import figure_style, plot_motion, save_figure
from tests.figures import SAFE
from tests.figures.test_parts import fitted
from tests.sampling import sampled, some


@pytest.mark.long
def test_matplotlib_is_imported_when_something_is_drawn() -> None:
    code = (
        "import sys\nfrom capsule_sym import Parameters, simulate, plot\n"
        "print('matplotlib' in sys.modules)\n"
        "plot(simulate(Parameters(), periods=4))\n"
        "print('matplotlib' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\nTrue\n"


def test_a_script_shows_and_saves_what_it_draws(settled) -> None:
    import matplotlib.pyplot as plt

    run, before = settled(1.2), plt.get_fignums()
    figures = [new_figure(1, 1), plot(run)]
    assert [one.number for one in figures] == [n for n in plt.get_fignums() if n not in before]
    assert plt.gcf() is figures[-1]
    written = [io.BytesIO(), io.BytesIO()]
    plt.savefig(written[0], dpi=30)
    figures[-1].savefig(written[1], dpi=30)
    assert written[0].getvalue() == written[1].getvalue()
    own, axes = plt.subplots(1, 2)
    assert plot(run, axes=axes) is own
    assert plt.gcf() is own
    for _ in range(20):  # neither a warning, nor figures without end
        new_figure(1, 1)
    assert len(plt.get_fignums()) < plt.rcParams["figure.max_open_warning"]
    assert plt.fignum_exists(own.number)
    plt.close("all")
    token = UNLISTED.set(True)
    new_figure(1, 1)
    UNLISTED.reset(token)
    assert not plt.get_fignums()


@pytest.mark.parametrize("axes", [1, 3, None])
def test_axes_of_another_number_or_kind_are_one_line(settled, axes) -> None:
    given = "axes" if axes is None else Figure().subplots(1, axes)
    with pytest.raises(InvalidInput, match="axes of Matplotlib"):
        plot(settled(1.2), axes=given)


def test_a_notebook_shows_a_figure_once(settled, monkeypatch: pytest.MonkeyPatch) -> None:
    import matplotlib.pyplot as plt

    shown: list[dict[str, bytes]] = []
    given = SimpleNamespace(display=lambda data, **about: shown.append(data))
    for name in ("IPython", "IPython.display"):
        monkeypatch.setitem(sys.modules, name, given)
    figure = plot(settled(1.2))
    for _ in range(2):
        figure._ipython_display_()
        assert shown.pop()["image/png"].startswith(MAGIC["png"])
        assert not plt.fignum_exists(figure.number)  # at the cell's end it would be there again


def test_plot_draws_what_it_is_given(settled, branch) -> None:
    run = settled(1.2)
    orbit = solve_orbit(run.parameters)
    for result in (run, orbit):
        left, right = plot(result).axes
        assert {line.get_color() for line in left.lines} >= {SAFE[0], SAFE[3]}
        assert right.get_xlabel().startswith("relative displacement")
    followed = plot(continue_orbit(orbit, "alpha", 1.21, points=2))
    assert followed.axes[0].get_ylabel() == "stroboscopic $x_r$"
    with pytest.raises(
        InvalidInput, match=r"result = 'str': must be one of Traj.*a sweep or a basin"
    ):
        plot("alpha")


def test_plot_draws_a_fit() -> None:
    x_c, x_m = plot(fitted(), width=4.0).axes
    assert x_c.get_ylabel() == "$x_c$, residual over noise"
    assert x_m.get_ylabel() == "$x_m$, residual over noise"


def test_the_users_settings_are_left_alone(settled) -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    plot_motion(settled(1.2))
    with figure_style():
        assert matplotlib.rcParams["font.size"] == 7
    assert dict(matplotlib.rcParams) == before


JOURNALS = {"Elsevier": (90, 190), "APS": (86, 178), "IEEE": (88.9, 181), "AIP": (85.7, 178)}


def test_widths_fit_the_columns_and_pages_of_journals() -> None:
    for column, page in JOURNALS.values():
        assert COLUMN * 25.4 <= column <= COLUMN * 25.4 + 5
        assert PAGE * 25.4 <= page <= PAGE * 25.4 + 13


def test_a_style_gives_the_width_of_all_figures(settled) -> None:
    empty = styled(lambda *, width: new_figure(width, 1.0))
    assert plot_motion(settled(1.2)).get_figwidth() == empty().get_figwidth() == PAGE
    for width, inches in (("column", COLUMN), ("page", PAGE), (4.5, 4.5)):
        with figure_style(width):
            assert empty().get_figwidth() == inches
            assert empty(width=6.0).get_figwidth() == 6.0
    with pytest.raises(InvalidInput, match="a number or one of column, page"):
        figure_style("wide").__enter__()
    for width in (-1, 0.0, float("inf")):
        with pytest.raises(InvalidInput, match="a number of inches > 0"):
            figure_style(width).__enter__()


def test_a_style_of_the_users_is_kept(settled) -> None:
    from matplotlib import rc_context, rcParams

    with rc_context({"font.family": "serif", "figure.figsize": (5.0, 3.0), "axes.labelsize": 9}):
        figure = plot_motion(settled(1.2))
        label = figure.axes[0].xaxis.label
        assert (figure.get_figwidth(), label.get_fontfamily(), label.get_fontsize()) == (
            5.0,
            ["serif"],
            9.0,
        )
        with figure_style():
            assert rcParams["xtick.labelsize"] == 6  # what is not the user's is ours


MAGIC = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


@sampled
@pytest.mark.parametrize("kind", some(MAGIC, 2))
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


def test_without_matplotlib_a_message_says_how_to_install_it() -> None:
    code = (
        "import sys\nsys.modules['matplotlib'] = None\nimport capsule_sym as c\n"
        "for name in ('plot_motion', 'figure_style', 'save_figure'):\n"
        "    try: getattr(c.figures, name)(c.solve_orbit(c.Parameters()))\n"
        "    except c.NotInstalled as missing: print(missing)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (
        done.stdout
        == 3 * "matplotlib is missing: python -m pip install '.[plot]' in the checkout\n"
    )
