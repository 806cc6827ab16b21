"""The page driven in headless Chromium, its numbers beside the package's."""

import json
import random
import re
import tomllib
from contextlib import suppress
from pathlib import Path
from time import monotonic

import numpy as np
import pytest
from click.testing import CliRunner

import capsule_sym as cs
from capsule_sym._cli import group

from .conftest import AXE

try:
    from playwright.sync_api import Error
except ImportError:  # no browser: the fixtures skip
    Error = Exception

pytestmark = pytest.mark.long


def _quantity(tab, name):
    text = tab.locator(".quantity", has_text=name).first.locator("dd b").inner_text()
    return [float(part.replace("−", "-")) for part in re.split(r",| \+ ", text)]


def _itinerary(tab):
    return tuple(tab.locator("#itinerary b").all_inner_texts())


def _until(tab, expression):
    """Waits until an expression holds; the page's policy lets the driver wait for none in it."""
    end = monotonic() + 240
    while not tab.evaluate(expression):
        assert monotonic() < end, expression
        tab.wait_for_timeout(20)


def _settled(tab, change):
    """Does something, and waits until the motion that it leads to is drawn."""
    before = tab.evaluate("document.documentElement.dataset.motions ?? '0'")
    change()
    _until(tab, f"(document.documentElement.dataset.motions ?? '0') !== '{before}'")


def _anew(tab, change):
    """Does something, and waits until it has loaded the page again."""
    tab.evaluate("window.before = true")
    end, ready = monotonic() + 60, False
    with suppress(Error):  # between two pages
        change()
    while not ready:
        assert monotonic() < end
        tab.wait_for_timeout(20)
        with suppress(Error):
            ready = tab.evaluate("!window.before && !!document.documentElement.dataset.ready")


def _same_motion(tab, parameters):
    motion = cs.simulate(parameters, periods=400).steady()
    orbit = cs.solve_orbit(parameters)
    assert _itinerary(tab) == motion.itinerary
    assert tab.locator("#map").inner_text().replace("_", "") == re.sub(
        r"[_{}]", "", motion.global_map
    )
    assert _quantity(tab, "progression") == pytest.approx([motion.progression], abs=1e-9)
    assert _quantity(tab, "work") == pytest.approx([cs.performance(orbit).work.value], rel=1e-8)
    known = [cs.performance(orbit).damper_loss.value, cs.performance(orbit).friction_loss.value]
    assert _quantity(tab, "losses") == pytest.approx(known, rel=1e-4)
    assert _quantity(tab, "multipliers") == pytest.approx(
        abs(cs.orbits.floquet_multipliers(orbit)), abs=1e-4
    )


def test_the_motion_is_the_package_s(open_page):
    tab = open_page()
    _same_motion(tab, cs.Parameters())
    _settled(tab, lambda: tab.fill("#field-alpha", "1.2"))
    _same_motion(tab, cs.Parameters(alpha=1.2))
    slider = tab.get_by_label("excitation amplitude, slider")
    slider.focus()
    _settled(tab, lambda: slider.press("ArrowRight"))
    assert tab.input_value("#field-alpha") == "1.201"
    _same_motion(tab, cs.Parameters(alpha=1.201))
    _settled(tab, lambda: tab.get_by_role("button", name="Back to the defaults").click())
    assert tab.input_value("#field-alpha") == "0.7"


