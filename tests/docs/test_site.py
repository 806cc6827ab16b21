"""The built documentation: what it must hold, and that it loads nothing from elsewhere."""

import re
from html.parser import HTMLParser
from pathlib import Path
from pydoc import locate

import click
import pytest

from capsule_sym._cli import group
from tests.examples import PAGES, README, ROOT

SITE = ROOT / "docs" / "_build" / "html"

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not SITE.exists(), reason="the documentation is not built: make docs"),
]


def pages() -> list[Path]:
    return sorted(SITE.rglob("*.html"))


def test_names_of_other_packages_link_to_their_pages() -> None:
    """No inventory is read at the build: each name has to be one of its package."""
    package = r"numpy|scipy|matplotlib|pandas"
    address = re.compile(rf'href="https://[^"]+[/#]((?:{package})\.[\w.]+?)(?:\.html)?"')
    linked = {name for page in pages() for name in address.findall(page.read_text("utf-8"))}
    assert {"numpy.ndarray", "scipy.integrate.solve_ivp", "matplotlib.axes.Axes"} <= linked
    assert [name for name in linked if locate(name) is None] == []


def test_a_sentence_with_a_colon_is_not_torn_apart() -> None:
    """Docstrings are sentences: what stands before a colon is no type."""
    assert list((SITE / "api").glob("*.html"))
    torn = [
        page.name for page in (SITE / "api").glob("*.html") if ">Type<" in page.read_text("utf-8")
    ]
    assert torn == []


def test_every_name_that_an_example_imports_is_documented() -> None:
    """Every name of Python that has a place in the pages is in the inventory."""
    inventory = pytest.importorskip("sphinx.util.inventory")
    with (SITE / "objects.inv").open("rb") as file:
        loaded = inventory.InventoryFile.load(file, "", lambda base, path: path)
    documented = {name for kind in loaded if kind.startswith("py:") for name in loaded[kind]}
    imported = {
        f"{module}.{name.strip()}"
        for page in [README, *PAGES]
        for module, names in re.findall(r"^ *from (capsule_sym\S*) import (.+)$", page.text, re.M)
        for name in names.split(",")
    }
    assert len(imported) > 10
    assert imported <= documented


def test_every_command_and_option_is_in_the_reference() -> None:
    """Options of all commands are there once, for COMMAND."""
    text = "".join(path.read_text(encoding="utf-8") for path in (SITE / "cli").glob("*.html"))
    for name in group.commands:
        _, command, _ = group.resolve_command(click.Context(group), [name])
        assert text.count(f'id="capsule-sym-{name}"') == 1
        for parameter in command.params:
            if isinstance(parameter, click.Option) and not parameter.hidden:
                for option in (one.strip("-") for one in parameter.opts):
                    anchors = (f"cmdoption-capsule-sym-{of}-{option}" for of in (name, "COMMAND"))
                    assert sum(text.count(f'id="{anchor}"') for anchor in anchors) == 1


class Loads(HTMLParser):
    """Resources that a page loads by itself, without links."""

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []

    def handle_starttag(self, tag, attrs) -> None:
        named = dict(attrs)
        if tag in {"script", "img", "iframe", "source", "object"}:
            self.loaded += [named[key] for key in ("src", "data") if named.get(key)]
        if tag == "link" and named.get("rel") not in {"canonical", "search", "next", "prev"}:
            self.loaded.append(named["href"])


@pytest.mark.parametrize("suffix", ["html", "css"])
def test_nothing_is_loaded_from_elsewhere(suffix: str) -> None:
    seen = 0
    for path in SITE.rglob(f"*.{suffix}"):
        text = path.read_text(encoding="utf-8")
        if suffix == "html":
            reader = Loads()
            reader.feed(text)
            loaded = reader.loaded
        else:
            loaded = re.findall(r"url\(['\"]?([^'\")]+)", text) + re.findall(
                r"@import\S* (\S+)", text
            )
        seen += len(loaded)
        assert [one for one in loaded if re.match(r"(https?:)?//", one)] == [], path
    assert seen or suffix == "css"


def test_formulas_are_typeset() -> None:
    for path in pages():
        text = path.read_text(encoding="utf-8")
        assert "MathJax" not in text
        assert '<span class="problematic"' not in text
    shown = [path.read_text(encoding="utf-8") for path in SITE.glob("paper/statements/*.html")]
    assert len(shown) == 3
    assert sum(text.count("<math") for text in shown) > 300
    # Each section of the proofs is in one page.
    found = [(ROOT / "results" / name).read_text("utf-8") for name in ("claims.md", "verify.md")]
    titles = re.findall(r"^## (.+)$", "\n".join(found), re.M)
    pages_of = [*shown, (SITE / "paper" / "errata.html").read_text(encoding="utf-8")]
    # The errata are a page of their own, and the tables have titles of their own beside the map.
    for title in (t for t in titles if t not in ("Errata", "Tables 1 and 2", "Table 3")):
        words = title.replace("Printed statements that hold under", "Those that hold under")
        assert sum(f">{words}<a" in text for text in pages_of) == 1, title


def test_every_picture_has_a_text() -> None:
    for path in pages():
        for picture in re.findall(r"<img [^>]*>", path.read_text(encoding="utf-8")):
            assert re.search(r'alt="[^"]{10,}"', picture), (path, picture)


def test_the_python_interface_is_shown_as_it_is_written() -> None:
    for path in SITE.glob("api/*.html"):
        text = re.sub(r"<[^>]+>", "", path.read_text(encoding="utf-8"))
        assert (
            re.findall(r"_SupportsArray|ndarray\[tuple|~capsule_sym|&lt;factory&gt;", text) == []
        ), path
        assert re.findall(r"Alias for field number|\w\^?`\w+`", text) == [], path
