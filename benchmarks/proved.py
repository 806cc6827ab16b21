"""Picture of the proved parts in a file of `enclose --from-rest` or `--region`.

Open parts are white. The file may be compressed (.gz):
`python -m benchmarks.proved FILE --out PICTURE.png`.
"""

from __future__ import annotations

import argparse
import gzip
import json
from pathlib import Path

from matplotlib.figure import Figure

from capsule_sym._enclosures.case import ALPHA, GAMMA
from capsule_sym._enclosures.regions.parts import AlphaPart, Patch

Rectangle = tuple[float, float, float, float]
"""Least alpha, width, least ordinate, height."""


def rectangles(path: Path) -> tuple[bool, dict[str, list[Rectangle]]]:
    """True for a plane, and the proved rectangles by itinerary."""
    text = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    records = [json.loads(line) for line in text.splitlines()[1:]]
    plane = any(len(one["part"]) == len(Patch._fields) for one in records)
    found: dict[str, list[Rectangle]] = {}
    for one in records:
        if "itinerary" not in one:
            continue
        itinerary = one["itinerary"].partition(",")[0]
        if plane:
            patch = Patch(*one["part"])
            (alpha, gamma), (wide, high) = patch.middle, patch.radii
            places = [(alpha - wide, 2 * wide, gamma - high, 2 * high)]
        else:
            part = AlphaPart(*one["part"])
            alphas, rows = part.alphas, {"3.3": 1.0, "3.0": 0.0}
            left, width = alphas.middle - alphas.radius, 2 * alphas.radius
            places = [(left, width, rows[gamma], 0.8) for gamma in part.gammas]
        found.setdefault(itinerary, []).extend(places)
    return plane, found


def drawn(plane: bool, found: dict[str, list[Rectangle]]) -> Figure:
    """One colour for each itinerary, on white."""
    figure = Figure(figsize=(9, 6 if plane else 2.4), layout="constrained")
    axes = figure.add_subplot()
    for number, (itinerary, places) in enumerate(sorted(found.items())):
        colour = f"C{number % 10}"
        rows: dict[tuple[float, float], list[tuple[float, float]]] = {}
        for left, width, low, height in places:
            rows.setdefault((low, height), []).append((left, width))
        for row, (extent, spans) in enumerate(rows.items()):
            label = itinerary if row == 0 else None
            axes.broken_barh(spans, extent, color=colour, linewidth=0, label=label)
    axes.set_xlim(*ALPHA)
    axes.set_xlabel("α")
    if plane:
        axes.set_ylim(*GAMMA)
        axes.set_ylabel("γ")
    else:
        axes.set_ylim(-0.1, 1.9)
        axes.set_yticks([0.4, 1.4], ["γ = 3.0", "γ = 3.3"])
    figure.legend(loc="outside lower center", ncols=3, fontsize="x-small")
    return figure


def main() -> None:
    """Draw the parts of a file."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    drawn(*rectangles(given.file)).savefig(given.out, dpi=120)


if __name__ == "__main__":
    main()
