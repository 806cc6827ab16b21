"""A choice in a diagram, a chart or a file is shown; nothing is cut off or outdated."""

import csv
import re
import tomllib

import numpy as np
import pytest

import capsule_sym as cs

from .test_browser import _itinerary, _quantity, _settled, _until

pytestmark = pytest.mark.long

# Three motions coexist here; from rest at phase 8 another one is reached than at phase 0.
BASIN = {"alpha": 2.8, "omega": 0.4, "zeta": 0.01, "beta": 5, "gamma": 5}
COEXISTING = "&".join(f"{name}={value}" for name, value in BASIN.items())
DONE = "/Points in|finished/.test(document.getElementById('{}-status').textContent)"


def _finished(tab, view):
    _until(tab, DONE.format(view))


def _digits(motion):
    return "".join(field[1] for field in motion.itinerary)


def _rows(tab, name, path):
    tab.click("#share-open")
    with tab.expect_download() as got:
        tab.click(f"#save-{name}")
    got.value.save_as(path)
    tab.get_by_role("button", name="Close").click()
    with path.open() as file:
        return list(csv.DictReader(file))


def test_a_chart_runs_from_the_phase_that_is_set(open_page, tmp_path):
    ends = "c_x=x_r&c_y=v_r&c_x0=-2&c_x1=2&c_y0=-2&c_y1=2&c_by=attractor&c_size=16"
    tab = open_page(f"#view=chart&{ends}&{COEXISTING}&phase=8")
    _finished(tab, "chart")
    rows = _rows(tab, "cells-csv", tmp_path / "cells.csv")
    differ = 0
    for row in rows[::5]:
        state = (float(row["x_r"]), float(row["v_r"]), 0.0)
        motion = cs.simulate(cs.Parameters(**BASIN), state, 8.0, 300).steady()
        assert row["itinerary"] == _digits(motion)
        assert float(row["progression"]) == pytest.approx(motion.progression, abs=1e-6)
        differ += _digits(cs.simulate(cs.Parameters(**BASIN), state, 0.0, 300).steady()) != _digits(
            motion
        )
    assert differ > 3


def test_a_diagram_begins_at_the_phase_that_is_set(open_page, tmp_path):
    at = "view=diagram&d_from=2.8&d_to=2.81&d_count=2&d_way=up&d_periods=300"
    found = []
    for phase in (0, 8):
        tab = open_page(f"#{at}&{COEXISTING}&phase={phase}")
        _finished(tab, "diagram")
        row = _rows(tab, "points-csv", tmp_path / "points.csv")[0]
        motion = cs.simulate(cs.Parameters(**BASIN), phase=float(phase), periods=300).steady()
        found.append(_digits(motion))
        assert sorted(row["itinerary"]) == sorted(found[-1])
    assert found[0] != found[1]


def test_what_is_clicked_in_a_diagram_is_shown(open_page, tmp_path):
    at = "view=diagram&d_from=2.6&d_to=3&d_count=9&d_starts=4&d_way=up&d_y=progression"
    tab = open_page(f"#{at}&{COEXISTING}")
    _finished(tab, "diagram")
    rows = _rows(tab, "points-csv", tmp_path / "points.csv")
    values = [float(row["progression"]) for row in rows]
    # Coordinates as the axes have them: margins of 58, 14, 12 and 42 pixels, 5 % beside the values.
    low, high = min(values), max(values)
    low, high = low - 0.05 * (high - low), high + 0.05 * (high - low)
    box = tab.locator("#diagram").bounding_box()
    chosen = {}
    for row, value in zip(rows, values, strict=True):
        if row["alpha"] == "2.8":
            chosen[round(value, 4)] = value
    assert len(chosen) > 1
    for value in chosen.values():
        x = box["x"] + 58 + (2.8 - 2.6) / 0.4 * (box["width"] - 72)
        y = box["y"] + 12 + (1 - (value - low) / (high - low)) * (box["height"] - 54)
        _settled(tab, lambda x=x, y=y: tab.mouse.click(x, y))
        assert tab.input_value("#field-alpha") == "2.8"
        assert _quantity(tab, "progression") == pytest.approx([value], abs=1e-6)
        # The diagram is computed again, a while after its tab is chosen: what is said of the one
        # before is no sign of that.
        tab.evaluate("document.getElementById('diagram-status').textContent = ''")
        tab.get_by_role("tab", name="Diagram").click()
        _finished(tab, "diagram")


def test_keys_choose_among_motions_that_coexist(open_page):
    at = "view=diagram&d_from=2.6&d_to=3&d_count=9&d_starts=4&d_way=up"
    tab = open_page(f"#{at}&{COEXISTING}")
    _finished(tab, "diagram")
    diagram = tab.locator("#diagram")
    diagram.focus()
    diagram.press("ArrowRight")
    said = set()
    for _ in range(5):
        diagram.press("ArrowUp")
        text = tab.inner_text("#diagram-status")
        said.add(re.search(r": ([F\d ]+)\.", text)[1])
    assert len(said) > 1
    _settled(tab, lambda: diagram.press("Enter"))
    assert " ".join(_itinerary(tab)) == re.search(r": ([F\d ]+)\.", text)[1]


