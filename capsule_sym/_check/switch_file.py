"""Switches of an integrator in a CSV file, with the run's start and parameters above them."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from decimal import Decimal, InvalidOperation
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._parameters import CAPSULE, Scene

_DIGITS = 15  # with so many digits a time is as exact as a double
_MOST_BYTES = 10_000_000


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
        File in UTF-8, of at most 10,000,000 bytes.
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
        For a file that cannot be read, for a column that is missing, for a line `# name = value` of
        another name, and for a value that is no number, with its row.

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
        if (size := Path(path).stat().st_size) > _MOST_BYTES:
            raise InvalidInput("file", str(path), f"at most {_MOST_BYTES} bytes, not {size}")
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise InvalidInput("file", str(path), f"readable ({error.strerror or error})") from None
    except ValueError:
        raise InvalidInput("file", str(path), "a CSV file in UTF-8") from None
    notes = [line[1:] for line in lines if line.startswith("#")]
    settings = dict(_setting(note, scene) for note in notes if "=" in note)
    rows = csv.reader(line for line in lines if line.strip() and not line.startswith("#"))
    try:
        head, *body = ([cell.strip() for cell in row] for row in rows)
    except (ValueError, csv.Error):
        raise InvalidInput("file", str(path), "a table with time and entered") from None
    if not head.count("time") == head.count("entered") == 1:
        raise InvalidInput("columns", ",".join(head), "time and entered, each once")
    numbers, events = [], []
    for count, row in enumerate(body, 1):
        if len(row) != len(head):
            raise InvalidInput(f"row {count}", ",".join(row), f"of {len(head)} cells, as the head")
        numbers.append(_number(f"time in row {count}", row[head.index("time")]))
        events.append(row[head.index("entered")])
    resolution = max(map(_resolution, numbers), default=0.0)
    return Switches(tuple(map(float, numbers)), tuple(events), resolution, settings)


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
    if not number.is_finite():
        raise InvalidInput(field, text, "finite")
    return number


def _resolution(number: Decimal) -> float:
    """Half a unit of the last digit that is printed; 0 for one that a double has not."""
    _, digits, exponent = number.as_tuple()
    assert isinstance(exponent, int)
    return 0.0 if len(digits) >= _DIGITS else 0.5 * 10.0**exponent
