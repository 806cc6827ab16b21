"""Several branches in one diagram: what is solid, dashed, labelled, and where the points are."""

import json
import math
import threading

import numpy as np
import pytest
from matplotlib.figure import Figure

from capsule_sym import InvalidInput, Parameters, continue_orbit, figures, orbits, solve_orbit
from capsule_sym._cli import main
from capsule_sym._figures.diagrams import in_order, title_of
from capsule_sym._orbits.continuation.records import branch_record
from capsule_sym._records import dumps
from tests.orbits.branches import settled

WORD = "quantities without a unit are dimensionless"


@pytest.fixture(scope="module")
def record():
    branch = continue_orbit(settled(alpha=0.04, zeta=0.005), "alpha", 0.046, points=6)
    return branch_record(branch, orbits.period_doubling_cascade(branch, 1, points=6))


def test_a_diagram_shows_both_branches_and_their_stability(record) -> None:
    figure = figures.plot_diagram(record)
    (axes,) = figure.axes
    keys = [[text.get_text() for text in key.get_texts()] for key in figure.legends]
    assert keys == [
        ["branch", "from PD1", "stable", "unstable", "bifurcation"],
        [f"PD1  period doubling, {record['bifurcations'][0]['value']:.6f}", WORD],
    ]
    assert {text.get_text() for text in axes.texts} == {"PD1"}
    lines = [line for line in axes.lines if len(line.get_xdata()) > 1]
    drawn = [line for line in lines if line.get_color() != "black"]  # those lead to names
    styles = {(line.get_color(), line.get_linestyle()) for line in drawn}
    assert len({colour for colour, _ in styles}) == 2
    # The branch loses its stability to the doubled orbits, of which two states are shown.
    value = record["bifurcations"][0]["value"]
    for line in drawn:
        if line.get_color() == drawn[0].get_color():
            assert (line.get_linestyle() == "--") == (np.mean(line.get_xdata()) > value)
            assert value in line.get_xdata()[[0, -1]]
    doubled = [line for line in drawn if line.get_color() != drawn[0].get_color()]
    assert [line.get_linestyle() for line in doubled] == ["-", "-"]
    # The last orbit's states are those on which the map settles, from rest.
    run = settled(alpha=0.046, zeta=0.005).trajectory()
    times = run.parameters.period * np.arange(1, 3)
    ends = sorted(line.get_ydata()[-1] for line in doubled)
    assert ends == pytest.approx(sorted(run(times)[:, 0]), abs=1e-9)


def test_a_diagram_shows_the_progression_of_an_excitation_period(record) -> None:
    (axes,) = figures.plot_diagram(record, "progression").axes
    drawn = {place for line in axes.lines for place in zip(*line.get_data(), strict=True)}
    period = math.tau / record["points"][0]["parameters"]["omega"]
    for point in record["points"]:
        near = [y for x, y in drawn if x == point["value"]]
        assert near == pytest.approx([point["average_velocity"] * period], abs=1e-15)
    assert axes.get_ylabel() == "progression per period"


@pytest.mark.parametrize(("name", "unit"), [("omega", ""), ("Omega", " rad/s"), ("P_d", " N")])
def test_values_in_the_key_have_the_unit_of_the_parameter(name, unit) -> None:
    one = {"label": "PD1", "type": "period doubling", "line": "", "value": 8.5, "parameter": name}
    assert title_of(one) == f"PD1  period doubling, 8.500000{unit}"


def test_a_branch_that_was_stopped_at_its_start_is_left_out(record) -> None:
    stopped = {**record["switched"][0], "points": [], "bifurcations": []}
    whole, cut = (
        figures.plot_diagram({**record, "switched": [*record["switched"], *more]})
        for more in ((), (stopped,))
    )
    assert len(cut.axes[0].lines) == len(whole.axes[0].lines)


def test_a_diagram_is_drawn_from_a_file(record, tmp_path, capsys) -> None:
    file, out = tmp_path / "branch.json", tmp_path / "branch.svg"
    file.write_text(dumps(record))
    with pytest.raises(SystemExit) as stopped:
        main(["figure", str(file), "--of", "progression", "--out", str(out), "--json"])
    assert stopped.value.code == 0
    told = {"files": [{"path": str(out), "bytes": out.stat().st_size}]}
    assert capsys.readouterr() == (json.dumps(told) + "\n", "")
    assert out.read_text().startswith("<?xml")
    file.write_text("{}")
    with pytest.raises(SystemExit) as stopped:
        main(["figure", str(file), "--out", str(out)])
    assert stopped.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(InvalidInput, match="one of x_r, v_r, v_c, velocity, speed, progression"):
        figures.plot_diagram(record, "x")