@pytest.mark.parametrize("name", cs.scenes.SHIPPED[1:])
def test_the_motion_of_each_scene_is_the_package_s(open_page, name):
    own = cs.scenes.load(name)
    tab = open_page()
    tab.click("#theme")
    _anew(tab, lambda: tab.select_option("#scene", name))
    assert tab.get_attribute("#theme", "aria-pressed") == "true"
    assert tab.evaluate("location.hash") == f"#scene={name}"
    assert tab.input_value("#scene") == name
    shown = tab.locator("#controls .control:visible .entry input").all()
    assert [one.get_attribute("id") for one in shown] == [
        f"field-{one}" for one in own.facts.PARAMETERS
    ]
    _same_motion(tab, own.Parameters())
    alpha = round(0.95 * own.facts.DEFAULTS["alpha"], 3)
    _settled(tab, lambda: tab.fill("#field-alpha", str(alpha)))
    _same_motion(tab, own.Parameters(alpha=alpha))
    _until(tab, "location.hash.includes('alpha')")
    _settled(tab, lambda: tab.select_option("#units-choice", "device"))
    values = tab.locator("#controls .control:visible .entry input").all()
    device = {one.get_attribute("id")[6:]: float(one.input_value()) for one in values}
    motion = cs.simulate(own.PhysicalParameters(**device).dimensionless(), periods=400).steady()
    assert _itinerary(tab) == motion.itinerary
    # The scene before is two changes back.
    _until(tab, "location.hash.includes('device')")
    tab.go_back()
    tab.go_back()
    _anew(tab, tab.go_back)
    assert tab.input_value("#scene") == "capsule"


@pytest.mark.parametrize("name", cs.scenes.SHIPPED)
def test_what_a_scene_has_is_drawn(open_page, tmp_path, name):
    facts = cs.scenes.load(name).facts
    tab = open_page(f"#scene={name}")
    tab.click("#share-open")
    drawn = {}
    for picture in ("capsule", "phase", "space", "history"):
        with tab.expect_download() as got:
            tab.click(f"#save-{picture}-svg")
        got.value.save_as(tmp_path / picture)
        drawn[picture] = (tmp_path / picture).read_text()
    for picture in ("phase", "space"):
        surfaces = re.findall(r"> = (−?δ.?)</text>", drawn[picture])
        assert surfaces == (["δ"] if len(facts.STOPS) == 1 else ["δ₁", "−δ₂"])
    (line,) = re.findall(r'd="(M[^"]*)" fill="none" stroke="#52606f"', drawn["history"])
    # Pulses are two levels and their edges, a cosine a line of many points.
    heights = {point.split(" ")[1] for point in re.split("[ML]", line)[1:]}
    assert (len(heights) == 2) == facts.PULSED
    assert ("rotate" in drawn["capsule"]) == ("s" in facts.PARAMETERS)
    arrows = re.findall(r'Z" fill="#52606f"', drawn["capsule"])
    assert len(arrows) == (2 if facts.REACTS else 1)


EVENTS = {
    "capsule": (0.5, 0.95),
    "slope": (1.3, 1.6),
    "prototype": (1.8, 2.2),
    "reaction": (0.8, 1.3),
    "reaction_pulse": (0.95, 1.02),
}


@pytest.mark.parametrize("name", cs.scenes.SHIPPED)
def test_bifurcations_of_each_scene_are_the_package_s(open_page, name):
    low, high = EVENTS[name]
    own = cs.scenes.load(name)
    orbit = cs.solve_orbit(own.Parameters(alpha=low))
    known = cs.continue_orbit(orbit, "alpha", high).bifurcations
    assert len(known) > 1
    tab = open_page(f"#scene={name}&view=diagram&d_from={low}&d_to={high}&d_count=30&d_way=up")
    _until(tab, "/Points in/.test(document.getElementById('diagram-status').textContent)")
    rows = tab.locator("#marks tr").all_inner_texts()
    assert len(rows) == len(known)
    for row, one in zip(rows, known, strict=True):
        assert float(re.search(r"= ([\d.]+)", row)[1]) == pytest.approx(one.value, abs=2e-12)
        line = "" if one.type == "edge" else f" on {one.line.partition('^')[0]}"
        assert f"{one.type}{line}" in row


def test_presets_say_what_the_paper_prints(open_page):
    tab = open_page()
    for name, says in (("f  α = 0.7", "the same"), ("l  α = 1.64", "the exact map differs")):
        _settled(tab, lambda name=name: tab.select_option("#preset", label=name))
        assert tab.locator("#printed").inner_text().endswith(f"{says}.")


