"""The page of HTML: complete, self-contained, and honest about what is not there yet."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from matplotlib.figure import Figure

from capsule_sym import _explorer as explorer
from capsule_sym._figures.portraits import field_handles
from explorer.tests.conftest import AXE, browser  # noqa: F401
from paper import printed as paper
from paper.figures import catalogue, report
from paper.figures.report import EQUATIONS
from tests.figures import SAFE, untracked

FEW = ("motion",)
RESULTS = Path(__file__).parent / "results.json"


class Reader(HTMLParser):
    """References of a page, its anchors, its text, and the nesting of its elements."""

    EMPTY = frozenset({"meta", "link", "img", "br"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []
        self.targets: list[str] = []
        self.names: set[str] = set()
        self.images: list[dict[str, str]] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        if tag not in self.EMPTY:
            self.open.append(tag)
        if tag == "img":
            self.images.append(values)
        if "id" in values:
            assert values["id"] not in self.names
            self.names.add(values["id"])
        self.targets += [v[1:] for n, v in values.items() if n == "href" and v.startswith("#")]
        self.references += [
            value
            for name, value in values.items()
            if name in ("src", "href", "srcset", "poster", "action", "data", "style")
            and not value.startswith(("#", "data:"))
        ]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag
        if tag == "td":
            self.words.append(" ")

    def handle_data(self, text: str) -> None:
        self.words.append(text)


def read(text: str) -> Reader:
    reader = Reader()
    reader.feed(text)
    reader.close()
    assert reader.open == []
    return reader


@pytest.fixture
def plain(few: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same with pictures that take no time to draw."""
    monkeypatch.setattr(report, "_svg", lambda figure: "")
    blank = Figure()
    empty = {name: replace(catalogue.FIGURES[name], make=lambda study: blank) for name in FEW}
    monkeypatch.setattr(report, "FIGURES", empty)
    return few


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch, here: Path) -> Path:
    """An empty directory, and a page of few figures."""
    monkeypatch.setattr(report, "FIGURES", {name: catalogue.FIGURES[name] for name in FEW})
    return here


def results(directory: Path) -> None:
    """Files as the other commands leave them, each with a little in it."""
    for path, content in json.loads(RESULTS.read_text(encoding="utf-8")).items():
        file = directory / "results" / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(content), encoding="utf-8")
    picture = directory / "results/bench/bench.svg"
    picture.write_text('<svg width="504pt" height="216pt"></svg>', encoding="utf-8")


def test_places_of_the_paper_are_in_order_with_what_is_proved_of_them() -> None:
    here = [entry.place for entry in paper.read()]
    names = [f"printed.{number}" for number in range(len(here))]
    items = [
        {"id": name, "equation": place, "printed": "p"}
        for name, place in zip(names, here, strict=True)
    ]
    told = report._lines({"items": [{"id": "inner", "equation": "Table 2"}, *items[::-1]]})
    assert [place for place, _ in told] == list(dict.fromkeys(here))
    assert sorted(one["id"] for _, held in told for one in held) == sorted(names)
    assert all(one["equation"] == place for place, held in told for one in held)


def test_a_page_without_results_says_how_to_make_them(plain: Path) -> None:
    page = read(report.page(untracked))
    text = "".join(page.words)
    assert text.count("No result yet") == 5
    for command in (
        "python -m paper case-study --out results/paper",
        "python -m paper",
        "python -m benchmarks bench --out results/bench",
    ):
        assert command in text
    # One figure needs no results of other commands, and is drawn at both gamma.
    assert len(page.images) == 2


@pytest.mark.long
def test_a_page_holds_all_that_it_shows(few: Path) -> None:
    results(few)
    page = read(report.page(untracked))
    # The explorer is written beside it.
    assert {reference.partition("#")[0] for reference in page.references} == {"explorer.html"}
    assert set(page.targets) <= page.names
    assert len(page.images) == 3
    for image in page.images:
        assert image["alt"]
        kind, _, content = image["src"].partition(",")
        assert kind == "data:image/svg+xml"
        drawing = unquote(content)
        assert "</svg>" in drawing
        assert not re.search(r'(href|src)="(?!#)', drawing)
        assert not re.search(r"url\((?!#)", drawing)
        assert "@import" not in drawing


