"""A horseshoe: proved, checked by code of its own, and refused if anything in it is changed."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from capsule_sym import Parameters, certify_orbit, simulate, simulate_many
from capsule_sym._enclosures.numbers.balls import Unproved, arb, ball, matrix, precision, unit
from capsule_sym._enclosures.numbers.fields import Field
from capsule_sym.orbits import lyapunov_exponents, solve_itinerary
from capsule_sym.results import Itinerary
from paper.__main__ import group
from paper.proofs import horseshoe
from paper.proofs import horseshoe_checker as checker
from paper.proofs.horseshoe import kept, prove_horseshoe
from tests.enclosures.certified import rejected

QUICK = 4  # the set whose coverings take the fewest parts


def of_one(source: int = QUICK) -> dict[str, Any]:
    """The certificate with the coverings of one set alone."""
    given = copy.deepcopy(kept())
    given["coverings"] = [row for row in given["coverings"] if row["from"] == source]
    return given


def checked(given: dict[str, Any]) -> None:
    """Check sets and coverings, whether they have an entropy or not."""
    try:
        checker.ctx.prec = checker.BITS
        one = checker.Checker(given)
        one.disjoint()
        one.coverings()
    except ZeroDivisionError as error:
        raise checker.Rejected("not a certificate") from error


@pytest.fixture(autouse=True)
def shallow(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few halvings: what does not hold is not tried for long."""
    monkeypatch.setattr(horseshoe, "_DEEPEST", 5)
    monkeypatch.setattr(checker, "HALVINGS", 6)


@pytest.mark.long
def test_the_coverings_of_a_set_are_proved_and_accepted() -> None:
    assert prove_horseshoe(of_one()).coverings == ((4, 5), (4, 6))
    checked(of_one())


def written(number: float) -> str:
    return f"{number:.9f}".rstrip("0").rstrip(".")


def moved(name: str, share: float) -> Callable[[dict[str, Any]], None]:
    def change(given: dict[str, Any]) -> None:
        one = given["sets"][QUICK]
        one["centre"] = [
            written(float(x) + share * float(y))
            for x, y in zip(one["centre"], one[name], strict=True)
        ]

    return change


def scaled(number: int, name: str, by: float) -> Callable[[dict[str, Any]], None]:
    def change(given: dict[str, Any]) -> None:
        one = given["sets"][number]
        one[name] = [written(by * float(x)) for x in one[name]]

    return change


def without(*places: str) -> Callable[[dict[str, Any]], None]:
    def change(given: dict[str, Any]) -> None:
        given["parameters"][places[0]] = places[1]

    return change


def edge_to_the_wrong_side(given: dict[str, Any]) -> None:
    given["coverings"][0]["side"] *= -1


def sides_that_are_large(given: dict[str, Any]) -> None:
    """Edges of a short set are not mapped beyond the one that is covered."""
    scaled(QUICK, "unstable", 0.9)(given)
    for row in given["coverings"]:
        row["side"] *= 5


def covering_too_many(given: dict[str, Any]) -> None:
    given["coverings"].append({"from": QUICK, "to": 2, "side": 1})


def sets_that_overlap(given: dict[str, Any]) -> None:
    given["sets"][0] = {**given["sets"][1]}


def another_itinerary(given: dict[str, Any]) -> None:
    given["sets"][QUICK]["fields"] = [2, 5, 2]
    given["sets"][QUICK]["durations"] = ["9.43", "0.55"]


def set_without_area(given: dict[str, Any]) -> None:
    given["sets"][QUICK]["stable"] = given["sets"][QUICK]["unstable"]


CHANGES = {
    "moved along": moved("unstable", 0.3),
    "moved across": moved("stable", 4),
    "short": scaled(QUICK, "unstable", 0.8),
    "edges not beyond": scaled(5, "unstable", 1.3),
    "out by the long edges": scaled(5, "stable", 0.4),
    "wrong side": edge_to_the_wrong_side,
    "large sides": sides_that_are_large,
    "too many": covering_too_many,
    "overlap": sets_that_overlap,
    "itinerary": another_itinerary,
    "no area": set_without_area,
    "other drive": without("alpha", "0.32"),
    "other damping": without("zeta", "0.1"),
}


