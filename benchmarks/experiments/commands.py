"""The commands of experiments: each ends with 1 if what judges the results disagrees."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

import capsule_sym.scenes
from capsule_sym._commands.options import count
from capsule_sym._commands.signature import argument, command, option

_SCENES = {"nargs": -1, "type": click.Choice(capsule_sym.scenes.SHIPPED), "metavar": "[SCENE]..."}


def _out(default: str) -> Any:
    """The option --out, where results are kept, so that what was stopped resumes."""
    kind = click.Path(path_type=Path)
    return option(
        "Keep results here, and continue with them.", type=kind, default=default, show_default=True
    )


def _end(wrong: object) -> None:
    if wrong:
        raise click.exceptions.Exit(1)


@command()
def optima(
    problems: int = count("Number of random problems.", 40, 1),
    cells: int = count("Cells of brute force for each problem.", 100_000, 1),
    seeds: int = count("Number of seeds of each answer.", 5, 1),
    samples: int = count("Cells of the survey of `optimise`.", 2048, 1),
    known: bool = option("Only problems that brute force has done.", default=False),
    out: Path = _out("results/optima"),
) -> None:
    """Compare `optimise` with brute force that shares no code with it."""
    from benchmarks.experiments.optima import answers

    _end(answers.check(problems, cells, seeds, samples, known, out))


@command()
def fronts(
    fronts: int = count("Number of fronts, the chosen ones first.", 7, 1),
    cells: int = count("Random cells for each front.", 100_000, 1),
    points: int = count("Points of each front.", 20, 2),
    out: Path = _out("results/optima"),
) -> None:
    """Compare Pareto fronts with random cells."""
    from benchmarks.experiments.optima.fronts import report

    _end(report(fronts, cells, points, out))


@command()
def trials(
    problems: int = count("Number of problems.", 15, 1),
    evaluations: int = count("Evaluations of each method.", 1500, 1),
    cells: int = count("Cells of brute force, where it has not been done.", 20_000, 1),
    out: Path = _out("results/optima"),
) -> None:
    """Compare `optimise` with SciPy's global optimisers."""
    from benchmarks.experiments.optima.trials import report

    report(problems, evaluations, cells, out)


@command()
def pulses(
    numbers: tuple[int, ...] = argument(nargs=-1, type=click.IntRange(0, 9), metavar="[NUMBER]..."),
    amplitudes: int = count("Amplitudes of brute force.", 100_000, 2),
) -> None:
    """Compare shortest pulses between ten pairs of motions with brute force."""
    from benchmarks.experiments.pulses import check

    _end(check(numbers, amplitudes))


@command()
def shocks(
    motions: int = count("Number of motions.", 12, 1, 12),
    knocks: int = count("Random knocks of each motion.", 1_000_000, 1),
    out: Path = _out("results/shocks.json"),
) -> None:
    """Compare minimal shocks with random knocks."""
    from benchmarks.experiments.shocks import check

    _end(check(motions, knocks, out))


@command()
def intervals(sets: int = count("Synthetic sets of each kind.", 200, 4)) -> None:
    """Count how many 95 % intervals of fits contain the truth."""
    from benchmarks.experiments.intervals import table

    table(sets)


@command()
def battery(
    branches: int = count("Number of branches.", 60, 0),
    motions: int = count("Number of periodic motions.", 1000, 0),
    out: Path = _out("results"),
) -> None:
    """Compare branches with brute force, and find orbits of random motions."""
    from benchmarks.experiments import branches as following
    from benchmarks.experiments import motions as finding

    out.mkdir(parents=True, exist_ok=True)
    wrong = following.check(branches, out / "branches.jsonl")
    _end(finding.check(motions, out / "motions.jsonl") or wrong)


@command()
def curves(
    scenes: tuple[str, ...] = argument(**_SCENES),
    curves: int = count("Curves of each scene.", 20, 1),
    seed: int = count("Random seed.", 0, 0),
) -> None:
    """Compare random bifurcations, normal forms and curves of each scene with a judge in C."""
    from benchmarks.experiments.curves import check

    _end(check(scenes or capsule_sym.scenes.SHIPPED, curves, seed))


@command()
def scenes_check(
    scenes: tuple[str, ...] = argument(**_SCENES),
    runs: int = count("Random runs of four periods.", 1000, 0),
    motions: int = count("Random periodic motions.", 500, 0),
    hard: int = count("Random hard starts.", 100_000, 0),
    out: Path = _out("results/scenes"),
) -> None:
    """Compare random runs, motions and hard starts of each scene with a judge in C."""
    from benchmarks.experiments.scenes import check

    _end(not check(scenes or capsule_sym.scenes.SHIPPED, runs, motions, hard, out))
