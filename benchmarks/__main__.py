"""`python -m benchmarks`: commands for developers; their errors and ends are as of users' ones."""

import click

from capsule_sym._cli import Group, main


@click.group("python -m benchmarks", cls=Group, invoke_without_command=True)
@click.pass_context
def group(context: click.Context) -> None:
    """Commands for developers, which no wheel holds."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for _name, _module, _text in (
    ("hardcases", "benchmarks.hardcases.commands", "Check the switches of hard cases."),
    ("events", "benchmarks.hardcases.commands", "Write the neutral suite of hard events."),
    ("adversarial", "benchmarks.hardcases.commands", "Check random starts near tangencies."),
    ("bench", "benchmarks.speed.commands", "Measure speed against error, and the goals."),
    ("first-calls", "benchmarks.speed.commands", "Measure what a person calls first."),
    ("scenes", "benchmarks.speed.commands", "Measure the speed of each scene."),
    ("bench-design", "benchmarks.speed.commands", "Measure the computations of a device's design."),
):
    group.add(_name, _module, _text)

if __name__ == "__main__":
    main(commands=group)
