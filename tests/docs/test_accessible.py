"""Every built page in headless Chromium: no barrier found by axe-core, no overflow."""

import pytest

from explorer.tests.conftest import AXE, browser  # noqa: F401
from tests.docs.test_site import SITE
from tests.examples import PAGES
from tests.sampling import ALL

BUILT = sorted(page.relative_to(SITE).as_posix() for page in SITE.rglob("*.html"))
OWN = ("_static/page.html", "_modules/")  # the explorer has its own tests, sources have none
BUILT = [page for page in BUILT if not page.startswith(OWN)]

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not SITE.exists(), reason="the documentation is not built: make docs"),
    pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed: make explorer"),
]


# Of the pages on a wide screen one of each kind is looked at, unless all are requested.
KINDS = [
    *("index.html", "api/figures.html", "theory/system.html", "performance.html"),
    *("glossary.html", "cli/orbits.html", "api/run.html"),
]
LOOKS = {"phone": ("dark", 390, BUILT), "wide": ("light", 1280, BUILT if ALL else KINDS)}
# Parts of formulas, of which a page has up to ten thousand, say nothing and look as the text beside
# them, so that each formula can stand for its parts as one text; of axe's findings only violations
# are reported, since the others cost as much again.
OF_THEIR_OWN = """[...document.querySelectorAll("math")].flatMap((formula) => {
  const { color } = getComputedStyle(formula.parentElement);
  return [formula, ...formula.querySelectorAll("*")].filter((part) => {
    const looks = getComputedStyle(part);
    return looks.color !== color || looks.backgroundColor !== "rgba(0, 0, 0, 0)"
      || part.matches("[role], [tabindex], [href], [aria-hidden], [aria-label]");
  }).map((part) => part.outerHTML);
})"""
AS_TEXTS = """document.querySelectorAll("math").forEach((formula) =>
  formula.replaceChildren(document.createTextNode(formula.textContent)))"""
VIOLATIONS = """axe.run(document, { resultTypes: ["violations"] }).then((done) =>
  done.violations.map((one) => [one.id, one.nodes[0].html]))"""


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
    names = [page.name.replace("paper/pages/", "paper/") for page in PAGES]
    sources = {name.removeprefix("docs/").replace(".md", ".html") for name in names}
    assert sources | {"search.html", "genindex.html"} <= set(BUILT)


@pytest.mark.parametrize(
    ("tab", "page"), [(look, page) for look in LOOKS for page in LOOKS[look][2]], indirect=["tab"]
)
def test_axe_finds_no_violation(tab, page) -> None:
    asked: list[str] = []
    tab.on("request", note := lambda request: asked.append(request.url))
    tab.goto((SITE / page).as_uri())
    tab.remove_listener("request", note)
    assert [url for url in asked if not url.startswith("file:")] == []
    assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert tab.evaluate("document.querySelectorAll('h1').length") == 1
    assert tab.evaluate(OF_THEIR_OWN) == []
    tab.evaluate(AS_TEXTS)
    tab.evaluate(AXE.read_text(encoding="utf-8"))
    assert tab.evaluate(VIOLATIONS) == []
