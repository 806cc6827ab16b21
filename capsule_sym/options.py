"""What several commands share: options, and consoles."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import click

from capsule_sym.errors import InvalidInput

if TYPE_CHECKING:
    from capsule_sym.parameters import Parameters, PhysicalParameters

_PIPED_WIDTH = 110  # columns, where no terminal says how many there are
_Command = TypeVar("_Command", bound=Callable[..., None])

json_option = click.option(
    "--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else."
)


def state_option(text: str) -> Callable[[_Command], _Command]:
    """The option --state: x_r, v_r and v_c at the start, at rest if not given."""
    return click.option(
        "--state",
        type=float,
        nargs=3,
        default=(0.0, 0.0, 0.0),
        metavar="XR VR VC",
        help=f"{text}  [default: 0 0 0]",
    )


def parameter_options(command: _Command) -> _Command:
    """Add --params for a file, and an option for each of the seven parameters."""
    # The defaults shown are those of `Parameters`, whose import would cost NumPy's.
    options = (
        ("alpha", "0.7", "Excitation amplitude."),
        ("omega", "0.8", "Excitation frequency."),
        ("delta", "0.02", "Gap."),
        ("zeta", "0.05", "Damping ratio."),
        ("beta", "1.5", "Stiffness ratio."),
        ("gamma", "3.3", "Mass ratio."),
        ("fb", "1", "Friction bound."),
    )
    command = click.option(
        "--params",
        "file",
        metavar="FILE.toml",
        help="Parameters from a file, dimensionless (options above override it) or physical in SI "
        "units (M_m M_c k1 k2 c G P_d Omega mu [g]; no options above).",
    )(command)
    for flag, default, text in reversed(options):
        name = "f_b" if flag == "fb" else flag
        text = f"{text}  [default: {default}]"
        command = click.option(f"--{flag}", name, type=float, help=text)(command)
    return command


def chosen_parameters(
    file: str | None, dimensionless: dict[str, float | None]
) -> tuple[Parameters, PhysicalParameters | None]:
    """The parameters of a file and of options, with those of the device if it is given in SI units.

    Raises InvalidInput for values that are not allowed, and for options beside SI units.
    """
    from capsule_sym.parameters import Parameters, load_parameters

    given = {name: value for name, value in dimensionless.items() if value is not None}
    if file is None:
        return Parameters(**given), None
    loaded = load_parameters(file)
    if isinstance(loaded, Parameters):
        return loaded.replace(**given), None
    for name, value in given.items():
        raise InvalidInput(name, value, f"absent where {file} is in SI units")
    return loaded.dimensionless(), loaded


def make_console(stderr: bool = False) -> Any:
    """A rich console on stdout or stderr, of a fixed width where that is no terminal."""
    from rich.console import Console

    file = sys.stderr if stderr else sys.stdout
    width = None if file.isatty() else _PIPED_WIDTH
    return Console(file=file, width=width, highlight=False)
