"""The commands `optimise` and `steer`, and the presentation of their results."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option, several
from capsule_sym._design.counts import POINTS, SAMPLES, SEED
from capsule_sym._errors import InvalidInput

if TYPE_CHECKING:
    from capsule_sym._native import Watch

over_option = options.by_name(
    "A varied parameter with its bounds: dimensionless, or of the device. Repeatable.",
    "--over",
    of=options.Named(),
)
subject_option = option(
    "A constraint, such as 'peak_force <= 2'. Repeatable.",
    type=str,
    multiple=True,
    metavar="LIMIT",
)
margin_option = option("Floquet multipliers at most 1 - MARGIN.", type=float)


def shares_option(help: str, flag: str = "--tolerance") -> Any:
    """Option for pairs of a parameter and a share, repeatable."""
    kind = options.Named(click.FLOAT, "alpha=0.05")
    return options.by_name(help, flag, of=kind, metavar="NAME=SHARE")


tolerance_option = shares_option(
    "Optimise the worst case within ±SHARE of the parameter. Repeatable.",
)
_search = several(
    subject_to=subject_option,
    margin=margin_option,
    samples=options.count("Number of cells of the survey.", None, *SAMPLES),
    seed=options.count("Random seed of the cells.", 0, *SEED),
    max_seconds=options.max_seconds(),
)


@command()
def optimise(
    system: options.System = options.parameters(),
    maximise: str | None = option("Metric to maximise.", metavar="METRIC"),
    minimise: str | None = option("Metric to minimise.", metavar="METRIC"),
    over: dict[str, Any] = over_option,
    how: dict[str, Any] = _search,
    against: str | None = option(
        "Pareto front: minimise this second metric too.", "--pareto", metavar="METRIC"
    ),
    points: int = options.count("Number of points of the front of --pareto.", 50, *POINTS),
    tolerances: dict[str, float] = tolerance_option,
    state: tuple[float, float, float] = options.state(),
    among: str = option(
        "Motions to consider: those from --state, or all stable ones.",
        type=click.Choice(["starts", "stable"]),
        default="starts",
        show_default=True,
    ),
    out: Path | None = options.out(
        "Write the JSON here, of a front with its table as CSV and its picture."
    ),
    as_json: bool = options.as_json,
) -> None:
    """Find the parameters at which a metric of the steady motion is greatest or least.

    A metric is velocity, speed, progression, work, damper_loss, friction_loss, power, peak_force,
    peak_contact, speed_per_work or cost_of_transport, or arithmetic of these and of parameters.
    Energies and progression are per excitation period; speed_per_work is the absolute progression
    over the work. With a device all values are in SI units.

    Exits with 2 if no point within the bounds satisfies the constraints, and with 3 if no motion,
    or no optimum, is found.
    """
    options.check_beside("maximise", never=("minimise",))
    options.check_beside("points", needs=("against",))
    options.check_beside("among", never=("against",))
    metric = maximise if maximise is not None else minimise
    if metric is None:
        raise click.UsageError("give --maximise or --minimise METRIC")
    parameters, device = system.load()
    which = device or parameters
    how = {name: value for name, value in how.items() if value is not None}
    how |= {"maximise": maximise is not None, "starts": (state,), "tolerances": tolerances}
    found: capsule_sym.Optimum | capsule_sym.Front
    show: Callable[[], None]
    with telling("Optimising") as progress:
        how["progress"] = progress
        if against is None:
            found = one = capsule_sym.optimise(metric, over, which, among=among, **how)
            show = partial(_print_optimum, one)
        else:
            found = front = capsule_sym.pareto(metric, against, over, which, points=points, **how)
            show = partial(_print_front, front)
    if found.status is capsule_sym.OptimumStatus.INFEASIBLE:
        raise InvalidInput("subject_to", list(how["subject_to"]), f"possible: {found.message}")
    report(found, "optimum" if against is None else "front", show, out, as_json)
    end(found)


@command()
def steer(
    system: options.System = options.parameters(),
    over: dict[str, Any] = over_option,
    how: dict[str, Any] = _search,
    out: Path | None = options.out("Write the JSON here, the path as CSV, and its picture."),
    as_json: bool = options.as_json,
) -> None:
    """Find the best drives forward and backward, and a path of stable orbits between them.

    The drive is alpha and omega, or P_d and Omega of a device; --over may also vary D and alpha_low
    of pulses. The straight path is tried first, then paths with a corner, then those on a grid of
    drives. For a broken path, the place and the bifurcation are given.

    Exits with 3 if one of the drives is not found, or at the time limit. A broken path is a result.
    """
    parameters, device = system.load()
    how = {name: value for name, value in how.items() if value is not None}
    with telling("Steering") as progress:
        found = capsule_sym.steer(device or parameters, over or None, progress=progress, **how)
    report(found, "steering", lambda: print_steering(found), out, as_json)
    if found.status in ("no-optimum", "time-limit"):
        end(found)


def finite(record: Any) -> Any:
    """Record of numbers, texts, lists and dicts, with None for non-finite numbers."""
    if isinstance(record, Mapping):
        return {name: finite(value) for name, value in record.items()}
    if isinstance(record, list | tuple):
        return [finite(value) for value in record]
    if isinstance(record, float) and not math.isfinite(record):
        return None
    return record


def report(
    found: Any,
    name: str,
    show: Callable[[], None],
    out: Path | None,
    as_json: bool,
    extra: Mapping[str, Any] = MappingProxyType({}),
    *,
    device: options.Device = None,
    drawn: bool | None = None,
) -> None:
    """Present a result, with its record, table and picture as files.

    Rows of a dimensionless table have SI units too if there is a device. By default there is a
    picture if the table has rows; `drawn` overrides this.
    """
    columns = getattr(found, "columns", {})

    def record() -> dict[str, Any]:
        text: dict[str, Any] = finite({**found.to_dict(), **extra})
        return text

    def files() -> dict[str, Any]:
        table = {f"{name}.csv": table_of(found, device)} if columns else {}
        return {f"{name}.json": record()} | table

    drawn = any(map(len, columns.values())) if drawn is None else drawn
    pictures = {f"{name}.svg": partial(capsule_sym.plot, found)} if drawn else {}
    present.result(record, show, as_json, out, files, pictures)


def table_of(found: Any, device: options.Device = None) -> tuple[list[dict[str, Any]], list[str]]:
    """Columns of a result as rows of a table, and their names; in SI units too for a device."""
    from capsule_sym._records import in_si

    lists = {key: column.tolist() for key, column in found.columns.items()}
    each = (dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True))
    return [row | in_si(device, row) for row in each], list(lists)


def end(found: Any, limit: Watch | None = None) -> None:
    """Exit with 3, and the reason, if there is no result, or as interrupted after Ctrl-C."""
    if limit is not None and limit.stopped:
        raise KeyboardInterrupt
    if not found.success:
        present.fail(f"{found.status.value}: {found.message}")


@contextmanager
def telling(text: str) -> Iterator[Callable[[str], object]]:
    """Show progress texts of long work on stderr, if it is a terminal."""
    with present.progress(text) as update:
        yield lambda said: update(description=f"{text}: {said}".removeprefix(": "))


_MILLI = {"m/s": "mm/s", "m": "mm"}


def with_unit(value: float, unit: str) -> str:
    """Value with its unit; speeds and lengths in mm."""
    if unit in _MILLI:
        value, unit = 1000 * value, _MILLI[unit]
    return f"{value:.6g} {unit}".rstrip()


def in_unit(value: float, name: str, device: options.Device, digits: int = 6) -> str:
    """Dimensionless quantity with so many digits, or in its unit if there is a device."""
    from capsule_sym._units import UNITS

    if device is None:
        return f"{value:.{digits}g}"
    return with_unit(value * device.scale(name), UNITS[name].name)


def units_of(system: capsule_sym.SceneParameters | capsule_sym.SceneDevice) -> dict[str, str]:
    """Units of metrics and parameters; empty for dimensionless systems."""
    from capsule_sym._design import quantities
    from capsule_sym._units import METRIC_UNITS

    if not isinstance(system, capsule_sym.SceneDevice):
        return {}
    return {name: unit.name for name, unit in METRIC_UNITS.items()} | quantities.units_of(
        system.scene
    )


def _print_optimum(found: capsule_sym.Optimum) -> None:
    if not found.over:
        return
    units = units_of(found.system)
    kind = "greatest" if found.maximised else "least"
    rows = [(f"{kind} {found.metric}", with_unit(found.value, units.get(found.metric, "")))]
    for name, value in found.over.items():
        held = f"  (at bound: {found.bounds[name]:.4g} per unit)" if name in found.bounds else ""
        rows.append((name, f"{value:.9g} {units.get(name, '')}".rstrip() + held))
    if found.itinerary:  # else a cell of the survey, found before the time limit
        rows.append(("itinerary", " ".join(found.itinerary)))
        for name, value in found.metrics.items():
            rows.append((name.replace("_", " "), with_unit(value, units.get(name, ""))))
        for one in found.constraints:
            held = f"active, {one.multiplier:.4g} per unit"
            told = held if one.active else f"{one.slack:.4g} left"
            rows.append(("constraint", f"{one.text}: {told}"))
        if found.border is not None:
            rows.append(("on a border", " | ".join(found.border)))
        near = found.tightest
        rows += [
            ("largest multiplier", f"{found.multiplier:.6g}"),
            ("next change", f"{near.inequality}: {near.distance:.3g} of the bounds away"),
            *((f"by {name}", f"{slope + 0.0:.6g}") for name, slope in found.slopes.items()),
            ("residual", f"{found.residual:.1e}"),
        ]
    present.grid(rows)


def _print_front(found: capsule_sym.Front) -> None:
    if not found.points:
        return
    units = units_of(found.points[0].system)
    heads = [
        f"{name} ({unit})" if (unit := units.get(name, "")) else name
        for name in (*found.metrics, *found.points[0].over)
    ]
    rows = (
        (
            *(f"{number:.6g}" for number in (value, cost, *point.over.values())),
            " ".join(point.itinerary),
        )
        for value, cost, point in zip(found.values, found.costs, found.points, strict=True)
    )
    present.table((*heads, "itinerary"), rows, right=heads, gap=2)


def print_steering(found: capsule_sym.Steering) -> None:
    """Print both drives and the path between them."""
    units = units_of(found.forward.system)

    def drive(at: Mapping[str, float]) -> str:
        return ", ".join(
            f"{name} = {value:.6g} {units.get(name, '')}".rstrip() for name, value in at.items()
        )

    ways = ("forward", found.forward), ("backward", found.backward)
    present.grid(
        (
            way,
            with_unit(one.value, units.get("velocity", "")),
            drive(one.over),
            " ".join(one.itinerary),
        )
        for way, one in ways
        if one.over
    )
    console = present.make_console()
    console.print(f"{found.status.value}: {found.message}")
    for at in found.path:
        console.print(f"  {drive(at)}")
    for broken in found.breaks:
        way = f"by {'; '.join(map(drive, broken.by))}" if broken.by else "straight"
        console.print(f"  broken {way}: at {drive(broken.at)}, {broken.why}")
