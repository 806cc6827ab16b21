"""The tables of the scenes' pages: parameters and planes are those of the generated code."""

import re

import pytest

from capsule_sym import scenes
from tests.examples import ROOT, Page

PAGE = {name: f"scenes/{name}" for name in scenes.SHIPPED}
PAGE |= {"capsule": "theory/system", "reaction_pulse": "scenes/reaction"}
RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")


def number(text: str) -> float:
    """A number of a table, such as 10⁻⁶ or 1 − 10⁻⁹."""
    if found := re.fullmatch(r"(−?)10([⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+)", text):
        return float(f"{found[1].translate(RAISED)}1e{found[2].translate(RAISED)}")
    first, minus, other = text.partition(" − ")
    return number(first) - number(other) if minus else float(text.translate(RAISED))


@pytest.mark.parametrize("name", scenes.SHIPPED)
def test_a_page_has_the_parameters_of_its_scene(name: str) -> None:
    text = Page(ROOT / "docs" / f"{PAGE[name]}.md").text
    rows = re.findall(r"^\| `(\w+)` \| \$.+?\$ \| (.+?) to (.+?) \| (.+?) \| (.*) \|$", text, re.M)
    alone = [row for row in rows if not row[4].endswith(" alone") or f"`{name}` alone" in row[4]]
    facts = getattr(scenes, name).facts
    assert {row[0]: number(row[3]) for row in alone} == facts.DEFAULTS
    assert {row[0]: (number(row[1]), number(row[2])) for row in alone} == facts.RANGES


@pytest.mark.parametrize("name", ["capsule", "prototype", "reaction", "reaction_pulse"])
def test_a_page_has_the_planes_of_its_scene(name: str) -> None:
    text = Page(ROOT / "docs" / f"{PAGE[name]}.md").text
    column = 2 if name == "reaction_pulse" else 1
    rows = [[cell.strip() for cell in row.split("|")] for row in text.splitlines() if "Σ" in row]
    named = {row[column]: row[-2] for row in rows if len(row) > 3 and "Σ" in row[column]}
    switching, impacts = getattr(scenes, name).switching, dict[tuple[int, ...], int]()
    for planes, where in named.items():
        numbers = [int(plane) for plane in re.findall(r"Σ(\d+)", planes)]
        if "v_r" in where:
            stop, way = 2 if "delta_2" in where else 1, 1 if "v_c > 0" in where else -1
            impacts |= zip([(stop, way, 1), (stop, way, -1)], numbers, strict=True)
        elif "rise" in where:
            assert tuple(numbers) == switching.EDGE_PLANES
        else:
            assert numbers == [1, len(getattr(scenes, name).facts.FIELDS)]
    assert impacts == switching.IMPACT_PLANES