@pytest.mark.long
@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_a_change_is_refused(change: Callable[[dict[str, Any]], None]) -> None:
    given = of_one()
    change(given)
    with pytest.raises(Unproved):
        prove_horseshoe(given)
    with pytest.raises(checker.Rejected):
        checked(given)


@pytest.mark.long
def test_an_image_that_misses_both_edges_of_a_set_is_no_covering() -> None:
    """The edge test alone refuses a set that is covered to a part."""
    given = of_one()
    scaled(6, "unstable", 8)(given)
    given["sets"] = [given["sets"][k] for k in (QUICK, 6)]
    given["coverings"] = [{"from": 0, "to": 1, "side": given["coverings"][1]["side"]}]
    given["weights"] = [1, 1]
    with pytest.raises(Unproved, match="edge"):
        prove_horseshoe(given)
    with pytest.raises(checker.Rejected, match="edge"):
        checked(given)


def test_guards_are_proved_along_the_way() -> None:
    """The motion never slips in F2 F5 F2, and its end is no concern: the force is too large."""
    one = copy.deepcopy(kept()["sets"][QUICK])
    one |= {"fields": [2, 5, 2], "durations": ["9.43", "0.6"]}
    with precision(80):
        values = {name: ball(text) for name, text in kept()["parameters"].items()}
        place = (horseshoe._LEFT, horseshoe._LEFT)
        with pytest.raises(Unproved, match="guards: the upper force margin"):
            horseshoe._Period(values).image(horseshoe._Set(one), place)
    whole = checker.Checker(kept())
    whole.sets[QUICK].given = one
    with pytest.raises(checker.Rejected, match="guard"):
        whole.image(whole.sets[QUICK], (checker.SIDES[:1] * 2, checker.SIDES[:1] * 2), QUICK)


def area(u: tuple[Fraction, Fraction], s: tuple[Fraction, Fraction]) -> Fraction:
    """Area of a part, or length of a part of an edge."""
    return (u[1] - u[0] or 1) * (s[1] - s[0])


@pytest.mark.long
def test_every_part_of_a_set_is_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    """The parts of the inside make up all of it, and so do those of both edges."""
    seen: dict[str, list[Fraction]] = {"prover": [], "checker": []}
    prove_image, image = horseshoe._prove_image, checker.Checker.image

    def proved(found: Any, part: horseshoe.Part, *others: Any) -> None:
        prove_image(found, part, *others)
        seen["prover"].append(area(*part))

    def accepted(self: checker.Checker, one: Any, part: Any, source: int) -> None:
        image(self, one, part, source)
        seen["checker"].append(area(*part))

    monkeypatch.setattr(horseshoe, "_prove_image", proved)
    monkeypatch.setattr(checker.Checker, "image", accepted)
    given = of_one()
    del given["coverings"][1]
    prove_horseshoe(given)
    checked(given)
    assert [sum(areas) for areas in seen.values()] == [4 + 2 + 2] * 2


def test_a_part_is_all_of_it() -> None:
    for found in (
        horseshoe._range([arb(0), arb(1), arb(-2)]),
        checker.span(checker.arb_mat([[0, 1, -2]])),
    ):
        assert found.contains(arb(3))
        assert found.contains(arb(-3))


def test_terms_of_the_checker() -> None:
    """Images are those of runs, to first order, and switches fall and are enclosed."""
    checker.ctx.prec = checker.BITS
    one = checker.Checker(kept())
    chosen, half = one.sets[QUICK], Fraction(1, 8)
    others: list[list[Any]] = [[0] * 3, [one.p["alpha"], 0, 0], [0] * 3, [1, 0, 0]]
    start = chosen.part([(-half, half)] * 2)
    y = checker.arb_mat([*start.tolist(), *others])
    ended = checker.image(one.fields, chosen.given, y, one.turn, one.p["delta"])
    parameters = Parameters(**{name: float(x) for name, x in kept()["parameters"].items()})
    for u, s in ((0, 0), (1, 1), (1, -1), (-1, 1)):
        place = checker.arb_mat([[1], [u], [s]])
        x, v = [float(z) for (z,) in (start * place).tolist()]
        run = simulate(parameters, (x, v, 0.0), periods=1).final[1]
        for (z,), value in zip((ended * place).tolist()[:2], run, strict=False):
            assert abs(float(z.mid()) - value) < 1e-12 + float(z.rad()) < 1e-3
    field = one.fields[5]
    for x, v, spread, reason in ((0.29, 1.0, 0, "fall"), (0.301, -0.5, 0.3, "enclosed")):
        rows = [[x, 0, spread / 1000], [v, spread, 0], *others]
        with pytest.raises(checker.Rejected, match=reason):
            checker.switch(field, 0, checker.arb_mat(rows), 0.01)


