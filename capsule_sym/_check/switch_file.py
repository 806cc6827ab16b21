"""Switches of an integrator in a CSV file, with the run's start and parameters above them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal, InvalidOperation
from io import StringIO
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._map.labelled import package
from capsule_sym._parameters import CAPSULE, Scene

_DIGITS = 15  # with so many digits a time is as exact as a double


class Switches(NamedTuple):
    """Switches as a file has them, and what stands above them as `# name = value`."""

    times: tuple[float, ...]
    events: tuple[str, ...]
    """Field entered at each."""
    resolution: float
    """Half a unit of the last digit printed; 0 where times are as exact as doubles."""
    settings: dict[str, tuple[float, ...]]
    """Parameters by name, state, phase, end and tolerance, each as numbers."""


def read_switches(path: str | PathLike[str], scene: Scene = CAPSULE) -> Switches:
    r"""Switches of a CSV file with the columns `time` and `entered`.

    Other columns are left alone, and so are comments without `=`. Lines `# name = value` give
    parameters of the scene, `state` (three numbers), `phase`, `end` and `tolerance`.

    Parameters
    ----------
    path : str or path
        File in UTF-8.
    scene : Scene, default the paper's capsule
        Scene whose parameters the file may name.

    Returns
    -------
    Switches
        Named tuple. `times` has numbers as the file gives them, and `events` the field entered at
        each. `resolution` is half a unit of the last digit printed, the largest of all times; that
        of a time of 15 digits or more is 0. So print all times with as many digits. `settings` has
        the numbers of the lines above, by name.

    Raises
    ------
    InvalidInput
        For a file that cannot be read, for a column that is missing or there twice, for a row of
        more cells than columns, for a line `# name = value` of another name, and for a value that
        is no number or beyond doubles. A time is named with its row.

    See Also
    --------
    check_switches : comparison of the switches with the exact ones.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import capsule_sym as cs
    >>> text = "# alpha = 0.7\n# end = 7.85\ntime,entered\n0.2411,F5\n2.6449,F2\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "switches.csv")
    ...     size = path.write_text(text)
    ...     read = cs.inputs.read_switches(path)
    >>> print(read.times, read.events, f"{read.resolution:.5f}")
    (0.2411, 2.6449) ('F5', 'F2') 0.00005
    >>> print(read.settings)
    {'alpha': (0.7,), 'end': (7.85,)}
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
        kinds: dict[str, Any] = {"comment": "#", "dtype": str, "keep_default_na": False}
        table = package("pandas").read_csv(StringIO(text), skipinitialspace=True, **kinds)
    except OSError as error:
        raise InvalidInput("file", str(path), f"readable ({error.strerror or error})") from None
    except ValueError as error:  # of its encoding, or of its rows
        allowed = f"in UTF-8, a table with time and entered ({str(error).strip()})"
        raise InvalidInput("file", str(path), allowed) from None
    table.columns = table.columns.str.strip()
    if not {"time", "entered"} <= set(table) or {"time.1", "entered.1"} & set(table):
        raise InvalidInput("columns", ",".join(table), "time and entered, each once")
    # Of more cells than names, pandas takes the first as the index.
    if list(table.index) != list(range(len(table))):
        raise InvalidInput("row 1", table.index[0], f"the first of {len(table.columns)} cells")
    notes = [line[1:] for line in text.splitlines() if line.startswith("#")]
    settings = dict(_setting(note, scene) for note in notes if "=" in note)
    numbers = [_number(f"time in row {k}", cell) for k, cell in enumerate(table["time"], 1)]
    events = tuple(table["entered"].str.strip())
    resolution = max(map(_resolution, numbers), default=0.0)
    return Switches(tuple(map(float, numbers)), events, resolution, settings)


def _setting(note: str, scene: Scene) -> tuple[str, tuple[float, ...]]:
    """Name and numbers of a line `name = value`."""
    name, _, text = (part.strip() for part in note.partition("="))
    allowed: Sequence[str] = (*scene.facts.PARAMETERS, "state", "phase", "end", "tolerance")
    check_one_of("# name", name, allowed)
    words = text.replace(",", " ").split()
    if len(words) != (3 if name == "state" else 1):
        raise InvalidInput(f"# {name}", text, "three numbers" if name == "state" else "a number")
    return name, tuple(float(_number(f"# {name}", word)) for word in words)


def _number(field: str, text: str) -> Decimal:
    try:
        number = Decimal(text)
    except InvalidOperation:
        raise InvalidInput(field, text, "a number") from None
    if not (number.is_finite() and math.isfinite(float(number))):
        raise InvalidInput(field, text, "finite")
    return number


def _resolution(number: Decimal) -> float:
    """Half a unit of the last digit that is printed; 0 for a number of 15 digits or more."""
    _, digits, exponent = number.as_tuple()
    assert isinstance(exponent, int)
    return 0.0 if len(digits) >= _DIGITS else 0.5 * 10.0**exponent
