"""Every built page in headless Chromium: no barrier that axe-core knows, no overflow."""

import pytest

from tests.docs.test_site import SITE
from tests.examples import PAGES
from tests.explorer.conftest import AXE, browser  # noqa: F401
from tests.sampling import ALL

BUILT = sorted(page.relative_to(SITE).as_posix() for page in SITE.rglob("*.html"))

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not SITE.exists(), reason="the documentation is not built: make docs"),
    pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed: make explorer"),
]


# Of the pages on a wide screen one of each kind is looked at, unless all are asked for.
KINDS = [
    *("index.html", "gallery.html", "theory/system.html", "performance.html"),
    *("glossary.html", "cli.html", "api/run.html", "notebooks/run.html"),
]
LOOKS = {"phone": ("dark", 390, BUILT), "wide": ("light", 1280, BUILT if ALL else KINDS)}


@pytest.fixture(scope="module", params=LOOKS)
def tab(request, browser):  # noqa: F811
    theme, width, _ = LOOKS[request.param]
    context = browser.new_context(
        color_scheme=theme, viewport={"width": width, "height": 900}, reduced_motion="reduce"
    )
    context.set_default_timeout(120_000)
    yield context.new_page()
    context.close()


def test_every_page_is_looked_at() -> None:
    sources = {page.name.removeprefix("docs/").replace(".md", ".html") for page in PAGES}
    assert sources | {"search.html", "genindex.html"} <= set(BUILT)


@pytest.mark.parametrize(
    ("tab", "page"), [(look, page) for look in LOOKS for page in LOOKS[look][2]], indirect=["tab"]
)
def test_axe_finds_no_violation(tab, page) -> None:
    asked: list[str] = []
    tab.on("request", note := lambda request: asked.append(request.url))
    tab.goto((SITE / page).as_uri())
    tab.remove_listener("request", note)
    tab.evaluate(AXE.read_text(encoding="utf-8"))
    found = tab.evaluate("axe.run()")["violations"]
    assert [(one["id"], one["nodes"][0]["html"]) for one in found] == []
    assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert tab.evaluate("document.querySelectorAll('h1').length") == 1
    assert [url for url in asked if not url.startswith("file:")] == []
