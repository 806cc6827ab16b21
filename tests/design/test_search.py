"""Rounds of an optimisation: which searches begin, when they end, and what a second round adds."""

from dataclasses import replace

import numpy as np
import pytest

from capsule_sym._design import evaluation
from capsule_sym._design import survey as survey_module
from capsule_sym._design.cells import evaluate
from capsule_sym._design.evaluation import UNKNOWN
from capsule_sym._design.optimise import program_of
from capsule_sym._design.program import KEPT, Program
from capsule_sym._design.search import Optimisation
from capsule_sym._design.survey import Survey
from capsule_sym._native import Watch, check_time, present
from capsule_sym._processes import sobol

OVER = {"alpha": (0.9, 1.0)}


@pytest.fixture
def search() -> Optimisation:
    """Search for the greatest alpha, which is at its upper bound."""
    return Optimisation(Survey(program_of("alpha", OVER, None, True, (), None)))


def begun(search: Optimisation, *values: float) -> None:
    """Let the searches begin at places."""
    search.survey.starts = lambda most: [np.array([u]) for u in values][:most]


def test_two_searches_that_pass_only_places_beyond_a_basin_boundary_end_a_round(
    search, monkeypatch
) -> None:
    begun(search, 0.1, 0.5, 0.9)
    monkeypatch.setattr(search, "settles_there", lambda place: False)
    search.descend_all()
    assert (search.followed, search.failed) == (2, 2)
    assert [float(place.u[0]) for place in search.kept] == [0.5, 0.1]  # where they began
    search.descend_all()  # of a second round
    assert search.followed == 4


def test_searches_that_begin_at_the_best_place_end_no_round(search) -> None:
    begun(search, 1.0, 1.0, 1.0)
    search.descend_all()
    assert (search.followed, search.failed) == (3, 0)
    assert all(place.u[0] == 1.0 for place in search.kept)


def test_a_place_without_a_motion_is_no_search(search, monkeypatch) -> None:
    begin = Program.begin
    monkeypatch.setattr(
        Program, "begin", lambda program, u: begin(program, u) if u[0] > 0.5 else None
    )
    begun(search, 0.1, 0.2, 0.3, 0.9)
    search.descend_all()
    assert search.followed == 1
    assert [float(place.u[0]) for place in search.kept] == [1.0]


@pytest.mark.parametrize(
    ("second", "agreed"),
    [
        ((0.0, -1.0 + KEPT / 2), True),
        ((0.0, -1.0 + 3 * KEPT), False),
        ((KEPT / 2, -9.0), False),  # better, and just beyond a limit
        ((1.0, -1.0), False),
        (None, True),
    ],
)
def test_searches_agree_if_two_end_at_the_best_value(search, second, agreed) -> None:
    place = search.program.begin(np.array([1.0]))
    for rank in ((0.0, -1.0), second):
        if rank is not None:
            slacks = np.array([-rank[0] - KEPT])
            search.kept.append(replace(place, objective=rank[1], slacks=slacks))
    assert search.agreed == agreed


def test_a_second_round_has_other_places(search, monkeypatch) -> None:
    seen = []
    cover = Survey.cover

    def covered(survey, *given, **how):
        cover(survey, *given, **how)
        seen.append(survey.cells.u)

    monkeypatch.setattr(Survey, "cover", covered)
    monkeypatch.setattr(Optimisation, "agreed", False)
    search.run(24, 3)
    whole = sobol(1, 48, 3)
    assert np.array_equal(np.concatenate(seen), whole)
    assert len(np.unique(whole)) == 48
    assert search.result.statistics["samples"] == 48
    assert search.result.over["alpha"] == 1.0


def test_a_second_round_without_time_keeps_the_first(search, monkeypatch) -> None:
    cover = Survey.cover

    def covered(survey, samples, seed, skipped=0):
        if skipped:
            present().stop()
            check_time()
        cover(survey, samples, seed)

    monkeypatch.setattr(Survey, "cover", covered)
    monkeypatch.setattr(Optimisation, "agreed", False)
    with Watch(1e6):
        search.run(8, 0)
    assert search.result.status == "optimal"
    assert search.result.over["alpha"] == 1.0


def test_a_place_is_kept_of_a_search_that_the_time_ends(search, monkeypatch) -> None:
    first, second = (search.program.begin(np.array([u])) for u in (0.5, 0.8))
    monkeypatch.setattr(Optimisation, "agreed", False)
    rounds = []

    def ended(self, place):
        present().stop()
        check_time()

    def descend_all(self):
        if not rounds:
            rounds.append(1)
            self.kept.append(first)
        else:
            monkeypatch.setattr(Optimisation, "settles_there", ended)
            self.descend(second)

    monkeypatch.setattr(Optimisation, "descend_all", descend_all)
    monkeypatch.setattr(Optimisation, "polish", lambda self: None)
    with Watch(1e6):
        search.run(8, 0)
    assert search.kept == [second, first]


def test_an_interrupt_in_a_second_round_ends_the_search(search, monkeypatch) -> None:
    cover = Survey.cover

    def covered(survey, samples, seed, skipped=0):
        monkeypatch.setattr(Watch, "interrupted", bool(skipped))
        cover(survey, samples, seed)

    monkeypatch.setattr(Survey, "cover", covered)
    monkeypatch.setattr(Optimisation, "agreed", False)
    monkeypatch.setattr(Optimisation, "polish", lambda self: None)
    with Watch(1e6):
        search.run(8, 0)
    monkeypatch.setattr(Watch, "interrupted", False)
    assert search.result.status == "time-limit"


def test_a_search_looks_for_a_lost_motion_in_the_brief_stretches_of_a_survey(monkeypatch) -> None:
    seen, settle_many = [], evaluation.settle_many

    def settled(*given, stretches, **how):
        seen.append(stretches)
        return settle_many(*given, stretches=stretches, **how)

    program = program_of("alpha", {"alpha": (0.9, 3.0)}, None, True, (), None)
    place = program.begin(np.array([0.0]))
    monkeypatch.setattr(evaluation, "settle_many", settled)
    lost = np.zeros(1, bool)
    monkeypatch.setattr(evaluation, "attracting", lambda found, gradients=False: lost)
    program.beside(place, np.array([1.0]))
    assert seen == [evaluation.BRIEF]


def test_unknown_places_of_both_rounds_are_counted(search, monkeypatch) -> None:
    def evaluated(program, u):
        cells = evaluate(program, u)
        cells.numbers[: len(u) == 8] = UNKNOWN  # one place of each survey
        return cells

    monkeypatch.setattr(survey_module, "evaluate", evaluated)
    monkeypatch.setattr(Optimisation, "agreed", False)
    search.run(8, 0)
    assert "; 2 of 16 places are unknown: " in search.result.message
