"""Pictures of pages on tasks, scenes and theory: one on the first screen."""

import pytest

from explorer.tests.conftest import browser  # noqa: F401
from tests.docs.test_site import SITE
from tests.examples import ROOT

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not SITE.exists(), reason="the documentation is not built: make docs"),
]

SHOWING = sorted(
    page.relative_to(ROOT / "docs").with_suffix(".html").as_posix()
    for folder in ("howto", "scenes", "theory", "tutorials")
    for page in (ROOT / "docs" / folder).glob("*.md")
)
SCREENS = {"wide": (1280, 800), "phone": (390, 844)}
# Of the first picture that is seen: its width, and the share of it that is on the first screen.
FIRST = """() => {
  const seen = [...document.querySelectorAll("article img")]
    .map((image) => image.getBoundingClientRect())
    .filter((box) => box.width > 0 && box.height > 0);
  if (!seen.length) return [0, 0];
  return [seen[0].width, (innerHeight - seen[0].top) / seen[0].height];
}"""


@pytest.fixture(scope="module", params=SCREENS)
def tab(request, browser):  # noqa: F811
    width, height = SCREENS[request.param]
    context = browser.new_context(viewport={"width": width, "height": height})
    context.set_default_timeout(120_000)
    yield context.new_page()
    context.close()


def test_how_tos_and_tutorials_are_known() -> None:
    assert len(SHOWING) > 25


@pytest.mark.parametrize(
    ("tab", "page"), [(look, page) for look in SCREENS for page in SHOWING], indirect=["tab"]
)
def test_a_picture_is_on_the_first_screen(tab, page: str) -> None:
    tab.goto((SITE / page).as_uri())
    width, share = tab.evaluate(FIRST)
    assert width >= 250
    assert share >= 0.5
    assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
