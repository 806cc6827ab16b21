"""The case study of Section 4: the global maps printed in the paper, and the exact ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import capsule_sym
from capsule_sym import Parameters, simulate
from capsule_sym._map.interface import default_backend
from capsule_sym._records import dumps, motion_record, segment_record, table
from capsule_sym._records import write as write_texts
from capsule_sym.generated.capsule import DIGEST
from capsule_sym.inputs import SceneParameters
from capsule_sym.results import SteadyMotion, Trajectory
from paper import printed as paper

_PAPER = paper.read()
_BLOCK = 64  # excitation periods between two tests for a steady motion
_MOST_PERIODS = 4096

PANELS = {name: float(alpha) for name, alpha in paper.panels(_PAPER).items()}
"""Excitation amplitude alpha of each panel of Fig. 7."""

GAMMAS = (float(_PAPER["section.4.parameters"]["gamma"]), 3.0)
"""Mass ratios of the two runs: the printed one, and one that yields the printed maps."""

THRESHOLDS = frozenset(float(row.high) for row in paper.section_4(_PAPER)[:-1])
"""Printed bifurcation values of alpha, rounded to four digits. The motion computed at one of them
is that of one side or the other."""


def local_maps(global_map: str) -> list[str]:
    """The local maps of a global map, composed right to left, in order of time."""
    return global_map.split(" ∘ ")[::-1]


def same_motion(first: str, second: str) -> bool:
    """True if two global maps are the same cyclic sequence of local maps."""
    a, b = local_maps(first), local_maps(second)
    return any(a == b[i:] + b[:i] for i in range(len(b)))


@dataclass(frozen=True, slots=True)
class Case:
    """The case study at one gamma and one panel of Fig. 7, run from rest."""

    panel: str
    parameters: SceneParameters
    periods: int
    """Number of excitation periods run."""
    motion: SteadyMotion | None
    """None if the run has not settled within `periods`."""

    @property
    def printed(self) -> str:
        """Global map printed in the paper."""
        return paper.row_at(_PAPER, self.parameters.alpha).map

    @property
    def agrees(self) -> bool:
        """True if the exact global map is the printed one."""
        return self.motion is not None and same_motion(self.motion.global_map, self.printed)


def from_rest(parameters: Parameters) -> tuple[int, Trajectory, SteadyMotion | None]:
    """Run from rest until its motion is steady: number of periods, last part of the run, motion.

    The motion is None if it is not steady within 4096 periods, or if the run failed.
    """
    state, periods = (0.0, 0.0, 0.0), 0
    while True:
        trajectory = simulate(parameters, state, periods=_BLOCK)
        periods += _BLOCK
        motion = trajectory.steady() if trajectory.success else None
        if motion or not trajectory.success or periods >= _MOST_PERIODS:
            return periods, trajectory, motion
        # A run ends at phase 0, where the next one begins.
        _, state = trajectory.final


def run() -> Iterator[Case]:
    """Cases, `GAMMAS` by `PANELS`, each run from rest until the motion is steady."""
    for gamma in GAMMAS:
        for panel, alpha in PANELS.items():
            parameters = Parameters(alpha=alpha, gamma=gamma)
            periods, _, motion = from_rest(parameters)
            yield Case(panel, parameters, periods, motion)


def record(cases: list[Case]) -> dict[str, Any]:
    """All results with their provenance, ready for JSON; see `records` for the steady motions."""
    return {
        "version": capsule_sym.__version__,
        "generated": DIGEST,
        "backend": default_backend(),
        "start": {"phase": 0.0, "state": [0.0, 0.0, 0.0]},
        "cases": [
            {
                "panel": case.panel,
                "parameters": case.parameters.to_dict(),
                "periods": case.periods,
                "printed_global_map": case.printed,
                "at_printed_threshold": case.parameters.alpha in THRESHOLDS,
                "agrees": case.agrees,
                **motion_record(case.motion),
                "segments": [segment_record(s) for s in case.motion.segments]
                if case.motion
                else [],
            }
            for case in cases
        ],
    }


def write(result: dict[str, Any], directory: Path) -> list[Path]:
    """Write casestudy.json from `record`, and from it cases.csv and segments.csv.

    Files are written whole or not at all. Returns their paths; raises `InvalidInput` if they cannot
    be written.
    """
    texts = {
        "casestudy.json": dumps(result) + "\n",
        "cases.csv": table(_case_rows(result)),
        "segments.csv": table(_segment_rows(result)),
    }
    return write_texts(texts, directory)


_OF_CASE = (
    *("periods", "agrees", "at_printed_threshold", "global_map", "printed_global_map"),
    *("period_number", "progression"),
)


def _case_rows(result: dict[str, Any]) -> list[dict[str, Any]]:
    about = {name: result[name] for name in ("version", "generated")}
    return [
        {"panel": case["panel"], **case["parameters"], **{n: case[n] for n in _OF_CASE}, **about}
        for case in result["cases"]
    ]


def _segment_rows(result: dict[str, Any]) -> list[dict[str, Any]]:
    return [
        {
            "gamma": case["parameters"]["gamma"],
            "alpha": case["parameters"]["alpha"],
            "panel": case["panel"],
            "local_map": segment["local_map"],
            "mode": segment["mode"],
            **_columns("start", segment["start"]),
            **_columns("end", segment["end"]),
            "outcome": segment["outcome"],
        }
        for case in result["cases"]
        for segment in case["segments"]
    ]


def _columns(prefix: str, point: dict[str, Any]) -> dict[str, Any]:
    state = zip(("x_r", "v_r", "v_c"), point["state"], strict=True)
    values = {"period": point["period"], "phase": point["phase"], **dict(state)}
    return {f"{prefix}_{name}": value for name, value in values.items()}