def test_what_is_clicked_in_a_chart_is_shown(open_page, tmp_path):
    ends = "c_x=x_r&c_y=v_r&c_x0=-2&c_x1=2&c_y0=-2&c_y1=2&c_by=attractor&c_size=16"
    tab = open_page(f"#view=chart&{ends}&{COEXISTING}")
    _finished(tab, "chart")
    cells = {
        (round(float(row["x_r"]), 6), round(float(row["v_r"]), 6)): row["itinerary"]
        for row in _rows(tab, "cells-csv", tmp_path / "cells.csv")
    }
    for i, j in ((0, 0), (7, 9), (15, 3)):
        tab = open_page(f"#view=chart&{ends}&{COEXISTING}")
        _finished(tab, "chart")
        box = tab.locator("#chart").bounding_box()
        # Near a corner of the cell, where another motion may be that its middle does not have.
        x = box["x"] + 58 + (i + 0.9) / 16 * (box["width"] - 72)
        y = box["y"] + 12 + (1 - (j + 0.9) / 16) * (box["height"] - 54)
        _settled(tab, lambda x=x, y=y, tab=tab: tab.mouse.click(x, y))
        middle = tuple(round(-2 + 4 * (k + 0.5) / 16, 6) for k in (i, j))
        start = tuple(float(tab.input_value(f"#field-{name}")) for name in ("x_r", "v_r"))
        assert start == middle
        assert "".join(one[1] for one in _itinerary(tab)) == cells[middle]


def test_folds_are_those_of_the_package(open_page):
    system = {"zeta": 0.01, "alpha": 1.5, "beta": 15.0}
    given = "&".join(f"{name}={value:g}" for name, value in system.items())
    ends = "d_x=omega&d_from=0.8015&d_to=0.8025&d_count=6&d_periods=300&d_way=up"
    tab = open_page(f"#view=diagram&{given}&{ends}")
    _finished(tab, "diagram")
    rows = [row for row in tab.locator("#marks tr").all_inner_texts() if "fold" in row]
    start = cs.solve_orbit(cs.Parameters(**system, omega=0.8015))
    known = [
        one for one in cs.continue_orbit(start, "omega", 0.8025).bifurcations if one.type == "fold"
    ]
    assert len(rows) >= 1
    value = float(re.search(r"= ([\d.]+)", rows[0])[1])
    assert value == pytest.approx(known[0].value, abs=2e-12)


def test_a_refused_choice_does_not_stay(open_page):
    tab = open_page("#omega=0.1&phase=50")
    tab.select_option("#units-choice", "device")
    assert "τ₀" in tab.inner_text("#units-choice-error")
    assert tab.input_value("#units-choice") == "dimensionless"
    slider = tab.get_by_label("excitation frequency, slider")
    slider.focus()
    slider.press("End")
    assert "It is still 0.1" in tab.inner_text("#field-omega-error")
    assert slider.input_value() == "0.1"
    tab.fill("#field-alpha", "-3")
    tab.locator("#field-alpha").press("Tab")
    assert "It is still 0.7" in tab.inner_text("#field-alpha-error")
    tab.locator("#field-alpha").press("Escape")
    assert tab.input_value("#field-alpha") == "0.7"
    assert not tab.locator("#field-alpha-error").is_visible()


def test_an_alert_goes_with_the_next_change(open_page):
    tab = open_page("#alpha=-1")
    assert "was not understood" in tab.inner_text("#refused")
    _settled(tab, lambda: tab.fill("#field-alpha", "0.9"))
    assert not tab.locator("#refused").is_visible()
    assert tab.inner_text("#refused") == ""


DEVICE = """M_m = 0.5
M_c = 1.65
k1 = 50
k2 = 75.0
c = 0.5 # N s/m
G = 0.0017
P_d = 4.5
Omega = 8
mu = 0.2
"""


@pytest.mark.parametrize(
    "text",
    [
        DEVICE,
        DEVICE + "g = 1.62\n",
        "alpha = 1.2\ngamma = 3\n",
        "",
        DEVICE + "alpha = 1.2\n",
        DEVICE.replace("mu = 0.2\n", ""),
        DEVICE.replace("50", "-50"),
        'alpha = "1.2"\n',
        "alpha = true\n",
        "alpha = nan\n",
        "alpha = 1.2.3\n",
        "alpha = 1\nalpha = 2\n",
        "lambda = 1\n",
        "[alpha]\nx = 1\n",
        "__proto__ = 1\n",
    ],
)
def test_files_are_taken_as_by_the_package(open_page, tmp_path, text):
    path = tmp_path / "device.toml"
    path.write_text(text)
    try:
        loaded = cs.load_parameters(path)
    except cs.InvalidInput:
        loaded = None
    tab = open_page("#alpha=0.31")
    tab.set_input_files("#file", path)
    if loaded is None:
        tab.wait_for_selector("#file-error:not([hidden])")
        assert tab.input_value("#field-alpha") == "0.31"
        return
    _until(tab, "document.documentElement.dataset.motions !== '1'")
    assert not tab.locator("#file-error").is_visible()
    device = not isinstance(loaded, cs.Parameters)
    assert tab.input_value("#units-choice") == ("device" if device else "dimensionless")
    names = ("M_m", "k2", "P_d", "g") if device else ("alpha", "gamma", "beta")
    for name in names:
        assert float(tab.input_value(f"#field-{name}")) == getattr(loaded, name)