LACKS = [
    *("parameter", "bifurcations", "switched", "origin"),
    *(f"points.{name}" for name in ("value", "stable", "itinerary", "state", "durations")),
    *(f"points.{name}" for name in ("parameters", "phase")),
    *(f"bifurcations.{name}" for name in ("value", "label", "type", "line")),
]


@pytest.mark.parametrize("lacks", LACKS)
def test_a_record_that_lacks_something_is_one_line(record, lacks: str) -> None:
    """As one written by hand: the line names what is not there."""
    *within, name = lacks.split(".")
    broken = json.loads(dumps(record))
    for table in broken[within[0]] if within else [broken]:
        del table[name]
    said = f"record = \"without '{name}'\": must be a whole one|of an orbit, with .*{name[:5]}"
    with pytest.raises(InvalidInput, match=said):
        figures.plot_diagram(broken, axes=Figure().subplots())


@pytest.mark.parametrize(
    ("given", "named", "said"),
    [
        (1, {"foo": 1}, "argument of plot_diagram = 'foo': must be one of record, quantity, width"),
        (0, {}, r"arguments of plot_diagram = \(\): must be record, .*missing.*'record'"),
    ],
)
def test_wrong_arguments_are_named(record, given: int, named: dict, said: str) -> None:
    """A record is not blamed for them."""
    with pytest.raises(InvalidInput, match=said):
        figures.plot_diagram(*[record] * given, **named)


def test_labels_of_a_quantity_that_is_the_same_everywhere_are_beside_their_points(record) -> None:
    (axes,) = figures.plot_diagram(record, "velocity").axes
    (label,) = axes.texts
    (x, y), (at,) = label.get_position(), [one["value"] for one in record["bifurcations"]]
    away = axes.transData.transform((x, y)) - axes.transData.transform((at, 0.0))
    assert np.hypot(*away) < 40  # pixels


def test_styles_change_at_the_solved_bifurcation() -> None:
    """Not at the next sample."""
    start = solve_orbit(Parameters(alpha=0.04, zeta=0.005))
    doubling = continue_orbit(start, "alpha", 0.046, points=3)
    exact = doubling.bifurcations[0].value
    assert exact not in [point.value for point in doubling.points]
    (axes,) = figures.plot_diagram(doubling).axes
    drawn = [line for line in axes.lines if len(line.get_xdata()) > 2]
    before, after = (
        np.concatenate([line.get_xdata() for line in drawn if line.is_dashed() == dashed])
        for dashed in (False, True)
    )
    assert max(before) == min(after) == exact


def test_styles_change_at_a_fold_whose_value_the_branch_passes_again() -> None:
    values = (1.0, 0.9, 0.8, 0.85, 0.95, 0.9, 0.7)
    stable = (True, True, True, False, False, True, True)
    points = [{"value": v, "stable": s} for v, s in zip(values, stable, strict=True)]
    folds = [
        {"value": value, "interval": [before, value], "multipliers_after": [[size, 0.0]]}
        for value, before, size in ((0.799, 0.8, 1.1), (0.951, 0.95, 0.9))
    ]
    nodes, between = in_order({"points": points, "bifurcations": folds})
    assert [one["value"] for one in nodes] == [1.0, 0.9, 0.8, 0.799, 0.85, 0.95, 0.951, 0.9, 0.7]
    assert between == [True, True, True, False, False, False, True, True]


@pytest.mark.long
def test_the_case_study_has_the_printed_bifurcations(branch) -> None:
    (axes,) = figures.plot_diagram(branch, "velocity").axes
    (marked,) = [line for line in axes.lines if line.get_marker() == "o" and len(line.get_xdata())]
    assert list(marked.get_xdata()) == pytest.approx(PRINTED, rel=0.01)


PRINTED = (0.0074, 0.3687, 0.5245, 0.939, 1.443, 1.6148, 1.661, 1.7126)


def test_a_diagram_in_a_part_of_a_figure_names_its_bifurcations(record) -> None:
    page = Figure()
    figures.plot_diagram(record, axes=(axes := page.subfigures(1, 2)[0].subplots()))
    assert [text.get_text() for text in axes.texts] == ["PD1"]


def test_names_are_placed_without_a_thread_that_outlives_the_drawing(record) -> None:
    # tqdm, which textalloc calls, starts one, and its locks could make a drawing hang.
    figures.plot_diagram(record)
    assert not [one.name for one in threading.enumerate() if "tqdm" in one.name]
