"""`python -m paper`: the commands that reproduce the paper; they end as those of users do."""

import click

from capsule_sym._cli import CommandGroup, main


@click.group("python -m paper", cls=CommandGroup, invoke_without_command=True)
@click.pass_context
def group(context: click.Context) -> None:
    """Guo and Liu (2019), reproduced with capsule-sym; from a checkout, in no wheel.

    Without a command, all that is computed about the paper but for `enclose`: the case study,
    proofs, hard cases and the report, into results/.
    """
    if context.invoked_subcommand is None:
        from paper.commands.everything import write_everything

        write_everything()


for _name, _module, _text in (
    ("case-study", "paper.commands.case_study", "Compute the case study beside the paper."),
    ("figure", "paper.commands.figures", "Draw a figure of the paper or of the report."),
    ("report", "paper.commands.figures", "Write the case study as one page of HTML."),
    ("claims", "paper.commands.claims", "Compare every printed statement with its derivation."),
    ("enclose", "paper.commands.enclose", "Prove Section 4 in ball arithmetic."),
):
    group.add(_name, _module, _text)

if __name__ == "__main__":
    main(commands=group)
