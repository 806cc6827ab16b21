"""The command line: `capsule-sym`, also `python -m capsule_sym`.

Commands import what they need when they are called, so that `--help` costs nothing and `run` never
imports SymPy.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from io import TextIOWrapper
from typing import TYPE_CHECKING, NoReturn, TextIO, TypeVar

import click

from capsule_sym._commands.options import (
    certify_option,
    chosen_parameters,
    json_option,
    make_console,
    make_progress,
    make_table,
    max_seconds_option,
    meant,
    out_option,
    parameter_options,
    state_option,
)
from capsule_sym._errors import CapsuleError, InvalidInput

if TYPE_CHECKING:
    from pathlib import Path

    from rich.table import Table

    from capsule_sym._map import Segment, SteadyMotion, Trajectory
    from capsule_sym._parameters import PhysicalParameters
    from capsule_sym._study.casestudy import Case
    from capsule_sym._study.thresholds import Threshold

_INTERRUPTED = 130  # the exit status of shells for it
_COMPLETE = "_CAPSULE_SYM_COMPLETE"  # the variable through which a shell asks for completions

_Command = TypeVar("_Command", bound=Callable[..., None])


class _Elsewhere(click.Command):
    """A command named here, whose module is imported only when it is called."""

    def __init__(self, name: str, module: str, short_help: str) -> None:
        super().__init__(name, short_help=short_help)
        self.module = module


class Group(click.Group):
    """A group of commands that are imported when they are called."""

    def add(self, name: str, module: str, short_help: str) -> None:
        """Add the command that a module has under this name, with _ for -."""
        self.add_command(_Elsewhere(name, module, short_help))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name, command, rest = super().resolve_command(ctx, args)
        if isinstance(command, _Elsewhere):
            command = getattr(import_module(command.module), (command.name or "").replace("-", "_"))
        return name, command, rest


def _show_version(context: click.Context, _: click.Parameter, asked: bool) -> None:
    if not asked:
        return
    from capsule_sym import __version__
    from capsule_sym._native import core

    count = 0 if core is None else core.lanes()
    lanes = f"C core, {count} lane{'s' * (count > 1)}"
    click.echo(f"{__version__} ({lanes if count else 'no C core: NumPy'})")
    context.exit()


@click.group("capsule-sym", cls=Group, invoke_without_command=True)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version, which core is live, and exit.",
)
@click.pass_context
def group(context: click.Context) -> None:
    """The exact three-dimensional map of a capsule system with bidirectional drifts."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for _name, _module, _text in (
    ("verify", "capsule_sym._commands.verify", "Prove the derivations with SymPy."),
    ("enclose", "capsule_sym._commands.enclose", "Prove Section 4 in ball arithmetic."),
    ("bench", "capsule_sym._commands.bench", "Measure speed against error, beside peers."),
    ("sweep", "capsule_sym._commands.sweep", "Run a grid of parameters or starts, resumably."),
    ("basin", "capsule_sym._commands.sweep", "Run a basin of attraction; tell its attractors."),
    ("sweep-info", "capsule_sym._commands.sweep", "Show what the results of a sweep hold."),
    ("orbit", "capsule_sym._commands.orbit", "Close the periodic orbit exactly."),
    (
        "branch",
        "capsule_sym._commands.branch",
        "Follow an orbit in a parameter, with bifurcations.",
    ),
    ("curve", "capsule_sym._commands.curve", "Follow bifurcations in two parameters."),
    ("design", "capsule_sym._commands.design", "Study the drives of one device."),
    ("optimise", "capsule_sym._commands.optimise", "Find the best parameters for a metric."),
    ("steer", "capsule_sym._commands.optimise", "Find the best drives both ways, and a path."),
    ("fit", "capsule_sym._commands.optimise", "Find parameters from measured series."),
    ("figure", "capsule_sym._commands.figures", "Draw a figure of the case study."),
    ("diagram", "capsule_sym._commands.figures", "Draw branches of orbits, labelled."),
    ("sweep-figure", "capsule_sym._commands.figures", "Draw the results of a sweep or a basin."),
    ("report", "capsule_sym._commands.figures", "Write the case study as one page of HTML."),
    ("explore", "capsule_sym._commands.explore", "Open the exact map as a page in a browser."),
):
    group.add(_name, _module, _text)