def test_entropy_is_that_of_the_coverings() -> None:
    """The growth of x^4 = x^3 + 1, and none if a covering of the loop is missing."""
    rows = [(row["from"], row["to"]) for row in kept()["coverings"]]
    found = horseshoe._entropy(rows, kept()["weights"])
    with precision(80):
        growth = arb(found).exp()
        assert growth**4 < growth**3 + 1
    assert found == pytest.approx(math.log(1.3802775690976), abs=1e-4)
    assert all(
        horseshoe._entropy([r for r in rows if r != x], kept()["weights"]) == 0 for x in rows
    )
    with pytest.raises(Unproved, match="weight"):
        horseshoe._entropy(rows, [0, *kept()["weights"][1:]])


@pytest.mark.long
def test_entropy_is_below_what_neighbours_part_by() -> None:
    parameters = Parameters(**{name: float(x) for name, x in kept()["parameters"].items()})
    run = simulate(parameters, periods=1000)
    exponent = lyapunov_exponents(run)[0] * parameters.period
    assert 0.32 < exponent < 0.45
    rows = [(row["from"], row["to"]) for row in kept()["coverings"]]
    assert horseshoe._entropy(rows, kept()["weights"]) < exponent


def test_a_missing_covering_is_noticed() -> None:
    for row in kept()["coverings"]:
        given = kept() | {"coverings": [one for one in kept()["coverings"] if one != row]}
        with pytest.raises(checker.Rejected, match="entropy"):
            checker.check_certificate(given)


BROKEN = {
    "key": lambda one: one | {"about": ""},
    "kind": lambda one: one | {"kind": "orbit"},
    "twice": lambda one: one | {"coverings": one["coverings"] * 2},
    "weight": lambda one: one | {"weights": [1.5, *one["weights"][1:]]},
    "negative weight": lambda one: one | {"weights": [-1, *one["weights"][1:]]},
    "truth": lambda one: one | {"coverings": [{"from": False, "to": 5, "side": 1}]},
    "no set": lambda one: one | {"sets": [], "weights": []},
    "number": lambda one: one | {"parameters": one["parameters"] | {"alpha": "nan"}},
    "parameter": lambda one: one | {"parameters": {"alpha": "0.3"}},
    "list": lambda one: [one],
}


@pytest.mark.parametrize("change", BROKEN.values(), ids=BROKEN)
def test_what_is_no_certificate_is_refused(change: Callable[[Any], Any]) -> None:
    with pytest.raises(checker.Rejected):
        checker.check_certificate(change(copy.deepcopy(kept())))


def test_a_file_says_one_thing() -> None:
    text = json.dumps(kept())
    assert checker.held(text) == kept()
    twice = text.replace('"alpha":', '"alpha": "9", "alpha":')
    for other in (
        twice,
        text.replace("10000", "1e4"),
        text.replace("10000", "NaN"),
        f"\ufeff{text}",
    ):
        with pytest.raises(ValueError, match=r"twice|integer|BOM"):
            checker.held(other)
    for other in ("0.30", "00.3", "-0", "3e-1", "0.\u0663", "0." + 400 * "3"):
        with pytest.raises(checker.Rejected, match="a number"):
            checker.read(kept() | {"parameters": kept()["parameters"] | {"alpha": other}})


@pytest.mark.long
def test_the_whole_horseshoe_is_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(horseshoe, "_DEEPEST", 16)
    found = prove_horseshoe(kept())
    assert len(found.coverings) == 10
    assert found.entropy > 0.3222


@pytest.mark.long
def test_the_whole_horseshoe_is_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checker, "HALVINGS", 20)
    assert checker.check_certificate(json.loads(json.dumps(kept()))) > 0.3222


