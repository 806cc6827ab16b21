"""Recorded runs of one device at several drives, in a camera's units, and their fit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from capsule_sym._arguments import checked
from capsule_sym._design.fit import fitted
from capsule_sym._design.fit_result import Fit
from capsule_sym._design.guesses import SLIPS, limits_of
from capsule_sym._design.measured import OF_STATE, measured
from capsule_sym._design.measurement_files import read_measured
from capsule_sym._design.problem import Misfit
from capsule_sym._design.quantities import System, real
from capsule_sym._design.residuals import PHASE, STATE, Recorded
from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._files import read_toml
from capsule_sym._map.checks import SEARCH_SECONDS, checked_state
from capsule_sym._map.result import by_fields
from capsule_sym._parameters import names_of
from capsule_sym._systems import drives

_KEYS = ("unknown", "each", "scale", "slip", "bounds", "run")  # of the file of a rig


@checked
@dataclass(frozen=True, eq=False)
class RigRun:
    """Recorded run: its series, its drive, and the known values of its start."""

    name: str
    """Name of the run, a prefix of its values."""
    data: Mapping[str, ArrayLike]
    """Columns (n,) as in `fit`; positions in the camera's units, times in the system's."""
    drive: Mapping[str, float]
    """Amplitude and frequency (alpha and omega, or P_d and Omega), and other changed parameters."""
    state: Sequence[float] | None = None
    """(x_r, v_r, v_c) at the first time, or a guess. Without a value an unknown state is searched
    along the steady motion from rest; a known one is rest."""
    phase: float | None = None
    """Phase at the first time, or a guess; an unknown one is searched over a period."""
    __repr__ = by_fields


@checked
@dataclass(frozen=True, eq=False)
class Rig:
    """Recorded runs of one device, and the unknowns of device, camera and runs.

    A series y of a quantity q is y = scale q(t') + offset + drift t at the camera's time t from the
    first, with t' = (1 + slip) t. Offsets of positions are always unknown.
    """

    runs: Sequence[RigRun]
    """Recorded runs."""
    unknown: Sequence[str]
    """Unknowns common to all runs: parameters, slip, and scale, or scale_x_m and scale_x_c."""
    each: Sequence[str] = ()
    """Unknowns of each run: phase, x_r, v_r, v_c, drift (of each position), or any of the above."""
    scale: float = 1.0
    """Unit of a series per unit of the model, such as pixels per metre; a guess if unknown."""
    slip: float = 0.0
    """Relative error of the camera's time base; a guess if unknown."""
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Bounds of the unknowns by name; those of a run as "run.phase"."""
    __repr__ = by_fields


def fit_rig(
    rig: Rig,
    system: System,
    *,
    loss: str = "linear",
    starts: int = 0,
    follow: int = 4,
    seed: int = 0,
    steps: int = 200,
    max_seconds: float = SEARCH_SECONDS,
    progress: Callable[[str], object] | None = None,
) -> Fit:
    """Fit unknown values of a rig to its recorded runs, by least squares.

    A series of a quantity q is scale q(t') + offset + drift t. Here t is the camera's time from the
    first one, and t' = (1 + slip) t. Scales, offsets and drifts need no guess, since the series are
    linear in them. An unknown phase or state without a guess is searched along the steady motion
    from rest.

    Parameters
    ----------
    rig : Rig
        Recorded runs, with the names of the unknowns. Positions are in the camera's units, times
        and all other values in those of `system`.
    system : Parameters, PhysicalParameters, or those of another scene
        Known parameters, and first guesses of the unknown ones, dimensionless or in SI units. The
        drive of a run replaces its values.
    loss : str, default "linear"
        Loss of the squared residuals, one of SciPy's: "linear", "soft_l1", "huber", "cauchy" or
        "arctan". All but the first give outliers less weight.
    starts : int, default 0, 0 to 100,000
        Number of further random guesses, within the rig's bounds or else between half and twice the
        guess.
    follow : int, default 4, 1 to 1,000
        Number of guesses that are continued: the best ones, of the given guess and all others.
    seed : int, default 0, 0 to 10**12
        Seed of the random guesses.
    steps : int, default 200, 1 to 100,000
        Largest number of runs with derivatives of each least-squares solution. A robust loss takes
        three of these for a guess.
    max_seconds : float, default 600.0, above 0
        Time limit, in seconds of wall time.
    progress : callable, default None
        Function that is called with a text during the fit.

    Returns
    -------
    Fit
        Result as of `fit`, in SI units if `system` is a device, else dimensionless. Values of a run
        have its name as a prefix, as in "slow.phase" and "slow.offset_x_m".

    Raises
    ------
    InvalidInput
        For names, columns and values that are not allowed, for runs without amplitude or frequency
        of the drive, and for a rig without runs.

    Notes
    -----
    Residuals of all series in the same unit have the same weight.

    See Also
    --------
    read_rig : rig of a file.
    fit : fit to one run.

    Examples
    --------
    >>> import numpy as np
    >>> import capsule_sym as cs
    >>> times = np.linspace(0.0, 15.0, 60)
    >>> x_r = cs.simulate(cs.Parameters(alpha=0.9), periods=2)(times)[:, 0]
    >>> drive = {"alpha": 0.9, "omega": 0.8}
    >>> run = cs.inputs.RigRun("slow", {"t": times, "x_r": 500 * x_r + 20}, drive)  # in pixels
    >>> rig = cs.inputs.Rig([run], unknown=["zeta", "scale"])
    >>> found = cs.fit_rig(rig, cs.Parameters(zeta=0.04))
    >>> print(found.status, {name: round(value, 6) for name, value in found.values.items()})
    converged {'zeta': 0.05, 'scale': 500.0, 'slow.offset_x_r': 20.0}
    """
    problem = Misfit(recorded(rig, system), tuple(rig.unknown), progress)
    limits = limits_of(problem, rig.bounds)
    return fitted(problem, limits, loss, starts, follow, seed, steps, max_seconds)


def recorded(rig: Rig, system: System) -> list[Recorded]:
    """Runs with all known values; raises InvalidInput as `fit_rig` does."""
    names = [run.name for run in rig.runs]
    if not names:
        raise InvalidInput("run", "none", "one run or more")
    well = all(isinstance(name, str) and name and "." not in name for name in names)
    if not well or len(set(names)) < len(names):
        raise InvalidInput("name", names, "a different name for each run, without a dot")
    if not real(rig.scale) or rig.scale <= 0:
        raise InvalidInput("scale", rig.scale, "a finite number above 0")
    if not real(rig.slip) or not SLIPS[0] <= rig.slip <= SLIPS[1]:
        raise InvalidInput("slip", rig.slip, f"from {SLIPS[0]:g} to {SLIPS[1]:g}")
    return [_recorded(rig, run, system) for run in rig.runs]


def _recorded(rig: Rig, run: RigRun, system: System) -> Recorded:
    """One of the runs."""
    for name in [*drives(system)][:2]:
        if name not in run.drive:
            raise InvalidInput(f"{run.name}: {name}", "missing", "given for each run")
    for name, value in run.drive.items():
        check_one_of(f"{run.name}: parameter", name, names_of(system))
        if name in rig.unknown:
            raise InvalidInput(f"{run.name}: {name}", value, "absent, as an unknown of all runs")
    with _within(run.name):
        data, driven = measured(run.data), system.replace(**run.drive)
    unknown = _unknown(rig, data.names, names_of(system))
    given = {name: rig.scale for name in ("scale", *unknown) if name.startswith("scale")}
    given["slip"] = rig.slip
    if run.state is not None:
        given |= dict(zip(STATE, checked_state(run.state), strict=True))
    if run.phase is not None:
        given[PHASE] = run.phase
    sought = tuple(name for name in (*STATE, PHASE) if name in unknown and name not in given)
    return Recorded(data, driven, unknown, given, run.name, sought)


@contextmanager
def _within(name: str) -> Iterator[None]:
    """Add the name of the run or the file to errors within."""
    try:
        yield
    except InvalidInput as error:
        raise InvalidInput(f"{name}: {error.field}", error.value, error.allowed) from error


def _unknown(rig: Rig, series: Sequence[str], own: Sequence[str]) -> tuple[str, ...]:
    """Unknowns of a run with these series, without those that have no meaning for them."""
    scales = [f"scale_{one}" for one in OF_STATE]
    named = [*rig.unknown, *rig.each]
    for name in named:
        check_one_of("unknown", name, [*own, *STATE, PHASE, "slip", "scale", *scales, "drift"])
    if len(set(named)) < len(named):
        raise InvalidInput("unknown", ", ".join(named), "different names")
    if "drift" in rig.unknown:
        raise InvalidInput("unknown", "drift", "among `each`, since each series has its own")
    left = {"drift", *(f"scale_{one}" for one in OF_STATE if one not in series)}
    kinds = ["drift", "offset"] if "drift" in named else ["offset"]
    linear = [f"{kind}_{one}" for kind in kinds for one in series if one.startswith("x")]
    return (*(name for name in named if name not in left), *linear)


def read_rig(path: str | PathLike[str]) -> Rig:
    r"""Rig from a TOML file, with its series from CSV or Parquet files beside it.

    Keys are `unknown`, `each`, `scale`, `slip`, a table `bounds`, and a table `[[run]]` for each
    run. A run has `file`, `name` (by default that of the file), the drive and other parameters of
    this run, `state` and `phase`.

    Parameters
    ----------
    path : str or path
        The TOML file.

    Returns
    -------
    Rig
        The recorded runs and the unknowns. Series are as `read_measured` gives: in SI units where
        their file names a multiple of them, else in its units.

    Raises
    ------
    InvalidInput
        For files that cannot be read, for other keys, and for a run without a file.

    See Also
    --------
    fit_rig : fit to these runs.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import capsule_sym as cs
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "slow.csv").write_text("t,x_m\n0,210\n0.1,214\n0.2,221\n")
    ...     file = Path(folder, "rig.toml")
    ...     lines = 'unknown = ["mu"]', "scale = 8000", "[[run]]", 'file = "slow.csv"'
    ...     _ = file.write_text("\n".join([*lines, "P_d = 3.0", "Omega = 8.0"]))
    ...     rig = cs.inputs.read_rig(file)
    >>> print(rig.unknown, rig.scale, rig.runs[0].name, rig.runs[0].drive)
    ['mu'] 8000 slow {'P_d': 3.0, 'Omega': 8.0}
    """
    table = read_toml(path)
    for key in table:
        check_one_of("key", key, _KEYS)
    runs = table.pop("run", [])
    if not isinstance(runs, list) or not all(isinstance(run, dict) for run in runs):
        raise InvalidInput("run", runs, "tables [[run]]")
    return Rig([_run(run, Path(path).parent) for run in runs], table.pop("unknown", ()), **table)


def _run(table: Mapping[str, Any], folder: Path) -> RigRun:
    """Run of its table."""
    if not isinstance(table.get("file"), str):
        raise InvalidInput("file", table.get("file", "missing"), "a file in each [[run]]")
    file = folder / table["file"]
    with _within(file.name):
        data = read_measured(file)
    own = {key: table[key] for key in ("state", "phase") if key in table}
    drive = {key: value for key, value in table.items() if key not in ("name", "file", *own)}
    return RigRun(table.get("name", file.stem), data, drive, **own)