@group.command()
@parameter_options
@state_option("State at the start.")
@click.option(
    "--phase",
    type=float,
    default=0.0,
    help="Time at the start, within the excitation period 2π/ω.  [default: 0]",
)
@click.option(
    "--periods", type=int, default=100, show_default=True, help="Excitation periods to run."
)
@click.option(
    "--backend",
    type=click.Choice(["c", "numpy", "mpmath"]),
    show_default="c where it was compiled, else numpy",
    help="Double precision (c, numpy), or 50 digits.",
)
@max_seconds_option(120.0)
@certify_option("every switch of the run, and its end,")
@json_option
def run(
    file: str | None,
    state: tuple[float, float, float],
    phase: float,
    periods: int,
    backend: str | None,
    max_seconds: float,
    certify: Path | None,
    as_json: bool,
    **dimensionless: float | None,
) -> None:
    """Run the map and show the steady motion that it ends in.

    All quantities are dimensionless; states are x_r v_r v_c. With physical parameters the results
    are also given in SI units.

    In the JSON, "segments" are those of the whole run, and "itinerary", "global_map",
    "period_number" and "progression" describe the steady motion at its end; they are null if
    there is none. "progression" is the advance of the capsule per excitation period. "stopped" is
    there only if the run ended early, and says why. Exits with 4 where --certify does not prove it.
    """
    from capsule_sym._map import simulate
    from capsule_sym._native import Watch
    from capsule_sym._records import dumps, physical_record, run_record

    limit = Watch(max_seconds)
    parameters, physical = chosen_parameters(file, dimensionless)
    go = partial(
        simulate, parameters, state, phase, periods, backend=backend, max_seconds=max_seconds
    )
    try:
        if sys.stderr.isatty():
            with make_progress() as bar:
                task = bar.add_task("Running", total=periods)
                trajectory = go(progress=lambda turns: bar.update(task, completed=turns))
        else:
            trajectory = go()
    except KeyboardInterrupt:
        kept = "nothing is kept, but a run that --max-seconds stops shows what it found"
        raise KeyboardInterrupt(kept) from None
    motion = trajectory.steady() if trajectory.success else None
    if as_json:
        record = run_record(trajectory, motion)
        if physical:
            record["physical"] = physical_record(physical, trajectory, motion)
        click.echo(dumps(record))
    else:
        _print_run(trajectory, motion, physical)
    if certify is not None:
        from capsule_sym._commands.orbit import certify_found

        certify_found(certify, [trajectory], limit)


def _print_run(
    trajectory: Trajectory, motion: SteadyMotion | None, physical: PhysicalParameters | None
) -> None:
    from capsule_sym._map.steady import shown_progression

    console = make_console()
    values = trajectory.parameters.to_dict().items()
    console.print("  ".join(f"{name} = {value:.6g}" for name, value in values))
    console.print()
    if motion is None:
        (periods, phase), _ = trajectory.final
        if not trajectory.success:
            console.print(f"Stopped at phase {float(phase):.5f} after {periods} periods,")
            console.print(f"{trajectory.message}.")
        else:
            console.print(f"Not steady within {periods} periods.")
        console.print("The segments of the last period:")
        segments = [s for s in trajectory.segments if s.end >= (periods - 1, phase)]
        console.print(_segment_table(segments, physical))
        return
    console.print("The segments of the steady motion:")
    console.print(_segment_table(motion.segments, physical))
    console.print()
    console.print(f"global map     {motion.global_map}")
    console.print(f"period number  {motion.period_number}")
    progression = shown_progression(motion)
    console.print(f"progression    {progression:.10g} per excitation period")
    if physical:
        advance = physical.displacement(progression)
        period = physical.time(trajectory.parameters.period)
        console.print(f"               {advance:.6g} m in {period:.6g} s")
        console.print(f"velocity       {advance / period:.6g} m/s on average")


