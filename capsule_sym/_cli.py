"""The command line: `capsule-sym`, also `python -m capsule_sym`.

Commands import what they need when they are called, so that `--help` costs nothing and `run` never
imports SymPy.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper
from typing import NoReturn, TextIO

import click

from capsule_sym._commands.signature import Command
from capsule_sym._errors import CapsuleError, InvalidInput, NotInstalled, counted
from capsule_sym._figures.sizes import UNLISTED

_INTERRUPTED = 130  # the exit status of shells for it
_COMPLETE = "_CAPSULE_SYM_COMPLETE"  # environment variable by which a shell requests completions


class _LazyCommand(click.Command):
    """A command named here, whose module is imported only when it is called."""

    def __init__(self, name: str, module: str, short_help: str) -> None:
        super().__init__(name, short_help=short_help)
        self.module = module


class CommandGroup(click.Group):
    """Group of commands that are imported when they are called, in the order of their use."""

    def add(self, name: str, module: str, short_help: str) -> None:
        """Add the command of this name in a module, with _ for -."""
        self.add_command(_LazyCommand(name, module, short_help))

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order in which they were added."""
        return list(self.commands)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name, command, rest = super().resolve_command(ctx, args)
        if isinstance(command, _LazyCommand):
            command = getattr(import_module(command.module), (command.name or "").replace("-", "_"))
        return name, command.of_line(rest) if isinstance(command, Command) else command, rest


def _show_version(context: click.Context, _: click.Parameter, asked: bool) -> None:
    if not asked:
        return
    from capsule_sym import __version__
    from capsule_sym._native import core

    count = 0 if core is None else core.lanes()
    lanes = f"C core, {counted(count, 'lane')}"
    click.echo(f"{__version__} ({lanes if count else 'no C core: NumPy'})")
    context.exit()


_SCENES = "capsule, slope, prototype, reaction, reaction_pulse"
_ABOUT = f"Scenes: {_SCENES}. --scene chooses one, with its own parameters."


@click.group("capsule-sym", cls=CommandGroup, invoke_without_command=True, epilog=_ABOUT)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version and the core that is used, and exit.",
)
@click.pass_context
def group(context: click.Context) -> None:
    """The exact three-dimensional map of a capsule system with bidirectional drifts."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for _name, _module, _text in (
    ("run", "run", "Run the map and show its steady motion."),
    ("orbit", "orbit", "Solve for a periodic orbit, or search for all."),
    ("branch", "branch", "Follow an orbit in a parameter, with bifurcations."),
    ("curve", "curve", "Follow bifurcations in two parameters."),
    ("figure", "figures", "Draw branches, curves, a sweep or a basin."),
    ("sweep", "sweep", "Run a grid of parameters or starts; can be resumed."),
    ("basin", "sweep", "Run basins of attraction over a grid of starts."),
    ("attractors", "attractors", "Find all attractors of a box of starts."),
    ("shock", "shock", "Find the least knock after which a motion is lost."),
    ("pulse", "pulse", "Switch to another motion by a pulse of the drive."),
    ("optimise", "optimise", "Find the best parameters for a metric."),
    ("tolerances", "tolerances", "Show the effect of tolerances on metrics."),
    ("fit", "fit", "Fit parameters to measured series."),
    ("check", "check", "Check an integrator's switches."),
    ("explore", "explore", "Open the exact map as a page in a browser."),
    ("verify", "verify", "Prove the theory of a scene: closed forms, switching."),
):
    group.add(_name, f"capsule_sym._commands.{_module}", _text)


def main(arguments: Sequence[str] | None = None, commands: click.Group = group) -> NoReturn:
    """Run the command line, of these commands, and exit.

    The status is that of the command, 2 for bad input, 130 for Ctrl-C, and 1 for any other error
    of the package or the operating system, such as a missing library, a core compiled from other
    files, or a stdout or stderr that is closed. `arguments` are those of the process if not given.
    """
    if arguments is None:
        os.environ["MPLBACKEND"] = "agg"  # pictures are written, and no window is opened
    token = UNLISTED.set(True)
    given = list(sys.argv[1:] if arguments is None else arguments)
    status = _closed() or _status(given, commands)
    UNLISTED.reset(token)
    # Ctrl-C within an `exec` of text, as in SymPy, would kill `python -m` by a signal at its end.
    exec("")  # Python forgets it
    sys.exit(status)


def _closed() -> int:
    """0, or 1 if a stream is closed: the next file to be opened would get its number.

    Open streams then escape what they cannot encode.
    """
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
    except (KeyboardInterrupt, click.Abort) as interrupt:  # also while an error is printed
        # With the kept results, if a command reports them.
        return _complain(": ".join(["interrupted", *map(str, interrupt.args)]), _INTERRUPTED)


def _ended(arguments: list[str], commands: click.Group) -> int:
    """Exit status of a command that ends by itself; its error is printed."""
    try:
        if asked := os.environ.get(_COMPLETE):
            return _complete(asked)
        with commands.make_context(commands.name, arguments) as context:
            commands.invoke(context)
        sys.stdout.flush()
    except click.exceptions.Exit as done:
        return done.exit_code
    except click.ClickException as error:
        return _complain(error.format_message(), 2)
    except InvalidInput as error:
        return _complain(str(error), 2)
    except ModuleNotFoundError as error:
        return _complain(str(NotInstalled(error)), 1)
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
    """Completion for a shell: its script, such as for bash_source, or the possible next words."""
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
    """Discard buffered output without a reader, so that the flush at exit cannot fail."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _complain(message: str, status: int) -> int:
    """Return the status after a line on stderr, or on stdout if stderr is closed."""
    line = f"error: {' '.join(message.split())}"
    if stream := sys.stderr or sys.stdout:
        try:
            click.echo(line, file=stream)
        except OSError:
            _discard(stream)
    return status