def test_a_device_is_that_of_the_package(open_page):
    tab = open_page("#units=device&P_d=4.5")
    device = cs.PhysicalParameters(M_m=0.5, M_c=1.65, k1=50, k2=75, c=0.5, G=0.0017, P_d=4.5,
                                Omega=8, mu=0.2)  # fmt: skip
    motion = cs.simulate(device.dimensionless(), periods=400).steady()
    assert _itinerary(tab) == motion.itinerary
    friction = 0.2 * (0.5 + 1.65) * 9.81  # N
    length, time = friction / 50, (0.5 / 50) ** 0.5  # m, s
    assert _quantity(tab, "progression") == pytest.approx([1e3 * motion.progression * length])
    speed = motion.progression * length * 8 / (2 * np.pi)
    assert _quantity(tab, "velocity") == pytest.approx([1e3 * speed])
    work = cs.performance(cs.solve_orbit(device.dimensionless())).work.value
    assert _quantity(tab, "work") == pytest.approx([1e3 * work * friction * length])
    assert sum(_quantity(tab, "losses")) == pytest.approx(1e3 * work * friction * length, rel=1e-4)
    first = motion.segments[0]
    for name, value in (
        ("duration (s)", first.duration * time),
        ("start in mm, mm/s", 1e3 * first.start_state[0] * length),
    ):
        cell = tab.locator(f"#segments tr >> nth=0 >> [data-name='{name}']").inner_text()
        assert float(cell.split(",")[0]) == pytest.approx(value, rel=1e-5)


def test_a_device_starts_and_is_drawn_in_si(open_page, tmp_path):
    friction = 0.2 * (0.5 + 1.65) * 9.81
    length, time = friction / 50, (0.5 / 50) ** 0.5
    tab = open_page("#units=device&P_d=4.5&x_r=0.03&v_r=0.1&phase=0.2")
    assert tab.locator(".control:has(#field-v_r) .unit").inner_text() == "m/s"
    tab.click("#share-open")
    found = re.search(r"state=\((.*)\), phase=([\d.]+)", tab.inner_text("#share-python"))
    given = [*map(float, found[1].split(",")), float(found[2])]
    assert given == pytest.approx([0.03 / length, 0.1 * time / length, 0.0, 0.2 / time])
    saved = {}
    for name in ("history-svg", "phase-svg", "points-csv"):
        with tab.expect_download() as got:
            tab.click(f"#save-{name}")
        got.value.save_as(tmp_path / name)
        saved[name] = re.sub(r"<[^>]*>", " ", (tmp_path / name).read_text())
    assert all(word in saved["history-svg"] for word in ("t (s)", "(mm)", "(mm/s)"))
    assert all(word in saved["phase-svg"] for word in ("(mm)", "(mm/s)"))
    assert saved["points-csv"].startswith("segment,field,time (s),x_r (mm),v_r (mm/s),")
    tab.get_by_role("button", name="Close").click()
    # The same motion from the same start, without units and back.
    _settled(tab, lambda: tab.select_option("#units-choice", "dimensionless"))
    assert float(tab.input_value("#field-x_r")) == pytest.approx(0.03 / length)
    assert not tab.locator(".control:has(#field-v_r) .unit").is_visible()
    _settled(tab, lambda: tab.select_option("#units-choice", "device"))
    assert float(tab.input_value("#field-phase")) == pytest.approx(0.2)
    # Diagrams and charts are of the dimensionless model, and say so.
    for view in ("diagram", "chart"):
        again = open_page(f"#view={view}&units=device&d_count=5&c_size=16")
        _until(
            again,
            f"/Points in|finished/.test(document.getElementById('{view}-status').textContent)",
        )
        again.click("#share-open")
        with again.expect_download() as got:
            again.click("#save-picture-svg")
        got.value.save_as(tmp_path / view)
        words = re.sub(r"<[^>]*>", "", (tmp_path / view).read_text())
        assert words.count(", dimensionless") == 2


def test_a_value_outside_its_range_is_refused_at_the_field(open_page):
    tab = open_page()
    for name, value, says in (
        ("alpha", "-1", "from 0 to"),
        ("omega", "0", "must be a number"),
        ("periods", "2.5", "a whole number"),
        ("alpha", "much", "must be a number"),
        ("phase", "50", "[0, 7.85398)"),
    ):
        tab.fill(f"#field-{name}", value)
        tab.locator(f"#field-{name}").press("Tab")
        assert says in tab.locator(f"#field-{name}-error").inner_text()
        assert tab.get_attribute(f"#field-{name}", "aria-invalid") == "true"
        tab.reload()
        tab.wait_for_selector("html[data-ready]")