def _segment_table(segments: Sequence[Segment], physical: PhysicalParameters | None) -> Table:
    numbers = ("phase", "ms" if physical else "duration", "x_r", "v_r", "v_c")
    table = make_table("segment", "local map", "entry", "exit", *numbers, right=numbers, gap=0)
    for segment in segments:
        duration = float(segment.duration)
        if physical:
            duration = 1e3 * physical.time(duration)
        values = (segment.start.phase, duration, *segment.start_state)
        table.add_row(
            f"{segment.name} {segment.mode}",
            segment.local_map if segment.source and segment.target else "",
            segment.source,
            segment.target,
            *(f"{float(value):.5f}" for value in values),
        )
    return table


@group.command()
@out_option("Write casestudy.json and the tables to this directory.")
@json_option
def paper(out: Path | None, as_json: bool) -> None:
    """Compute the case study of Section 4 and compare it with what the paper prints.

    Runs the sixteen α of Fig. 7 from rest until the motion is steady, at the printed γ = 3.3 and
    at γ = 3.0, and shows each exact global map beside the printed one. Two maps agree if they are
    the same cyclic sequence of local maps. Then follows the orbit from α = 0.005 to 2 at both γ
    and shows each exact bifurcation value beside the printed one. --out writes
    casestudy.json (what --json prints), cases.csv, segments.csv, thresholds.csv, and curves.csv
    with the bifurcations' curves in the plane of α and γ.
    """
    from capsule_sym._records import dumps
    from capsule_sym._study import casestudy, thresholds

    total = len(casestudy.GAMMAS) * len(casestudy.PANELS)
    with make_progress() as progress:
        task = progress.add_task("Running the case study", total=total)
        cases = []
        for case in casestudy.run():
            cases.append(case)
            progress.advance(task)
        total = len(casestudy.GAMMAS) * len(thresholds.PRINTED)
        task = progress.add_task("Locating the bifurcations", total=total)
        found = thresholds.compute(lambda: progress.advance(task))
    record = casestudy.record(cases) | {"bifurcations": thresholds.record(found)}
    paths = [] if out is None else casestudy.write(record, out) + thresholds.save(found, out)
    if as_json:
        click.echo(dumps(record))
    else:
        for gamma in casestudy.GAMMAS:
            _print_cases([case for case in cases if case.parameters.gamma == gamma], gamma)
        _print_thresholds(found)
    if paths:
        click.echo(f"wrote {', '.join(map(str, paths))}", err=True)


def _print_thresholds(found: list[Threshold]) -> None:
    from capsule_sym._study.thresholds import conclusion

    numbers = ("exact α", "printed α", "place")
    table = make_table("γ", "event", "line", *numbers, right=numbers)
    for one in found:
        printed = f"{one.printed.alpha}" if one.printed else "none"
        event, value = one.bifurcation, f"{float(one.value):.12f}"
        row = (f"{one.gamma}", event.type, event.line, value, printed, f"{one.place or ''}")
        table.add_row(*row)
    console = make_console()
    console.print(table)
    console.print(f"\n{conclusion(found)}\n", soft_wrap=False)


def _print_cases(cases: list[Case], gamma: float) -> None:
    from capsule_sym._study.casestudy import THRESHOLDS

    table = make_table("", "α", "exact", "printed", "")
    for case in cases:
        alpha = case.parameters.alpha
        motion = case.motion
        exact = _folded(motion.global_map) if motion else f"not steady in {case.periods} periods"
        mark = "*" if alpha in THRESHOLDS else ""
        verdict = "[green]agree" if case.agrees else "[red]differ"
        table.add_row(case.panel, f"{alpha}{mark}", exact, _folded(case.printed), verdict)
    console = make_console()
    console.print(f"γ = {gamma}\n")
    console.print(table)
    inside = [case for case in cases if case.parameters.alpha not in THRESHOLDS]
    console.print(
        f"\n{sum(case.agrees for case in cases)} of {len(cases)} agree; "
        f"{sum(case.agrees for case in inside)} of the {len(inside)} away from the printed "
        "bifurcation values (*).\n"
    )


