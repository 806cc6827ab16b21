"""Writes presets.json, the case study as data of the page: panels of Fig. 7, and bifurcations."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from capsule_sym import Parameters, continue_orbit, solve_orbit
from capsule_sym.results import Bifurcation, Orbit
from paper.printed import read, row_at
from paper.study.casestudy import GAMMAS, PANELS
from paper.study.thresholds import FIRST, LAST, PRINTED


def presets() -> dict[str, Any]:
    """Panels by letter, a system with two attractors, and exact and printed bifurcations."""
    return {
        "scene": "capsule",
        "gammas": list(GAMMAS),
        "panels": [
            {"panel": panel, "alpha": alpha, "printed": row_at(read(), alpha).map}
            for panel, alpha in PANELS.items()
        ],
        "basin": {"alpha": 2.8, "omega": 0.4, "zeta": 0.01, "beta": 5.0, "gamma": 5.0},
        "bifurcations": [one for gamma in GAMMAS for one in _bifurcations(gamma)],
    }


def _bifurcations(gamma: float) -> list[dict[str, Any]]:
    start = solve_orbit(Parameters(alpha=FIRST, gamma=gamma))
    if not isinstance(start, Orbit):
        raise ArithmeticError(start.detail)
    return [
        {
            "gamma": gamma,
            "alpha": one.value,
            "type": one.type,
            "line": one.line,
            "printed": _printed(one),
        }
        for one in continue_orbit(start, "alpha", LAST).bifurcations
    ]


def _printed(one: Bifurcation) -> float | None:
    """Printed alpha of a bifurcation; None if it is not printed."""
    alike = (p for p in PRINTED if p.type == one.type and one.line.startswith(p.line))
    return next((float(event.alpha) for event in alike), None)


if __name__ == "__main__":
    text = json.dumps(presets(), ensure_ascii=False, indent=1) + "\n"
    Path(__file__).with_name("presets.json").write_text(text, encoding="utf-8")