def colours_of(source: str) -> set[str]:
    """The colours of a page's drawing, as its data URI holds it."""
    return set(re.findall("#[0-9a-f]{6}", unquote(source)))


def test_a_picture_of_the_page_has_the_six_colours_of_the_fields(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    crowded = Figure(figsize=(4, 2))
    axes = crowded.subplots()
    for turn, colour in enumerate(10 * SAFE):
        axes.plot(np.cos(np.arange(40) + turn), color=colour, linewidth=0.7)
        axes.axvspan(turn, turn + 1, color=colour, alpha=0.16, linewidth=0)
    entry = replace(catalogue.FIGURES["fig6"], make=lambda study: crowded)
    monkeypatch.setattr(report, "FIGURES", {"fig6": entry})
    first, _ = read(report.page(untracked)).images
    assert {colour.lower() for colour in SAFE} <= colours_of(first["src"])


def test_a_page_shows_what_the_results_say(plain: Path) -> None:
    results(plain)
    source = report.page(untracked)
    text = re.sub(r"\s+", " ", "".join(read(source).words))
    assert "No result yet" not in text
    assert "0.3* PΣ5,F2,Σ2 ∘ PΣ2,F5,Σ5 IdΣ2,F2,Σ2 0.125000000" in text
    assert "c 0.3* not steady the same" in text
    assert "a <b> cr on L2(1)" in text
    assert "erratum.x" in text
    errata, lines = text.split("The paper line by line")
    assert "confirmed.x" not in errata
    assert "as printed proved by <it> confirmed.x" in lines
    assert "Eq. (23): 2 statements, 1 refuted" in lines
    assert "1 refuted, 1 proved" in text
    assert "1 of 1 hard cases" in text
    assert "ours double 0.7 1.0e-15 0 0 " in text
    assert "theirs double 1.23e+03 – 0 0 " in text
    assert "finds all switches in 0 of them, SciPy’s solve_ivp with events in 1" in text
    assert "<sub>Σ5,F2,Σ2</sub>" in source
    assert "python -m paper figure motion --out motion.svg --gamma 3.0" in text


def test_exact_values_stand_beside_the_printed(plain: Path) -> None:
    results(plain)
    text = re.sub(r"\s+", " ", "".join(read(report.page(untracked)).words))
    assert "adding-sliding L2(2) 0.500000000000 0.51 4 +2.00 % F5 F2 F5 F4 F5 F2 " in text
    assert "fold 0.750000000000 none F2 none " in text
    assert "What follows." in text


@pytest.mark.parametrize(
    ("text", "html"),
    [
        ("P_{Σ5,F2,Σ2}", "P<sub>Σ5,F2,Σ2</sub>"),
        ("2ζ f_b < v_r", "2ζ f<sub>b</sub> &lt; v<sub>r</sub>"),
        ("L2^(1)", "L2<sup>(1)</sup>"),
        ("table2.L4.one_way", "table2.L4.one_way"),
    ],
)
def test_mathematics_becomes_html(text: str, html: str) -> None:
    assert str(report.maths(text)) == html


def test_a_printed_formula_is_typeset() -> None:
    shown = str(report.formulas("slip for P2 >= delta, a_b"))
    assert shown.startswith('slip for <span class="formula"><math')
    assert "<mo>≥</mo>" in shown


def test_a_page_that_cannot_be_written_leaves_nothing(plain: Path) -> None:
    from capsule_sym import InvalidInput

    (plain / "file").write_text("")
    with pytest.raises(InvalidInput, match="must be writable"):
        report.write(plain / "file" / "report.html", untracked)
    report.write(plain / "new" / "report.html", untracked)
    assert {path.name for path in (plain / "new").iterdir()} == {"report.html", "explorer.html"}
    with pytest.raises(InvalidInput, match=r"other than explorer\.html"):
        report.write(plain / "new" / "explorer.html", untracked)


def test_a_motion_leads_to_the_explorer(plain: Path) -> None:
    results(plain)
    report.write(plain / "new" / "report.html", untracked)
    links = read((plain / "new" / "report.html").read_text(encoding="utf-8")).references
    assert "explorer.html#alpha=0.3&gamma=3.3&periods=400" in links
    assert (plain / "new" / "explorer.html").read_text(encoding="utf-8") == explorer.page()


def test_a_page_opens_with_what_was_found(plain: Path) -> None:
    results(plain)
    page = report.page(untracked)
    text = re.sub(r"\s+", " ", "".join(read(page).words))
    findings = text[: text.index("The state is")]
    assert "exact map gives the printed global map in 1 of 2 panels of Fig. 7." in findings
    assert "Of 2 statements put to proof, 1 refuted, 1 proved." in findings
    assert "1 of 1 hard cases end as 50 digits have them" in findings
    assert page.count("<math") > len(EQUATIONS)
    assert page.index('id="findings"') < page.index('id="system"') < page.index('id="errata"')


def test_what_is_refuted_is_apart_from_what_is_confirmed(plain: Path) -> None:
    results(plain)
    path = plain / "results" / "verify.json"
    proofs = json.loads(path.read_text(encoding="utf-8"))
    conditional = proofs["items"][0] | {"id": "held.x", "status": "conditional"}
    proofs["items"].append(conditional)
    path.write_text(json.dumps(proofs), encoding="utf-8")
    page = report.page(untracked)
    errata, confirmed = page.split('<section id="confirmed">')
    confirmed, lines = confirmed.split('<section id="lines">')
    assert 'id="erratum.x"' in errata
    assert "held.x" not in errata.split('<section id="errata">')[1]
    assert 'id="held.x"' in confirmed
    assert "erratum.x" not in confirmed
    assert "confirmed.x" in lines


def test_every_figure_is_told_in_words() -> None:
    for name, entry in catalogue.FIGURES.items():
        assert len(entry.seen.split()) >= 15, name
        assert entry.title not in entry.seen


@pytest.mark.long
@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 390)])
def test_axe_finds_no_violation(few: Path, browser, theme, width) -> None:  # noqa: F811
    if not AXE.exists():
        pytest.skip("axe-core is not installed: make explorer")
    results(few)
    report.write(few / "report.html", untracked)
    context = browser.new_context(
        color_scheme=theme, viewport={"width": width, "height": 900}, reduced_motion="reduce"
    )
    context.set_default_timeout(120_000)
    tab = context.new_page()
    said: list[str] = []
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.goto((few / "report.html").as_uri())
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    tab.evaluate(AXE.read_text(encoding="utf-8"))
    found = tab.evaluate("axe.run()")["violations"]
    assert [(one["id"], one["nodes"][0]["html"]) for one in found] == []
    # A figure opens by a touch, over the whole window, and closes by the keyboard.
    tab.locator("button.enlarge").first.click()
    assert tab.locator("dialog[open] img").get_attribute("alt")
    assert tab.evaluate("document.activeElement.textContent") == "Close"
    tab.keyboard.press("Escape")
    assert tab.locator("dialog[open]").count() == 0
    # The contents stay in view.
    tab.evaluate("scrollTo(0, document.body.scrollHeight)")
    assert 0 <= tab.evaluate("document.querySelector('nav').getBoundingClientRect().top") < 60
    assert said == []
    context.close()


@pytest.mark.long
def test_processes_draw_the_same_page(few: Path) -> None:
    alone = report.page(untracked)
    assert report.page(untracked, 2) == alone
    assert len(read(alone).images) == 2


@pytest.mark.long
def test_the_whole_page_is_small_and_has_the_colours_that_were_drawn(here: Path) -> None:
    results(here)
    legends, svg = [], report._svg

    def seen(figure: Figure) -> str:
        legends.append({one.get_color().lower() for one in field_handles(figure)})
        return svg(figure)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "_svg", seen)
        text = report.page(untracked)
    assert len(text.encode()) < 6_500_000 - 400_000  # of real tables
    images = [image["src"] for image in read(text).images][: len(legends)]
    assert sum(len(fields) == 6 for fields in legends) >= 12
    for source, fields in zip(images, legends, strict=True):
        assert fields <= colours_of(source)