@pytest.mark.parametrize("width", [390, 1280])
def test_no_table_is_cut(open_page, width):
    tab = open_page("#view=diagram&d_count=100", viewport={"width": width, "height": 900})
    _finished(tab, "diagram")
    tab.get_by_role("tab", name="Chart").click()
    _finished(tab, "chart")
    for view, table in (("Chart", "#known"), ("Diagram", "#marks"), ("Motion", "#segments")):
        tab.get_by_role("tab", name=view).click()
        tab.wait_for_selector(f"{table} tr, {table} td")
        wide = "const box = {}.closest('.table') ?? {}.querySelector('.table');"
        wide = wide.replace("{}", f"document.querySelector('{table}')")
        assert (
            tab.evaluate(f"(() => {{ {wide} return box.scrollWidth - box.clientWidth; }})()") <= 1
        )


def test_colours_have_their_values(open_page):
    tab = open_page("#view=chart&c_size=16&c_by=progression")
    _finished(tab, "chart")
    assert re.search(r"from [−\d.]+ to [\d.]+", tab.inner_text("#regions"))
    tab.select_option("#c-by", "period")
    _until(tab, "/period 1,/.test(document.getElementById('regions').textContent)")
    tab.select_option("#c-by", "itinerary")
    _until(tab, "/F5 F4 F1 F2/.test(document.getElementById('regions').textContent)")
    assert tab.locator("#c-by option[value=attractor]").is_disabled()
    tab.select_option("#c-x", "x_r")
    tab.select_option("#c-y", "phase")
    tab.select_option("#c-by", "attractor")
    tab.select_option("#c-x", "omega")
    assert tab.input_value("#c-by") == "itinerary"


def test_every_term_is_explained(open_page):
    tab = open_page("#view=diagram&d_count=20")
    _finished(tab, "diagram")
    assert tab.locator("#marks details").count() == tab.locator("#marks tr").count() > 0
    _settled(tab, lambda: tab.get_by_role("tab", name="Motion").click())
    for button in tab.locator("#view-motion .help").all():
        about = tab.locator(f"#{button.get_attribute('aria-controls')}")
        assert not about.is_visible()
        button.press("Enter")
        assert len(about.inner_text()) > 20
        # It stays open while the motion changes.
    _settled(tab, lambda: tab.fill("#field-alpha", "0.9"))
    assert (
        tab.locator("#view-motion .about:visible").count()
        == tab.locator("#view-motion .help").count()
    )


def test_it_works_by_touch(open_page):
    tab = open_page(viewport={"width": 390, "height": 844}, has_touch=True)
    tab.get_by_role("tab", name="Diagram").tap()
    _finished(tab, "diagram")
    diagram = tab.locator("#diagram")
    diagram.scroll_into_view_if_needed()
    _settled(tab, lambda: diagram.tap(position={"x": 200, "y": 100}))
    alpha = float(tab.input_value("#field-alpha"))
    assert alpha != 0.7
    tab.locator("#fold").tap()
    _settled(tab, lambda: tab.locator("#reset").tap())
    assert tab.input_value("#field-alpha") == "0.7"


def test_motion_is_reduced_where_that_is_wished(open_page):
    for wish, playing in (("reduce", "false"), ("no-preference", "true")):
        tab = open_page(reduced_motion=wish)
        tab.wait_for_timeout(900)
        assert tab.get_attribute("#play", "aria-pressed") == playing


def test_a_sweep_is_taken_along(open_page):
    tab = open_page("#view=chart&c_size=16&phase=1&v_r=0.25&zeta=0.1")
    _finished(tab, "chart")
    tab.click("#share-open")
    plan = cs.inputs.read_plan(tomllib.loads(tab.inner_text("#share-file")))
    assert plan.shape == (16, 16)
    assert (plan.phase, plan.state, plan.parameters.zeta) == (1.0, (0.0, 0.25, 0.0), 0.1)
    np.testing.assert_allclose(plan.axes[1].values[:, 0], 1 + 4 * (np.arange(16) + 0.5) / 16)
    compile(tab.inner_text("#share-python"), "sweep.py", "exec")


def test_plane_and_turn_are_in_the_address(open_page):
    tab = open_page()
    tab.select_option("#plane", "v_r-v_c")
    space = tab.locator("#space")
    space.focus()
    space.press("ArrowLeft")
    _until(tab, "location.hash.includes('around')")
    assert set(tab.evaluate("location.hash")[1:].split("&")) == {"plane=v_r-v_c", "around=-28"}
    again = open_page("#plane=v_r-v_c&around=-28")
    assert again.input_value("#plane") == "v_r-v_c"
