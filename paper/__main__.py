"""`python -m paper`: the commands that reproduce the paper; they end as those of users do."""

import click

from capsule_sym._cli import Group, main


@click.group("python -m paper", cls=Group, invoke_without_command=True)
@click.pass_context
def group(context: click.Context) -> None:
    """Guo and Liu (2019), reproduced with capsule-sym; from a checkout, in no wheel."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for _name, _module, _text in (
    ("claims", "paper.commands.claims", "Compare every printed statement with its derivation."),
    ("case-study", "paper.commands.case_study", "Compute the case study beside the paper."),
    ("enclose", "paper.commands.enclose", "Prove Section 4 in ball arithmetic."),
):
    group.add(_name, _module, _text)

if __name__ == "__main__":
    main(commands=group)
