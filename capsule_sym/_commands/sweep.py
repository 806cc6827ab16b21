"""The commands `sweep` and `basin`."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import argument, command, group, option
from capsule_sym._texts import bars

_EXTRA = ("xarray", "zarr", "filelock")
_STORE = option("--out", metavar="DIR", help="Directory of the results.")


def _running(
    *,
    resume: bool = False,
    workers: int | None = None,
    max_seconds: options.TimeLimit = 3600.0,
) -> dict[str, Any]:
    """Settings of a run that can be resumed.

    Parameters
    ----------
    resume
        Continue an existing store.
    workers
        Number of parallel chunks. [default: one per core]
    """
    return locals()


@command()
def sweep(
    *,
    plan: Annotated[str | None, argument(metavar="[FILE.toml]")] = None,
    system: options.CountedRanged,
    periods: int | None = None,
    compute: Annotated[str | None, option(metavar="NAMES")] = None,
    info: Annotated[Path | None, option(type=click.Path(path_type=Path), metavar="DIR")] = None,
    store: Annotated[str | None, _STORE] = None,
    how: Annotated[dict[str, Any], group(_running)],
    as_json: options.Json = False,
) -> None:
    """Run every cell of the sweep in FILE.toml, or over ranges, and keep the results in DIR.

    Ranges are such as --alpha 0.1:2:41 --gamma 1:5:9, or of a device in --params --P-d 0.5:2:16. A
    file for a chart of motion types:

    \b
        periods = 300
        compute = ["itinerary", "progression"]
        [parameters]
        omega = 0.8
        [axes]
        alpha = { from = 0.01, to = 2.0, count = 512 }
        gamma = { from = 1.0, to = 5.0, count = 512, spacing = "log" }

    An axis may also be a list of values, or a random design: sample = { sobol = { alpha = [0, 2],
    gamma = [1, 5] }, count = 1024, seed = 1 }. Axes are parameters, x_r, v_r, v_c or phase;
    `[start]` has the fixed values of the start. `[device]`, in SI units, replaces `[parameters]`;
    options listed below as of the device may then be axes, but not in a random design. A line such
    as scene = "prototype" selects another scene. `compute` lists any of itinerary, progression,
    final, multipliers, energies, forces, lyapunov. Finished chunks are kept: an interrupted
    sweep continues with --resume. DIR/results.zarr opens with xarray. Exits with 3 at the time
    limit.

    Parameters
    ----------
    periods
        Excitation periods to run. [default: 300]
    compute
        Quantities, such as itinerary,energies. [default: itinerary]
    info
        Show axes, progress, outcomes, attractors and provenance of a store, also of a basin.
    """  # noqa: D301 (what keeps click from filling the file's lines is the character)
    options.require(*_EXTRA)
    if info is not None:
        for one in click.get_current_context().command.params:
            if one.name not in ("info", "as_json"):
                options.check_beside(str(one.name), never=("info",))
        return _print_store(info, as_json)
    over = options.ranges()
    given = {"periods": periods, "compute": compute and compute.split(",")}
    settings = {name: value for name, value in given.items() if value is not None}
    if plan is not None:
        for name in (*over, *system.names, *settings):
            options.check_beside(name, never=("plan",))
        loaded = capsule_sym.inputs.read_plan(plan)
        system.check_scene(loaded.parameters.scene, plan)
    else:
        loaded = _over(over, *system.load(), settings)
    if store is None:
        raise click.UsageError("Missing option '--out'.")
    with bars.reporting("Running cells") as progress:
        summary = capsule_sym.run_sweep(loaded, store, command=_line(), progress=progress, **how)
    _print_store(Path(store), as_json, _ended(summary, loaded.periods))


def _over(
    over: dict[str, tuple[float, ...]],
    parameters: capsule_sym.inputs.SceneParameters,
    device: capsule_sym.inputs.SceneDevice | None,
    settings: dict[str, Any],
) -> capsule_sym.inputs.Sweep:
    """Sweep over ranges of parameters; the others are those of `parameters`, or of the device.

    Raises UsageError without a range.
    """
    if not over:
        raise click.UsageError("give a range, such as --alpha 0.1:2:41, or FILE.toml")
    axes = {
        name: {"from": low, "to": high, "count": count} for name, (low, high, count) in over.items()
    }
    base = {"device": device.to_dict()} if device else {"parameters": parameters.to_dict()}
    scene = parameters.scene.source
    return capsule_sym.inputs.read_plan({"scene": scene, **base, "axes": axes, **settings})


@command()
def basin(
    *,
    system: options.Chosen,
    windows: options.CountedWindows,
    state: options.State = (0.0, 0.0, 0.0),
    periods: int = 300,
    store: Annotated[str, _STORE],
    how: Annotated[dict[str, Any], group(_running)],
    as_json: options.Json = False,
) -> None:
    """Run a basin of attraction and list its attractors.

    Starts lie on a grid over any of x_r, v_r, v_c and phase. Every attractor is an orbit closed by
    Newton's method; `attractor` in DIR/results.zarr gives each cell's attractor number. Exits with
    3 at the time limit.

    Parameters
    ----------
    state
        Start state, apart from the axes. [default: 0 0 0]
    periods
        Excitation periods to run.
    """
    options.require(*_EXTRA)
    axes = tuple(capsule_sym.inputs.Axis.linear(name, *window) for name, window in windows.items())
    if not axes:
        raise click.UsageError("give a range of starts, such as --x-r -1:1:40")
    parameters, device = system.load()
    chosen = capsule_sym.inputs.Sweep(axes, parameters, state, periods=periods, device=device)
    with bars.reporting("Running cells") as progress:
        summary, _ = capsule_sym.run_basin(chosen, store, command=_line(), progress=progress, **how)
    _print_store(Path(store), as_json, _ended(summary, periods))


def _print_store(store: Path, as_json: bool, ended: Any = None) -> None:
    """Print the contents of a store, and how the run ended that filled it, if there was one.

    Exits with 3 at the time limit.
    """
    from capsule_sym._sweeps.results import info_record

    record = {**(ended or {}), **info_record(store)}
    present.result(record, as_json)
    if record.get("status") == "time-limit":
        present.fail(f"the run ends ({record['status']}): {record['message']}")


def _ended(summary: Any, periods: int) -> dict[str, Any]:
    ended = {name: getattr(summary, name) for name in ("success", "status", "message")}
    rate = summary.periods_per_second_and_core(periods)
    return ended | {**summary.statistics, "periods_per_second_and_core": rate}


def _line() -> str:
    """Command line of this process, which a store keeps."""
    return shlex.join(["capsule-sym", *sys.argv[1:]])
