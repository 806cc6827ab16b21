"""Colours that are compared, or lie side by side, are told apart by all eyes.

Differences are CIEDE2000 as coloraide has it, for the eye without deficiency and for the three
deficiencies at their strongest, simulated as Machado, Oliveira and Fernandes (2009) do.
"""

from __future__ import annotations

import json
from functools import cache
from itertools import combinations
from pathlib import Path

import pytest
from coloraide import Color as Base
from coloraide.distance.delta_e_2000 import DE2000
from coloraide.filters.cvd import Deutan, Protan, Tritan

from capsule_sym._figures import style
from capsule_sym._parameters import scene

LEAST = 10.0  # seen at a glance
EXPLORER = Path(__file__).parents[2] / "explorer" / "src" / "draw" / "colours.ts"


class Color(Base):
    """A colour with its requirements."""


Color.register([DE2000(), Protan(), Deutan(), Tritan()], overwrite=True)


@cache
def seen(colour: str) -> tuple[Color, ...]:
    plain = Color(colour)
    eyes = [plain.filter(name, method="machado") for name in ("protan", "deutan", "tritan")]
    return plain, *(one.clip("srgb") for one in eyes)


def difference(one: str, other: str) -> float:
    """The least difference of two colours over all eyes."""
    return min(a.delta_e(b, method="2000") for a, b in zip(seen(one), seen(other), strict=True))


COMPARED = {
    "fields": [style.field_colour(field, scene=scene("prototype")) for field in range(1, 10)],
    "regions of a chart and of a basin": list(style.REGIONS),
    "curves of a chart": sorted({colour for colour, _ in style.CURVES.values()}),
    "branches": list(style.SERIES),
    "stable and unstable": [style.STABLE, style.UNSTABLE],
}


@pytest.mark.parametrize("what", COMPARED)
def test_colours_that_are_compared_differ_for_all_eyes(what: str) -> None:
    found = [(difference(a, b), a, b) for a, b in combinations(COMPARED[what], 2)]
    least = min(found)
    assert least[0] >= LEAST, least


def test_what_some_eyes_confuse_is_noticed() -> None:
    # Seen by most as orange and green.
    assert difference("#d55e00", "#7a7a00") < LEAST
    # By Sharma, Wu and Dalal (2005), table 1, pairs 1 and 17.
    for one, other, value in (
        ((50.0, 2.6772, -79.7751), (50.0, 0.0, -82.7485), 2.0425),
        ((50.0, 2.5, 0.0), (73.0, 25.0, -18.0), 27.1492),
    ):
        a, b = (Color("lab-d65", list(lab)) for lab in (one, other))
        assert a.delta_e(b, method="2000", space="lab-d65") == pytest.approx(value, abs=1e-4)


def test_curves_are_seen_on_their_rims() -> None:
    for colour in COMPARED["curves of a chart"]:
        assert difference(colour, "#ffffff") >= 3 * LEAST


def test_the_explorer_has_the_same_colours() -> None:
    light = EXPLORER.read_text(encoding="utf-8").split("dark: true")[0]
    assert 'import COLOURS from "../../../capsule_sym/_figures/colours.json"' in light
    for line in ("fields: COLOURS.fields,", "itineraries: COLOURS.regions,"):
        assert line in light
    held = json.loads((Path(style.__file__).parent / "colours.json").read_text(encoding="utf-8"))
    for name, ours in (("fields", COMPARED["fields"]), ("regions", style.REGIONS)):
        assert [one.lower() for one in held[name]] == [colour.lower() for colour in ours]


@pytest.mark.parametrize("colour", [*style.AREAS, *COMPARED["fields"]])
def test_a_name_on_a_colour_can_be_read(colour: str) -> None:
    assert Color(style.readable(colour)).contrast(colour, method="wcag21") >= 4.5