def test_the_diagram_finds_the_bifurcations_that_the_package_finds(open_page):
    tab = open_page("#view=diagram&d_count=200")
    _until(tab, "/Points in/.test(document.getElementById('diagram-status').textContent)")
    rows = tab.locator("#marks tr").all_inner_texts()
    presets = json.loads((AXE.parents[2] / "presets.json").read_text())
    known = [one for one in presets["bifurcations"] if one["gamma"] == 3.3]
    assert len(rows) == len(known)
    for row, one in zip(rows, known, strict=True):
        assert float(re.search(r"= ([\d.]+)", row)[1]) == pytest.approx(one["alpha"], abs=2e-12)
        assert f"{one['type']} on {one['line'].partition('^')[0]}" in row
    _settled(
        tab, lambda: tab.get_by_role("button", name="Show the motion at bifurcation 6").click()
    )
    assert float(tab.input_value("#field-alpha")) == pytest.approx(known[5]["alpha"], abs=1e-12)


def test_a_chart_is_cancelled_and_chosen_from_by_keys(open_page):
    # Minutes of work, so that it is not done before it is looked at.
    tab = open_page("#view=chart&c_size=512&c_periods=10000&zeta=0")
    _until(tab, "/cells run$/.test(document.getElementById('chart-status').textContent)")
    tab.click("#chart-stop")
    _until(tab, "document.getElementById('chart-status').textContent === 'Stopped.'")
    for name, value in {"zeta": "0.05", "c_periods": "300", "c_size": "32"}.items():
        tab.fill(f"#field-{name}", value)
    _until(tab, "/finished in/.test(document.getElementById('chart-status').textContent)")
    chart = tab.locator("#chart")
    chart.focus()
    chart.press("ArrowRight")
    said = re.search(r"= ([\d.]+), ([\d.]+): ([F\d ]+)\.", tab.inner_text("#chart-status"))
    chart.press("Enter")
    _until(tab, "location.hash.includes('gamma')")
    tab.wait_for_selector("#itinerary b")
    assert _itinerary(tab) == tuple(said[3].split())


def test_all_is_in_the_address(open_page):
    tab = open_page()
    tab.fill("#field-alpha", "1.3")
    tab.fill("#field-v_r", "-0.25")
    tab.get_by_role("tab", name="Diagram").click()
    tab.select_option("#d-y", "progression")
    _until(tab, "location.hash.includes('d_y')")
    fragment = tab.evaluate("location.hash")
    assert set(fragment[1:].split("&")) == {
        "view=diagram", "d_y=progression", "alpha=1.3", "v_r=-0.25"
    }  # fmt: skip
    again = open_page(fragment)
    assert again.input_value("#field-v_r") == "-0.25"
    assert again.input_value("#d-y") == "progression"


@pytest.mark.parametrize(
    "address",
    [
        "#alpha=1.2&x_r=0.5&periods=200",
        "#alpha=1.31&omega=0.91&zeta=0.03&periods=300&x_r=0.4",  # slow
        "#alpha=1.31&omega=0.91&zeta=0.03&periods=2&x_r=0.4",  # not yet periodic
        "#alpha=0.001",  # at rest
        "#units=device&P_d=4.5&v_r=0.1&phase=0.2",
        "#scene=prototype&alpha=1.5&D=0.3&periods=300",
        "#scene=slope&units=device&slope=0.05&periods=300",
        "#scene=reaction_pulse&alpha_low=-0.5&x_r=0.4&periods=300",
    ],
)
def test_what_is_copied_runs(open_page, address):
    tab = open_page(address)
    tab.click("#share-open")
    names: dict[str, object] = {}
    exec(tab.inner_text("#share-python"), names)
    if "orbit" in names:
        assert names["orbit"].motion.itinerary == _itinerary(tab)
    else:
        assert "Not periodic" in tab.inner_text("#verdict")
        assert names["trajectory"].success


