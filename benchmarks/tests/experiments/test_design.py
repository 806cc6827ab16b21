"""Goals of design beside brute force."""

from pathlib import Path

import pytest

from benchmarks.experiments import design
from benchmarks.experiments.design import Sizes, constants, optima, pareto_fronts, size
from benchmarks.experiments.optima.problems import problem

FEW = Sizes(first=801, problems=1, cells=500, fronts=1, motions=1, knocks=100, pairs=1)


def test_a_constant_is_a_number_or_holds_one(tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        '_A = 1\n_B, _C = 2.0, "b"\nD: float = 3e-3\n_E = "e"\nF = (1, 2)\nG = {"a": 1}\n'
    )
    assert constants(module) == 6  # _A, _B, D, both of F, G


def test_the_size_of_the_rooms_is_told(tmp_path: Path) -> None:
    assert [goal.what for goal in size(FEW, tmp_path)] == [
        "lines of code",
        "numeric constants of modules",
    ]
    assert all(goal.value > 10 for goal in size(FEW, tmp_path))


@pytest.mark.long
def test_a_miss_beside_brute_force_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    best = design.answers.forced(FEW.first, FEW.cells)
    sign = -1 if problem(FEW.first).maximise else 1
    unreachable = best["best"] | {"value": sign * -1e3}
    better = best | {"best": unreachable, "held": unreachable}
    missed = "optima missed by more than 1e-3, in %"
    monkeypatch.setattr(design.answers, "forced", lambda number, cells: best)
    assert {goal.what: goal for goal in optima(FEW, tmp_path)}[missed].value == 0
    (tmp_path / "brute-801-500.jsonl").unlink()
    monkeypatch.setattr(design.answers, "forced", lambda number, cells: better)
    assert {goal.what: goal for goal in optima(FEW, tmp_path)}[missed].value == 100


@pytest.mark.long
def test_points_of_a_front_that_a_cell_beats_are_counted(tmp_path: Path) -> None:
    found = {goal.what: goal for goal in pareto_fronts(FEW, tmp_path)}
    assert found["fronts with a point beaten by 1e-3 of the range"].met
