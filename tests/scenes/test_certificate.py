"""Terms of the certificate that two stops, pulses and reaction bring: each is needed."""

import runpy
import shutil
from functools import cache
from pathlib import Path
from random import Random

import pytest

from tests.scenes.certificate import Core, Start, Truth, false_in
from tests.scenes.families import FAMILIES
from tests.scenes.library import generated
from tests.scenes.mutants import BEHIND, TERMS, Term

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

FEW, MOST = 10, 60
KNOWN = (*TERMS, *BEHIND)


def scene_of(term: Term) -> str:
    return FAMILIES[term.family][0]


@pytest.fixture(scope="module")
def cores(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Core]:
    """The probed library of each scene, with its mutants."""
    scenes = sorted(set(map(scene_of, KNOWN)))
    return {scene: built(scene, tmp_path_factory.mktemp(scene)) for scene in scenes}


def built(scene: str, folder: Path) -> Core:
    code = generated(scene, folder / "generated")
    order = runpy.run_path(str(code / "facts.py"))["PARAMETERS"]
    mutants = tuple(term.mutant for term in KNOWN if scene_of(term) == scene)
    return Core(folder / "c", code / "c", order, mutants)


@cache
def drawn(family: str, number: int) -> Start:
    return FAMILIES[family][1](Random(f"{family} {number}"))


def first_false(core: Core, family: str, width: str, count: int) -> str:
    """A false claim about a family's starts, empty if all are true."""
    core.reach.value = FAMILIES[family][2]
    for start in (drawn(family, number) for number in range(count)):
        if family == "resting":
            truth = Truth(start)
            room = min(truth.p["delta_1"], truth.p["delta_2"])
            if core.rests(width, start) and truth.farthest() >= room:
                return f"does not rest for ever: {start}"
            continue
        for claim in false_in(start, core.probe(width, start)):
            return f"{claim}: {start}"
    return ""


@pytest.mark.parametrize("family", FAMILIES)
def test_what_the_step_claims_is_true(cores: dict[str, Core], family: str) -> None:
    scene, _, _, widths = FAMILIES[family]
    cores[scene].weak.value = 0
    for width in widths:
        assert first_false(cores[scene], family, width, FEW) == ""


def without(cores: dict[str, Core], term: Term) -> Core:
    core = cores[scene_of(term)]
    core.weak.value = core.mutants.index(term.mutant) + 1
    return core


@pytest.mark.parametrize("term", TERMS, ids=lambda term: term.mutant.name)
def test_without_a_term_a_claim_is_false(cores: dict[str, Core], term: Term) -> None:
    core = without(cores, term)
    for width in term.widths:
        assert first_false(core, term.family, width, MOST), width


@pytest.mark.parametrize("term", BEHIND, ids=lambda term: term.mutant.name)
def test_a_term_that_is_said_not_to_be_shown_is_not(cores: dict[str, Core], term: Term) -> None:
    core = without(cores, term)
    for family, (scene, _, _, widths) in FAMILIES.items():
        if scene == scene_of(term):
            for width in widths:
                assert first_false(core, family, width, FEW) == ""