@pytest.mark.parametrize(
    "address",
    ["#scene=prototype&s=-0.05&D=0.3", "#scene=slope&units=device&slope=0.05", "#scene=reaction"],
)
def test_what_is_copied_of_a_scene_is_taken(open_page, tmp_path, monkeypatch, address):
    monkeypatch.chdir(tmp_path)
    for view in ("motion", "chart&c_size=16", "diagram&d_count=5"):
        tab = open_page(f"{address}&view={view}")
        tab.click("#share-open")
        text = tab.inner_text("#share-file")
        if "motion" not in view:
            scene = cs.inputs.read_plan(tomllib.loads(text)).parameters.scene
            assert address.startswith(f"#scene={scene.source}")
            continue
        Path("device.toml").write_text(text)
        given = cs.load_parameters("device.toml")
        assert address.startswith(f"#scene={given.scene.source}")
        command = tab.inner_text("#share-command").split()
        assert CliRunner().invoke(group, [*command[1:], "--json"]).exit_code == 0
        tab.get_by_role("button", name="Close").click()
        tab.set_input_files("#file", "device.toml")
        tab.wait_for_timeout(200)
        assert not tab.locator("#file-error").is_visible()


def test_commands_and_files_are_copied(open_page):
    tab = open_page("#alpha=1.2&x_r=0.5&periods=200")
    tab.click("#share-open")
    assert tomllib.loads(tab.inner_text("#share-file"))["alpha"] == 1.2
    command = tab.inner_text("#share-command").strip()
    assert command == "capsule-sym run --alpha 1.2 --state 0.5 0 0 --periods 200"


def test_motions_and_pictures_are_saved(open_page, tmp_path):
    tab = open_page()
    tab.click("#share-open")
    saved = {}
    for name in ("points-csv", "segments-csv", "phase-svg", "history-svg", "space-png"):
        with tab.expect_download() as got:
            tab.click(f"#save-{name}")
        saved[name] = tmp_path / name
        got.value.save_as(saved[name])
    header, first, *_ = saved["segments-csv"].read_text().splitlines()
    assert (header.split(",")[0], first.split(",")[0]) == ("field", "F5")
    assert len(saved["points-csv"].read_text().splitlines()) > 200
    assert saved["phase-svg"].read_text().startswith("<svg")
    assert saved["history-svg"].read_text().count("<path") > 3
    assert saved["space-png"].read_bytes().startswith(b"\x89PNG")


BOXES = """() => ['#tour', '.toured'].map((name) => {
    const { left, right, top, bottom } = document.querySelector(name).getBoundingClientRect();
    return [left, right, top, bottom];
})"""


@pytest.mark.parametrize("size", [(1280, 600), (390, 664)])
def test_the_tour_covers_nothing_that_it_tells_of_and_ends_by_keys(open_page, size):
    tab = open_page(viewport=dict(zip(("width", "height"), size, strict=True)))
    tab.get_by_role("button", name="Tour").press("Enter")
    seen = []
    while tab.locator("#tour[open]").count():
        seen.append(tab.locator(".toured").get_attribute("id"))
        card, told = tab.evaluate(BOXES)
        assert told[3] - told[2] > 20
        assert told[2] >= 0
        assert told[3] <= size[1]
        beside = card[0] >= told[1] or card[1] <= told[0]
        assert beside or card[2] >= told[3] or card[3] <= told[2]
        tab.locator("#tour .primary").press("Enter")
    assert len(seen) == len(set(seen)) == 8
    assert seen[-1] == "share-open"
    assert tab.locator(".toured").count() == 0
    tab.locator("#take-tour").press("Enter")
    tab.locator("#tour .primary").press("Enter")
    tab.locator("#take-tour").press("Enter")
    assert tab.locator(".toured").count() == 1
    tab.locator("#tab-chart").focus()
    tab.keyboard.press("Escape")
    _until(tab, "!document.querySelector('#tour[open], .toured')")


