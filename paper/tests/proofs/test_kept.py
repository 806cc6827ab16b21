"""The kept results: parts without overlap, shown in the picture, of which some are proved again."""

from __future__ import annotations

import gzip
import json
import math
import re
from pathlib import Path

import pytest

from capsule_sym import Parameters, simulate
from paper.proofs import attraction, optimum, patches
from paper.proofs.case import ALPHA, GAMMA, GAMMAS
from paper.proofs.optimum import BEST, ROOM
from paper.proofs.parts import BOTH, AlphaPart, DrivePart, Patch
from paper.proofs.subdivision import DRIVES, FROM_REST, PLANE, Task, prove

ROOT = Path(__file__).parents[3]
KEPT = ROOT / "paper" / "proofs" / "kept"
TASKS = {"from-rest": FROM_REST, "regions": PLANE, "fastest": DRIVES}


def lines(name: str) -> list[dict]:
    return [json.loads(one) for one in gzip.open(KEPT / f"{name}.jsonl.gz")]


def records(name: str) -> list[dict]:
    return [one for one in lines(name) if "itinerary" in one]


FROM_REST_KEPT = records("from-rest")


def share(name: str) -> float:
    return sum(TASKS[name].part(*one["part"]).area for one in records(name))


def drawn(bars: str) -> list[list[float]]:
    path = ROOT / "paper/pages/proofs/parts.json"
    return json.loads(path.read_text(encoding="utf-8"))[bars]


@pytest.mark.long
@pytest.mark.parametrize(("name", "task"), TASKS.items())
def test_their_parts_are_those_of_the_subdivision(name: str, task: Task, tmp_path: Path) -> None:
    """Each is open after the halvings, so that none lies in another one."""
    kept = KEPT / f"{name}.jsonl.gz"
    plane = prove(tmp_path / "again.jsonl", 1e-9, workers=1, task=task, plan=kept)
    proved = [tuple(one["part"]) for one in records(name)]
    assert len({*proved}) == len(proved)
    assert {*proved} <= {tuple(part) for *_, part, _ in plane.open}
    assert plane.patches == 0


def attempted(name: str, one: dict) -> str | None:
    """Itinerary that present code proves on a kept part, or its velocity's bound."""
    part = TASKS[name].part(*one["part"])
    if name == "regions":
        return patches.attempt(part, (0.0, 0.0, 0.0)).itinerary
    return (attraction if name == "from-rest" else optimum).attempt(part).itinerary


@pytest.mark.long
@pytest.mark.parametrize("name", TASKS)
def test_present_code_proves_some_of_all_again(name: str) -> None:
    """The code that proved them all is known by its digest; one part in fifty is tried again.

    Which ones depends on the present code, so that its versions together try all of them.
    """
    assert re.fullmatch("[0-9a-f]{64}", lines(name)[0]["code"])
    for one in records(name)[int(TASKS[name].code(), 16) % 50 :: 50]:
        assert attempted(name, one) == one["itinerary"], one


def test_the_picture_shows_the_share_from_rest() -> None:
    shown = sum(high - low for low, high, bottom, *_ in drawn("bars") if bottom < 2)
    assert shown / 2 / (ALPHA[1] - ALPHA[0]) == pytest.approx(share("from-rest"), abs=1e-4)


def test_the_picture_shows_the_share_of_the_plane() -> None:
    shown = sum((b - a) * (d - c) for a, b, c, d, _ in drawn("plane"))
    whole = (ALPHA[1] - ALPHA[0]) * (GAMMA[1] - GAMMA[0])
    assert shown / whole == pytest.approx(share("regions"), abs=1e-4)


@pytest.mark.parametrize("place", [0.2, 0.5, 0.8])
def test_a_part_from_rest_is_proved_again(place: float) -> None:
    one = records("from-rest")[int(place * len(records("from-rest")))]
    assert attraction.attempt(AlphaPart(*one["part"])).itinerary == one["itinerary"]


