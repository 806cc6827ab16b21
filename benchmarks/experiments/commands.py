"""The commands of experiments: each ends with 1 if what judges the results disagrees."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

import capsule_sym.scenes
from capsule_sym._commands.signature import argument, between, command, option

_SCENES = click.Choice(capsule_sym.scenes.SHIPPED)
_Scenes = Annotated[tuple[str, ...], argument(nargs=-1, type=_SCENES, metavar="[SCENE]...")]
_Kept = Annotated[
    Path,
    option(type=click.Path(path_type=Path), help="Keep results here, and continue with them."),
]


def _end(wrong: object) -> None:
    if wrong:
        raise click.exceptions.Exit(1)


@command()
def optima(
    *,
    problems: Annotated[int, between(1, help="Number of random problems.")] = 40,
    cells: Annotated[int, between(1, help="Cells of brute force for each problem.")] = 100_000,
    seeds: Annotated[int, between(1, help="Number of seeds of each answer.")] = 5,
    samples: Annotated[int | None, between(1, help="Cells of the survey.")] = None,
    known: Annotated[bool, option(help="Only problems that brute force has done.")] = False,
    out: _Kept = Path("results/optima"),
) -> None:
    """Compare `optimise` with brute force that shares no code with it."""
    from benchmarks.experiments.optima import answers

    _end(answers.check(problems, cells, seeds, samples, known, out))


@command()
def fronts(
    *,
    fronts: Annotated[int, between(1, help="Number of fronts, the chosen ones first.")] = 7,
    cells: Annotated[int, between(1, help="Random cells for each front.")] = 100_000,
    points: Annotated[int, between(2, help="Points of each front.")] = 20,
    out: _Kept = Path("results/optima"),
) -> None:
    """Compare Pareto fronts with random cells."""
    from benchmarks.experiments.optima.fronts import report

    _end(report(fronts, cells, points, out))


@command()
def trials(
    *,
    problems: Annotated[int, between(1, help="Number of problems.")] = 15,
    evaluations: Annotated[int, between(1, help="Evaluations of each method.")] = 1500,
    cells: Annotated[
        int, between(1, help="Cells of brute force, where it has not been done.")
    ] = 20_000,
    out: _Kept = Path("results/optima"),
) -> None:
    """Compare `optimise` with SciPy's global optimisers."""
    from benchmarks.experiments.optima.trials import report

    report(problems, evaluations, cells, out)


@command()
def pulses(
    *,
    numbers: Annotated[
        tuple[int, ...], argument(nargs=-1, type=click.IntRange(0, 9), metavar="[NUMBER]...")
    ] = (),
    amplitudes: Annotated[int, between(2, help="Amplitudes of brute force.")] = 100_000,
) -> None:
    """Compare shortest pulses between ten pairs of motions with brute force."""
    from benchmarks.experiments.pulses import check

    _end(check(numbers, amplitudes))


@command()
def shocks(
    *,
    motions: Annotated[int, between(1, 12, help="Number of motions.")] = 12,
    knocks: Annotated[int, between(1, help="Random knocks of each motion.")] = 1_000_000,
    out: _Kept = Path("results/shocks.json"),
) -> None:
    """Compare minimal shocks with random knocks."""
    from benchmarks.experiments.shocks import check

    _end(check(motions, knocks, out))


@command()
def design(
    *,
    first: Annotated[int, between(0, help="Number of the first random problem.")] = 800,
    problems: Annotated[int, between(1, help="Random problems.")] = 10,
    cells: Annotated[int, between(1, help="Cells of brute force.")] = 20_000,
    fronts: Annotated[int, between(1, help="Number of fronts.")] = 3,
    motions: Annotated[int, between(1, 12, help="Motions with shocks.")] = 2,
    knocks: Annotated[int, between(1, help="Random knocks of each motion.")] = 100_000,
    pairs: Annotated[int, between(1, 10, help="Pairs of motions with a pulse.")] = 3,
    out: _Kept = Path("results/design"),
) -> None:
    """Measure design and attractors beside brute force, and what has to be reached."""
    from benchmarks.experiments.design import PARTS, Sizes
    from benchmarks.speed.commands import GOALS, show

    out.mkdir(parents=True, exist_ok=True)
    sizes = Sizes(first, problems, cells, fronts, motions, knocks, pairs)
    found = [goal for part in PARTS for goal in part(sizes, out)]
    show("", GOALS, found)
    _end(not all(goal.met for goal in found))


@command()
def intervals(
    *, sets: Annotated[int, between(4, help="Synthetic sets of each kind.")] = 200
) -> None:
    """Count how many 95 % intervals of fits contain the truth."""
    from benchmarks.experiments.intervals import table

    table(sets)


@command()
def battery(
    *,
    branches: Annotated[int, between(0, help="Number of branches.")] = 60,
    motions: Annotated[int, between(0, help="Number of periodic motions.")] = 1000,
    out: _Kept = Path("results"),
) -> None:
    """Compare branches with brute force, and find orbits of random motions."""
    from benchmarks.experiments import branches as following
    from benchmarks.experiments import motions as finding

    out.mkdir(parents=True, exist_ok=True)
    wrong = following.check(branches, out / "branches.jsonl")
    _end(finding.check(motions, out / "motions.jsonl") or wrong)


@command()
def ends(
    *,
    branches: Annotated[int, between(0, help="Number of branches.")] = 300,
    curves: Annotated[int, between(0, help="Number of curves in two parameters.")] = 50,
    seed: Annotated[int, between(0, help="Random seed.")] = 0,
    seconds: Annotated[
        float, between(0, help="Time limit of a branch, and half that of a curve.")
    ] = 20.0,
    out: _Kept = Path("results/ends"),
) -> None:
    """Compare ends of branches and curves at stiff stops with runs beyond them."""
    from benchmarks.experiments.ends import check

    _end(check(branches, curves, seed, seconds, out))


@command()
def curves(
    *,
    scenes: _Scenes = (),
    curves: Annotated[int, between(1, help="Curves of each scene.")] = 20,
    seed: Annotated[int, between(0, help="Random seed.")] = 0,
) -> None:
    """Compare random bifurcations, normal forms and curves of each scene with a judge in C."""
    from benchmarks.experiments.curves import check

    _end(check(scenes or capsule_sym.scenes.SHIPPED, curves, seed))


@command()
def scenes_check(
    *,
    scenes: _Scenes = (),
    runs: Annotated[int, between(0, help="Random runs of four periods.")] = 1000,
    motions: Annotated[int, between(0, help="Random periodic motions.")] = 500,
    hard: Annotated[int, between(0, help="Random hard starts.")] = 100_000,
    out: _Kept = Path("results/scenes"),
) -> None:
    """Compare random runs, motions and hard starts of each scene with a judge in C."""
    from benchmarks.experiments.scenes import check

    _end(not check(scenes or capsule_sym.scenes.SHIPPED, runs, motions, hard, out))