@pytest.mark.long
def test_the_command_writes_the_certificate(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    quick = of_one()
    monkeypatch.setattr(horseshoe, "kept", lambda: quick)
    path = tmp_path / "horseshoe.json"
    result = CliRunner().invoke(group, ["enclose", "--horseshoe", "--json", "--out", str(path)])
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["coverings"] == [[4, 5], [4, 6]]
    assert json.loads(path.read_text()) == quick
    shown = CliRunner().invoke(group, ["enclose", "--horseshoe"])
    assert "6, 7" in shown.stdout
    edge_to_the_wrong_side(quick)
    path.unlink()
    refused = CliRunner().invoke(group, ["enclose", "--horseshoe", "--out", str(path)])
    assert refused.exit_code == 1
    assert "not proved: covering" in refused.stderr
    late = CliRunner().invoke(group, ["enclose", "--horseshoe", "--max-seconds", "1e-9"])
    assert late.exit_code == 1
    assert "the time was over" in late.stderr
    assert not path.exists()


WORDS = [(0,), (2, 3, 4, 6), (1, 2, 3, 4, 5), (0, 1, 2, 3, 4, 5)]


@pytest.mark.long
@pytest.mark.parametrize("word", WORDS)
def test_a_closed_path_is_that_of_a_periodic_orbit(word: tuple[int, ...]) -> None:
    """Enclosed by Krawczyk's method; at each period's begin it is in the set of the path."""
    parameters = Parameters(**{name: float(x) for name, x in kept()["parameters"].items()})
    starts = [[float(x) for x in kept()["sets"][k]["centre"]] for k in word]
    begin = repeated(parameters, np.array(starts))
    run = simulate(parameters, (*begin, 0.0), periods=len(word))
    first, *others = run.segments
    durations = [one.duration for one in others]
    durations[-1] += first.duration
    itinerary = Itinerary.parse(" ".join(f"F{one.field}" for one in others))
    angle = parameters.omega * others[0].start.phase
    guess = [*others[0].start_state, angle, *durations]
    orbit = solve_itinerary(
        parameters, dataclasses.replace(itinerary, period_number=len(word)), guess
    )
    certificate = certify_orbit(orbit)
    assert not rejected(certificate)
    with precision(256):
        values = {name: ball(text) for name, text in kept()["parameters"].items()}
        at = ball(certificate["angle"], 1e-29)
        sets = [horseshoe._Set(one) for one in kept()["sets"]]
        seen = []
        rows = zip(*(certificate[name] for name in ("fields", "durations", "states")), strict=True)
        for field, duration, state in rows:
            then = at + values["omega"] * ball(duration, 1e-29)
            turn = 2 * arb.pi() * (len(seen) + 1)
            if then > turn:
                force = [values["alpha"] * x for x in (at.cos(), at.sin())]
                y = [*(ball(x, 1e-29) for x in state), *force, arb(1)]
                flow = Field(field, values).flow((turn - at) / values["omega"])
                here = flow * matrix(6, 1, ((i, 0, x) for i, x in enumerate(y)))
                places = [one.coordinates(unit(2, 6) * here) for one in sets]
                inside = [k for k, p in enumerate(places) if abs(p[0, 0]) < 1 and abs(p[1, 0]) < 1]
                seen += inside
            at = then
    assert tuple(seen) in [word[k:] + word[:k] for k in range(len(word))]


def repeated(parameters: Parameters, starts: np.ndarray) -> np.ndarray:
    """First of the states that follow each other every period, by Newton's method."""
    n, step = len(starts), 1e-7

    def ahead(places: np.ndarray) -> np.ndarray:
        states = np.column_stack([places, np.zeros(len(places))])
        return simulate_many([parameters] * len(places), states, periods=1).states[:, :2]

    for _ in range(12):
        ends = ahead(starts)
        slopes = [(ahead(starts + step * e) - ends) / step for e in np.eye(2)]
        by = -np.roll(np.eye(2 * n), 2, axis=1)
        for k in range(n):
            by[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] += np.stack([s[k] for s in slopes], 1)
        residual = (ends - np.roll(starts, -1, axis=0)).ravel()
        starts = starts - np.linalg.solve(by, residual).reshape(n, 2)
    return starts[0]


def test_a_period_lasts_through_its_last_segment() -> None:
    """With a period that is shorter by more than the last rest, this rest would run backwards."""
    checker.ctx.prec = checker.BITS
    one = checker.Checker(kept())
    chosen, half = one.sets[QUICK], Fraction(1, 8)
    others: list[list[Any]] = [[0] * 3, [one.p["alpha"], 0, 0], [0] * 3, [1, 0, 0]]
    y = checker.arb_mat([*chosen.part([(-half, half)] * 2).tolist(), *others])
    last = float(one.turn) - sum(map(float, chosen.given["durations"]))
    with pytest.raises(checker.Rejected, match="period ends"):
        checker.image(one.fields, chosen.given, y, one.turn - 1.1 * last, one.p["delta"])


def test_a_covering_counts_once_and_parameters_are_positive() -> None:
    with pytest.raises(checker.Rejected, match="twice"):
        checker.read(kept() | {"coverings": kept()["coverings"] * 2})
    for name in ("omega", "gamma", "f_b"):
        with pytest.raises(checker.Rejected, match="the parameters"):
            checker.Checker(kept() | {"parameters": kept()["parameters"] | {name: "-1"}})


def test_all_guards_are_proved_and_not_only_those_that_switch() -> None:
    """Stick with a force that is too large at its start, and stick through contact."""
    checker.ctx.prec = checker.BITS
    one = checker.Checker(kept())
    others: list[list[Any]] = [*([0] * 3 for _ in range(3)), [1, 0, 0]]
    strong = checker.arb_mat([[-2, 0.001, 0], [5, 0, 0.001], *others])
    passing = {"fields": [2, 5], "durations": ["0.5"]}
    switch, *_ = checker.switch(one.fields[2], 0, strong, 0.5)
    turn = switch + checker.arb("0.001")
    with pytest.raises(checker.Rejected, match="positive"):
        checker.image(one.fields, passing, strong, turn, one.p["delta"])
    weak = checker.arb_mat([[0.29, 0, 0], [1, 0, 0], *others])
    with pytest.raises(checker.Rejected, match="positive"):
        checker.image(
            one.fields, {"fields": [2], "durations": []}, weak, checker.arb(0.1), one.p["delta"]
        )


def test_a_guard_is_proved_up_to_its_switch() -> None:
    checker.ctx.prec = checker.BITS
    one = checker.Checker(kept())
    rows = [[0.2, 0, 0], [1, 0, 0], *([0] * 3 for _ in range(3)), [1, 0, 0]]
    middle, every, until = checker.switch(one.fields[2], 0, checker.arb_mat(rows), 0.1)
    assert middle.overlaps(every)
    assert until < every < until + 1e-9


def test_a_guard_that_dips_at_the_end_of_a_piece_is_noticed() -> None:
    """Acceleration 4.7 for a time of 0.24 takes x_r below the gap, then over it."""
    checker.ctx.prec = checker.BITS
    one = checker.Checker(kept())
    column = [0.2999, -4.7 * 0.11, 0, 5, 0, 1]
    y = checker.arb_mat([[x, 0, 0] for x in column])
    with pytest.raises(checker.Rejected, match="guard"):
        one.fields[2].positive(0, 0, y, checker.arb(0.24))
    one.fields[2].positive(0, 0, y, checker.arb(0.2))


def test_a_period_begins_and_ends_at_rest() -> None:
    checker.ctx.prec = checker.BITS
    one = checker.Checker(kept())
    y = checker.arb_mat([[x, 0, 0] for x in (0.1, 0, 0.1, 0.3, 0, 1)])
    with pytest.raises(checker.Rejected, match="rest"):
        checker.image(one.fields, kept()["sets"][QUICK], y, one.turn, one.p["delta"])
    for fields in ([2, 5, 4, 1], [4, 1, 2]):
        given = copy.deepcopy(kept())
        given["sets"][0] |= {"fields": fields, "durations": ["1.0"] * (len(fields) - 1)}
        with pytest.raises(checker.Rejected, match="drift"):
            checker.read(given)
        with pytest.raises(Unproved, match="not at rest"):
            prove_horseshoe(given)