@pytest.mark.long
@pytest.mark.parametrize("place", [0.1, 0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("curve", [False, True])
def test_a_patch_of_the_plane_is_proved_again(place: float, curve: bool) -> None:
    """Its motion begins from rest here, and in the kept run from that of a larger patch."""
    chosen = [one for one in records("regions") if ("|" in one["itinerary"]) == curve]
    one = chosen[int(place * len(chosen))]
    assert patches.attempt(Patch(*one["part"]), (0.0, 0.0, 0.0)).itinerary == one["itinerary"]


def simulated(alpha: float, gamma: float) -> str:
    """Itinerary, from its least rotation, of the motion that a run from rest settles on."""
    for periods, change in ((1200, 1e-9), (20_000, 1e-9), (20_000, 1e-7)):
        motion = simulate(Parameters(alpha=alpha, gamma=gamma), periods=periods).steady(change)
        if motion is not None and motion.period_number == 1:
            fields = tuple(motion.itinerary)
            return " ".join(min(fields[k:] + fields[:k] for k in range(len(fields))))
    raise AssertionError(f"no motion of one period at alpha = {alpha}, gamma = {gamma}")


def beside_others(ratio: int) -> list[tuple[AlphaPart, str]]:
    """Parts at a mass ratio in order, of which the next or the last one has another itinerary."""
    told = [(AlphaPart(*one["part"]), one["itinerary"].partition(",")[0]) for one in FROM_REST_KEPT]
    own = sorted((one for one in told if one[0].ratio in (ratio, BOTH)), key=middle)
    changed = [k for k in range(1, len(own)) if own[k][1] != own[k - 1][1]]
    return [own[k - side] for k in changed for side in (0, 1)]


def middle(one: tuple[AlphaPart, str]) -> float:
    return one[0].alphas.middle


def check_ends(part: AlphaPart, itinerary: str, gamma: str) -> None:
    alphas = part.alphas
    for side in (-1, 1):
        alpha = alphas.middle + side * alphas.radius
        assert simulated(alpha, float(gamma)) == itinerary, (part, side)


@pytest.mark.parametrize("ratio", [0, 1])
def test_runs_at_the_ends_of_parts_beside_others_have_their_itineraries(ratio: int) -> None:
    for part, itinerary in beside_others(ratio):
        check_ends(part, itinerary, GAMMAS[ratio])


@pytest.mark.long
def test_runs_at_the_ends_of_all_parts_have_their_itineraries() -> None:
    for one in FROM_REST_KEPT:
        part = AlphaPart(*one["part"])
        for gamma in part.gammas:
            check_ends(part, one["itinerary"].partition(",")[0], gamma)


def velocity(alpha: float, omega: float) -> float:
    """Average velocity of the motion on which a run from rest settles."""
    motion = simulate(Parameters(alpha=alpha, omega=omega), periods=2000).steady(1e-7)
    assert motion is not None, (alpha, omega)
    return motion.progression * omega / (2 * math.pi)


def check_corners(chosen: list[dict]) -> None:
    best = velocity(*map(float, BEST.values()))
    for part in (DrivePart(*one["part"]) for one in chosen):
        for side in (-1, 1):
            for way in (-1, 1):
                alpha = part.alphas.middle + side * part.alphas.radius
                omega = part.omegas.middle + way * part.omegas.radius
                assert velocity(alpha, omega) <= best + ROOM, part


@pytest.mark.long
def test_runs_at_corners_of_drives_are_not_faster() -> None:
    """Of some parts, and of the smallest, which are beside the best drive or a bifurcation."""
    found = records("fastest")
    smallest = sorted(found, key=lambda one: DrivePart(*one["part"]).area)[:5]
    check_corners([*smallest, *found[:: len(found) // 20]])


@pytest.mark.long
def test_runs_at_corners_of_all_drives_are_not_faster() -> None:
    check_corners(records("fastest"))


@pytest.mark.long
@pytest.mark.parametrize("place", [0.1, 0.5, 0.9])
def test_drives_are_proved_again(place: float) -> None:
    one = records("fastest")[int(place * len(records("fastest")))]
    assert optimum.attempt(DrivePart(*one["part"])).itinerary == one["itinerary"]