def _folded(global_map: str) -> str:
    """The global map with two local maps to a line, so that the table fits 80 columns."""
    maps = global_map.split(" ∘ ")
    return " ∘\n".join(" ∘ ".join(maps[i : i + 2]) for i in range(0, len(maps), 2))


def main(arguments: Sequence[str] | None = None, commands: click.Group = group) -> NoReturn:
    """Run the command line, of these commands, and exit.

    The status is that of the command, 2 for bad input, 130 for Ctrl-C, and 1 where stdout or
    stderr is closed or cannot be written, or the core was compiled from other files. `arguments`
    are those of the process if not given.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    sys.exit(_closed() or _status(given, commands))


def _closed() -> int:
    """0, or 1 where a stream is closed: the next file to be opened would get its number."""
    streams: dict[str, TextIO | None] = {"output": sys.stdout, "error": sys.stderr}
    for stream in streams.values():
        if isinstance(stream, TextIOWrapper):
            # A Σ that the terminal cannot show appears as \u03a3, which JSON reads too.
            stream.reconfigure(errors="backslashreplace")
    closed = [f"standard {name}" for name, stream in streams.items() if stream is None]
    return _complain(f"closed: {' and '.join(closed)}", 1) if closed else 0


def _status(arguments: list[str], commands: click.Group = group) -> int:
    try:
        return _ended(arguments, commands)
    except (KeyboardInterrupt, click.Abort) as interrupt:  # also while an error is told
        # With what was kept, where a command says so.
        return _complain(": ".join(["interrupted", *map(str, interrupt.args)]), _INTERRUPTED)


def _ended(arguments: list[str], commands: click.Group) -> int:
    try:
        if asked := os.environ.get(_COMPLETE):
            return _complete(asked)
        with commands.make_context(commands.name, arguments) as context:
            commands.invoke(context)
        sys.stdout.flush()
    except click.exceptions.Exit as done:
        return done.exit_code
    except click.BadParameter as error:
        number = re.match(r"'(.*)' is not a valid float", error.message)
        more = meant(number[1]) if number and not error.message.endswith("?") else ""
        return _complain(error.format_message() + more, 2)
    except click.ClickException as error:
        return _complain(error.format_message(), 2)
    except InvalidInput as error:
        return _complain(str(error), 2)
    except CapsuleError as error:
        return _complain(str(error), 1)
    except BrokenPipeError:
        _discard(sys.stdout)
        return 1
    except OSError as error:
        _discard(sys.stdout)
        return _complain(_reason(error), 1)
    return 0


def _complete(asked: str) -> int:
    """What a shell asks for: its script, such as for bash_source, or the possible next words."""
    from click.shell_completion import shell_complete

    status = shell_complete(group, {}, "capsule-sym", _COMPLETE, asked)
    allowed = "bash_source, zsh_source or fish_source"
    return _complain(f"{_COMPLETE} = {asked!r}: must be {allowed}", 2) if status else 0


def _reason(error: OSError) -> str:
    reason = error.strerror or str(error)
    if isinstance(error, ConnectionError | TimeoutError):
        return reason
    return f"{error.filename or 'output'}: {reason}"


def _discard(stream: TextIO) -> None:
    """Let what is still buffered have no reader, lest the flush at exit says so."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _complain(message: str, status: int) -> int:
    """The status, after a line on stderr, or on stdout where stderr is closed."""
    line = f"error: {' '.join(message.split())}"
    if stream := sys.stderr or sys.stdout:
        try:
            click.echo(line, file=stream)
        except OSError:
            _discard(stream)
    return status
