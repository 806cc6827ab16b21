"""Measures the page in headless Chromium, each figure beside its goal."""

from __future__ import annotations

import os
import shutil
import statistics
import sys
from time import monotonic
from typing import Any

from build import PAGE
from playwright.sync_api import sync_playwright

_RUNS = 20


def _opened(browser: Any, fragment: str = "") -> Any:
    context = browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    tab = context.new_page()
    tab.goto(PAGE.as_uri() + fragment)
    tab.wait_for_selector("html[data-ready]", timeout=120_000)
    return tab


def _first_motion(browser: Any) -> tuple[float, float]:
    """Milliseconds from the start of loading to the end of the first picture.

    Then those of them that the page's own thread worked, until it was ready: a machine that has
    other work does not lengthen these.
    """
    context = browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    tab = context.new_page()
    inside = context.new_cdp_session(tab)
    inside.send("Performance.enable", {"timeDomain": "threadTicks"})
    tab.goto(PAGE.as_uri())
    tab.wait_for_selector("html[data-ready]", timeout=120_000)
    metrics = inside.send("Performance.getMetrics")["metrics"]
    worked = next(one["value"] for one in metrics if one["name"] == "TaskDuration")
    found = tab.evaluate(
        "(() => { const one = performance.getEntriesByName('picture')[0];"
        " return one.startTime + one.duration; })()"
    )
    context.close()
    return float(found), 1000 * float(worked)


def _slider(browser: Any) -> list[float]:
    """Milliseconds from a slider's event to the end of the drawing of all panels."""
    tab = _opened(browser)
    found = tab.evaluate(
        """async () => {
            const slider = document.querySelector('#field-alpha').closest('.control')
                .querySelector('.slider');
            const taken = [];
            for (let i = 0; i < 60; i++) {
                slider.value = String(0.6 + 0.01 * i);
                performance.clearMeasures();
                const begun = performance.now();
                slider.dispatchEvent(new Event('input'));
                const told = performance.now() - begun;
                await new Promise((go) => requestAnimationFrame(() => setTimeout(go)));
                const [picture] = performance.getEntriesByName('picture');
                if (picture && i >= 20) taken.push(told + picture.duration);
            }
            return taken;
        }"""
    )
    tab.context.close()
    return [float(value) for value in found]


def _status(browser: Any, view: str, pattern: str) -> str:
    tab = _opened(browser, f"#view={view}")
    # The page's policy lets the driver wait for no expression in it.
    while pattern not in tab.inner_text(f"#{view}-status"):
        tab.wait_for_timeout(100)
    text = str(tab.inner_text(f"#{view}-status"))
    tab.context.close()
    return text


def main() -> None:
    """Print the figures, and the load of the machine before and after."""
    names = ("chromium", "chromium-browser", "google-chrome")
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        sys.exit(f"none of {', '.join(names)} is there")
    begun, load = monotonic(), os.getloadavg()[0]
    print(f"{'size of the page':44}{PAGE.stat().st_size / 1000:10.0f} kB      goal 1000 kB")
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=found, args=["--no-sandbox"])
        opened = [_first_motion(browser) for _ in range(_RUNS)]
        _print("opening to the first motion drawn", [one for one, _ in opened], "300 ms")
        _print("of it the page's own thread", [one for _, one in opened], "300 ms")
        _print("slider to new picture, all panels", _slider(browser), "16 ms")
        for view, pattern, goal in (
            ("diagram", "Points in", "points in 1 s"),
            ("chart", "finished in", "first picture 0.5 s, finished 60 s"),
        ):
            print(f"{view}: {_status(browser, view, pattern)}\n{'':54}      goal {goal}")
        browser.close()
    print(f"{os.cpu_count()} cores, load {load:.1f} before and {os.getloadavg()[0]:.1f} after; "
          f"{monotonic() - begun:.0f} s")  # fmt: skip


def _print(name: str, values: list[float], goal: str) -> None:
    least, middle, most = min(values), statistics.median(values), max(values)
    print(f"{name:44}{middle:10.1f} ms      goal {goal} (least {least:.1f}, most {most:.1f})")


if __name__ == "__main__":
    main()
