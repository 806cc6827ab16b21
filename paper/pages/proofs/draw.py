"""Figure of the page on what is proved, and the record that it is drawn from.

`python paper/pages/proofs/draw.py ENCLOSED REGIONS FROM-REST` writes the record from the results
of `enclose`: of --json, --region and --from-rest. Files may be compressed (.gz).
"""

from __future__ import annotations

import gzip
import json
import math
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from capsule_sym._figures.interface import REGIONS, styled
from paper.proofs import parts
from paper.proofs.case import ALPHA, GAMMA, GAMMAS

Box = tuple[float, float, float, float, str]
"""Ends in alpha, ends on the other axis, and the itinerary."""
_FURTHER = ("#222222", "#777777", "#bbbbbb")
_BAR = 0.8
_CURVE = "one itinerary on each side of a bifurcation curve"


@styled
def draw(path: str, width: float = 6.9) -> Figure:
    """Figure of a record: bars over alpha at both mass ratios, and the plane; open parts white."""
    record = json.loads(Path(path).read_text(encoding="utf-8"))
    colours = dict(zip(record["itineraries"], (*REGIONS, *_FURTHER), strict=False))
    colours[_CURVE] = "#ff7700"
    figure = Figure(figsize=(width, 6.0), layout="constrained")
    bars, plane = figure.subplots(2, 1, sharex=True, height_ratios=(1, 2))
    for axes, name in ((bars, "bars"), (plane, "plane")):
        for low, high, bottom, top, number in record[name]:
            colour = colours[(*record["itineraries"], _CURVE)[number]]
            axes.fill_between([low, high], bottom, top, color=colour, linewidth=0)
    rows = [f"γ = {gamma}, {way}" for way in ("orbit", "from rest") for gamma in GAMMAS]
    shares = [_share(record["bars"], row, row + _BAR) / _BAR for row in (3, 2, 1, 0)]
    names = [f"{row}: {_percent(share)}" for row, share in zip(rows, shares, strict=True)]
    bars.set_yticks([row + _BAR / 2 for row in (3, 2, 1, 0)], names)
    share = _share(record["plane"], *GAMMA) / (GAMMA[1] - GAMMA[0])
    plane.set_title(f"the plane: {_percent(share)}")
    plane.set(xlabel="amplitude α", ylabel="mass ratio γ", xlim=(0, 2), ylim=GAMMA)
    for gamma in map(float, GAMMAS):
        plane.axhline(gamma, color="black", linewidth=0.5)
    keys = [Patch(color=colour, label=name) for name, colour in colours.items()]
    figure.legend(handles=keys, loc="outside lower center", ncols=2, frameon=False)
    return figure


def _share(boxes: list[list[float]], bottom: float, top: float) -> float:
    """Area of the boxes between two heights, over the length of alpha."""
    sizes = ((b[1] - b[0]) * (b[3] - b[2]) for b in boxes if bottom <= b[2] and b[3] <= top)
    return sum(sizes) / (ALPHA[1] - ALPHA[0])


def _percent(share: float) -> str:
    """Share, rounded down: open parts are never lost by rounding."""
    return f"{math.floor(1e4 * share) / 100:.2f} %" if share < 0.9999 else "over 99.99 %"


def _cycle(itinerary: str) -> str:
    """Least rotation of an itinerary."""
    fields = itinerary.split()
    return " ".join(min(fields[i:] + fields[:i] for i in range(len(fields))))


def _orbits(path: str) -> Iterator[Box]:
    """Intervals of alpha with one proved orbit, as bars."""
    for section in json.loads(Path(path).read_text(encoding="utf-8"))["sections"]:
        row = 3 - GAMMAS.index(section["gamma"])
        for one in section["intervals"]:
            yield one["from"], one["to"], row, row + _BAR, _cycle(" ".join(one["itinerary"]))


def _parts(path: str) -> Iterator[dict[str, Any]]:
    content = Path(path).read_bytes()
    lines = (gzip.decompress(content) if path.endswith(".gz") else content).splitlines()
    return (one for one in map(json.loads, lines) if "itinerary" in one)


def _from_rest(path: str) -> Iterator[Box]:
    """Intervals of alpha with a proved tendency of the motion from rest, as bars."""
    for one in _parts(path):
        part, name = parts.AlphaPart(*one["part"]), one["itinerary"].partition(",")[0]
        middle, radius = part.alphas.middle, part.alphas.radius
        # A part of number 2 has both mass ratios.
        for row in (1, 0) if part.ratio == 2 else (1 - part.ratio,):
            yield middle - radius, middle + radius, row, row + _BAR, _cycle(name)


def _plane(path: str) -> Iterator[Box]:
    """Proved patches of the plane."""
    for one in _parts(path):
        patch = parts.Patch(*one["part"])
        (a, g), (da, dg) = patch.middle, patch.radii
        name = one["itinerary"]
        yield a - da, a + da, g - dg, g + dg, _CURVE if "|" in name else _cycle(name)


def _merged(boxes: Iterable[Box]) -> list[Box]:
    """Boxes with neighbours in alpha as one, where they have the same itinerary."""
    found: list[Box] = []
    for box in sorted(boxes, key=lambda b: (b[2], b[3], b[4], b[0])):
        last = found[-1] if found else None
        if last and last[2:] == box[2:] and box[0] - last[1] < 1e-9:
            found[-1] = (last[0], max(last[1], box[1]), *box[2:])
        else:
            found.append(box)
    return found


def _turned(boxes: Iterable[Box]) -> list[Box]:
    """Boxes with the axes exchanged."""
    return [(low, high, left, right, name) for left, right, low, high, name in boxes]


def record(enclosed: str, regions: str, from_rest: str) -> dict[str, Any]:
    """Record of the figure."""
    bars = _merged([*_orbits(enclosed), *_from_rest(from_rest)])
    plane = _turned(_merged(_turned(_merged(_plane(regions)))))
    found = {box[4] for box in (*bars, *plane)} - {_CURVE}
    names = [*sorted(found, key=lambda name: (len(name), name)), _CURVE]
    told = {
        key: [[*(round(x, 6) for x in box[:4]), names.index(box[4])] for box in boxes]
        for key, boxes in (("bars", bars), ("plane", plane))
    }
    return {"itineraries": names[:-1], **told}


if __name__ == "__main__":
    print(json.dumps(record(*sys.argv[1:]), separators=(",", ":")))
