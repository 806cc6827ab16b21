"""A built page of each kind in headless Chromium: no barrier that axe-core knows, no overflow."""

import pytest

from tests.docs.test_site import SITE
from tests.explorer.conftest import AXE, browser  # noqa: F401

KINDS = [
    "index",
    "gallery",
    "quickstart",
    "theory/system",
    "performance",
    "glossary",
    "cli",
    "api/run",
]

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not SITE.exists(), reason="the documentation is not built: make docs"),
    pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed: make explorer"),
]


@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 390)])
@pytest.mark.parametrize("page", KINDS)
def test_axe_finds_no_violation(browser, page, theme, width) -> None:  # noqa: F811
    context = browser.new_context(
        color_scheme=theme, viewport={"width": width, "height": 900}, reduced_motion="reduce"
    )
    context.set_default_timeout(120_000)
    asked: list[str] = []
    tab = context.new_page()
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto((SITE / f"{page}.html").as_uri())
    tab.evaluate(AXE.read_text(encoding="utf-8"))
    found = tab.evaluate("axe.run()")["violations"]
    assert [(one["id"], one["nodes"][0]["html"]) for one in found] == []
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    assert [url for url in asked if not url.startswith("file:")] == []
    context.close()