def test_back_undoes_the_last_change(open_page):
    tab = open_page()
    steps = tab.evaluate("history.length")
    tab.fill("#field-alpha", "0.9")
    _until(tab, "location.hash === '#alpha=0.9'")
    # However long it takes, a slider that moves makes one step.
    slider = tab.get_by_label("excitation amplitude, slider")
    box = slider.bounding_box()
    tab.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    tab.mouse.down()
    for share in (0.6, 0.7, 0.8):
        before = tab.evaluate("location.hash")
        tab.mouse.move(box["x"] + box["width"] * share, box["y"] + box["height"] / 2)
        _until(tab, f"location.hash !== '{before}'")
    tab.mouse.up()
    tab.get_by_role("tab", name="Diagram").click()
    _until(tab, "location.hash.includes('view=diagram')")
    assert tab.evaluate("history.length") == steps + 3
    tab.go_back()
    _until(tab, "!location.hash.includes('view')")
    assert tab.locator("#view-motion").is_visible()
    assert float(tab.input_value("#field-alpha")) > 1.4
    for expected in ("0.9", "0.7"):
        tab.go_back()
        _until(tab, f"document.getElementById('field-alpha').value === '{expected}'")
    tab.go_forward()
    _until(tab, "document.getElementById('field-alpha').value === '0.9'")


WORDS = ["scene", "alpha", "view", "units", "P_d", "d_from", "c_size", "x", "__proto__", "", "d_x",
         "c_x", "c_by", "phase", "plane", "around"]  # fmt: skip
VALUES = ["0", "1", "-1", "1e308", "1e-320", "NaN", "Infinity", "device", "chart", "<b>", "", "%00",
          "diagram", "0x10", "1,5", "constructor", "9" * 60, "attractor", "x_r",
          "v_r-v_c"]  # fmt: skip


def test_no_address_leaves_an_exception(open_page):
    """Ten thousand of them; what is refused is refused whole, what is taken is within its range."""
    tab = open_page()
    draw = random.Random(7)
    texts = []
    for _ in range(10_000):
        parts = [
            draw.choice(WORDS) + draw.choice(["=", "=", "=", "", "=="]) + draw.choice(VALUES)
            for _ in range(draw.randint(0, 5))
        ]
        texts.append("#" + draw.choice(["&", "&", "&", "&&", ";"]).join(parts))
    texts[:40] = [f"#alpha={draw.uniform(0, 3)}&omega={draw.uniform(0.05, 3)}" for _ in range(40)]
    refused = tab.evaluate(
        """async (texts) => {
            let refused = 0;
            const box = document.getElementById('refused');
            for (const [i, text] of texts.entries()) {
                // As the browser does, which would take so many changes for an attack.
                dispatchEvent(new HashChangeEvent('hashchange', { newURL: location.href + text }));
                refused += !box.hidden;
                if (i % 50 === 0) await new Promise((go) => requestAnimationFrame(go));
            }
            return refused;
        }""",
        texts,
    )
    assert 5_000 < refused < 10_000
    tab.evaluate("dispatchEvent(new HashChangeEvent('hashchange', {newURL: location.href}))")
    _until(tab, "document.getElementById('refused').hidden")


@pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed: make explorer")
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("view", ["motion", "diagram", "chart", "share", "tour"])
@pytest.mark.parametrize("scene", ["capsule", "prototype"])
@pytest.mark.parametrize("width", [390, 1280])
def test_axe_finds_no_violation(open_page, view, theme, width, scene):
    fragment = f"#view={view}&d_count=20&c_size=16" if view in ("diagram", "chart") else "#"
    fragment += f"&scene={scene}" if len(fragment) > 1 else f"scene={scene}"
    tab = open_page(fragment, color_scheme=theme, viewport={"width": width, "height": 900})
    if view == "share":
        tab.click("#share-open")
    if view == "tour":
        tab.click("#take-tour")
    if view in ("diagram", "chart"):
        _until(
            tab, f"/Points in|finished/.test(document.getElementById('{view}-status').textContent)"
        )
    # The engine is evaluated by the driver, not loaded by the page, whose policy would refuse it.
    tab.evaluate(AXE.read_text(encoding="utf-8"))
    found = tab.evaluate("axe.run()")["violations"]
    assert [(one["id"], one["nodes"][0]["html"]) for one in found] == []
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
