"""`python -m benchmarks`: commands for developers; their errors and ends are as of users' ones."""

import click

from capsule_sym._cli import CommandGroup, main


@click.group("python -m benchmarks", cls=CommandGroup, invoke_without_command=True)
@click.pass_context
def group(context: click.Context) -> None:
    """Commands for developers, which no wheel holds."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


_EXPERIMENTS = "benchmarks.experiments.commands"
for _name, _module, _text in (
    ("hardcases", "benchmarks.hardcases.commands", "Check the switches of hard cases."),
    ("events", "benchmarks.hardcases.commands", "Write the neutral suite of hard events."),
    ("adversarial", "benchmarks.hardcases.commands", "Check random starts near tangencies."),
    ("bench", "benchmarks.speed.commands", "Measure speed against error, and the goals."),
    ("first-calls", "benchmarks.speed.commands", "Measure what a person calls first."),
    ("scenes", "benchmarks.speed.commands", "Measure the speed of each scene."),
    ("installation", "benchmarks.speed.commands", "Measure what a newcomer waits for."),
    ("optima", _EXPERIMENTS, "Compare optima with brute force."),
    ("fronts", _EXPERIMENTS, "Compare Pareto fronts with random cells."),
    ("trials", _EXPERIMENTS, "Compare optima with SciPy's global optimisers."),
    ("design", _EXPERIMENTS, "Measure design beside brute force, and its goals."),
    ("pulses", _EXPERIMENTS, "Compare shortest pulses with brute force."),
    ("shocks", _EXPERIMENTS, "Compare minimal shocks with random knocks."),
    ("intervals", _EXPERIMENTS, "Count intervals of fits that contain the truth."),
    ("battery", _EXPERIMENTS, "Compare branches and orbits with brute force."),
    ("ends", _EXPERIMENTS, "Compare ends of branches and curves with runs beyond them."),
    ("curves", _EXPERIMENTS, "Compare bifurcations of scenes with a judge in C."),
    ("scenes-check", _EXPERIMENTS, "Compare runs of scenes with a judge in C."),
    ("bench-design", "benchmarks.speed.commands", "Measure the computations of a device's design."),
):
    group.add(_name, _module, _text)

if __name__ == "__main__":
    main(commands=group)
