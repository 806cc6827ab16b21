"""The directory of a sweep, read and never changed.

A store is a directory with:

- `results.zarr`, which xarray opens; its chunks end with checksums by Zarr's codec crc32c;
- `sweep.json`: the sweep and its provenance;
- `chunks`: a record of each finished chunk: numbers of cells by outcome and by itinerary, and
  reasons of its failed cells.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from capsule_sym._errors import InvalidInput
from capsule_sym._files import read_json
from capsule_sym._sweeps.layout import itinerary_flags
from capsule_sym._sweeps.quantities import ATTRACTOR, Variable, variables

if TYPE_CHECKING:
    import xarray as xr

RESULTS, CHUNKS, SWEEP = "results.zarr", "chunks", "sweep.json"
FORMAT = 4
"""Format of a store; a changed one has another number."""


class Tally(NamedTuple):
    """Number of cells by outcome, itinerary and reason of failure.

    `itineraries` has (code, cells) by the itinerary's text.
    """

    outcomes: Counter[str]
    itineraries: dict[str, tuple[int, int]]
    reasons: Counter[str]


class Held:
    """Description and records of a store, without its results.

    `head` has the kind of the store ("sweep" or "basin"), its `sweep` and `provenance`. Raises
    InvalidInput if there is no store, or if it is damaged or of another format.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if not os.path.isfile(self.path / SWEEP):
            raise InvalidInput("store", str(path), "a directory that holds a sweep")
        with undamaged(self.path):
            self.head: dict[str, Any] = read_json(self.path / SWEEP, "a record", "store")
            if self.head["format"] != FORMAT:
                allowed = f"of format {FORMAT}: this one is of another version, so compute it again"
                raise InvalidInput("store", str(path), allowed)
            if self.head["kind"] not in ("sweep", "basin"):
                raise ValueError(self.head["kind"])
            self.counts = [int(axis["count"]) for axis in self.head["sweep"]["axes"]]
            sides = map(int, self.head["sweep"]["chunk"])
            pairs = zip(self.counts, sides, strict=True)
            self.grid = [-(-count // side) for count, side in pairs]
            self.chunks = math.prod(self.grid)
            self.variables = variables(self.head["sweep"]["compute"])
            if (self.path / RESULTS / ATTRACTOR).exists():
                self.variables |= {ATTRACTOR: Variable("i4", "number of the attractor")}
            _ = self.head["provenance"]["kernels"]

    def record_path(self, index: int) -> Path:
        """Path of the record of a finished chunk."""
        return self.path / CHUNKS / f"{index // 1000:06d}" / f"{index:09d}.json"

    def lost(self, index: int) -> list[str]:
        """Results of a finished chunk whose files are not there: Zarr would read them as empty."""
        at, left = list[int](), index
        for side in reversed(self.grid):
            left, place = divmod(left, side)
            at.insert(0, place)
        return [
            name
            for name, one in self.variables.items()
            if not Path(
                self.path, RESULTS, name, "c", *map(str, at + [0] * bool(one.dimension))
            ).is_file()
        ]

    def check(self, index: int) -> None:
        """Raise ValueError if a file of a finished chunk is lost."""
        if lost := self.lost(index):
            raise ValueError(f"chunk {index} of {', '.join(lost)} is missing")

    def recorded(self) -> Iterator[int]:
        """Numbers of the chunks that have a record."""
        for entry in sorted((self.path / CHUNKS).glob("*/*.json")):
            if entry.stem.isdecimal() and int(entry.stem) < self.chunks:
                yield int(entry.stem)

    def tally(self) -> Tally:
        """Sums over the records of all finished chunks; raises InvalidInput for a damaged one."""
        outcomes, reasons = Counter[str](), Counter[str]()
        itineraries: dict[str, tuple[int, int]] = {}
        with undamaged(self.path):
            for index in self.recorded():
                self.check(index)
                record = read_json(self.record_path(index), "a record", "store")
                outcomes.update({str(k): int(v) for k, v in record["outcomes"].items()})
                reasons.update(map(str, record["reasons"].values()))
                for text, (code, cells) in record["itineraries"].items():
                    before = itineraries.get(text, (0, 0))[1]
                    itineraries[text] = int(code), before + int(cells)
        return Tally(outcomes, dict(sorted(itineraries.items())), reasons)


@contextmanager
def undamaged(path: Path) -> Iterator[None]:
    """Context that raises InvalidInput for a file of a store that is not as it was written."""
    try:
        yield
    except InvalidInput:
        raise
    except _DAMAGE as error:
        why = f"{type(error).__name__}: {' '.join(str(error).split())[:100]}"
        allowed = f"an undamaged store ({why}); --resume computes damaged chunks again"
        raise InvalidInput("store", str(path), allowed) from error


_DAMAGE = ArithmeticError, AttributeError, LookupError, OSError, RuntimeError, TypeError, ValueError


def open_results(path: str | os.PathLike[str]) -> xr.Dataset:
    """Results of a store as an xarray Dataset.

    Values are loaded on access; a damaged chunk then raises ValueError. Dimensions and coordinates
    are the sweep's axes. Attributes have the fixed parameters and the provenance: command, kernels,
    core and versions. Every result has a `long_name`.

    `outcome` has the outcome of each cell; 0, PENDING, marks a cell that is not computed.
    `itinerary` holds codes, 0 for a cell without an itinerary. Its attributes `flag_values` and
    `flag_meanings` give their texts, with _ between the fields.

    Parameters
    ----------
    path : str or path
        Directory of a store that `run_sweep`, `run_basin` or the commands `sweep` and `basin`
        wrote.

    Returns
    -------
    xarray.Dataset
        Variables over the axes of the sweep, dimensionless. `final` and `multipliers` have three
        values for each cell. For a device, a quantity with a unit has the attributes `si_scale` and
        `si_units` to convert it to SI units.

    Raises
    ------
    InvalidInput
        If there is no store, or if its coordinates or metadata are damaged, or a chunk is missing.

    See Also
    --------
    run_sweep : computes the results.
    plot_chart : itineraries over two parameters.
    plot_metric : a metric over one or two parameters.
    plot_basin : attractors over two coordinates of the start.

    Examples
    --------
    >>> import tempfile
    >>> import capsule_sym as cs
    >>> from capsule_sym.inputs import Axis, Sweep
    >>> sweep = Sweep((Axis.of("alpha", [0.4, 0.9]),), periods=100)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     summary = cs.run_sweep(sweep, f"{folder}/store")
    ...     results = cs.results.open_results(f"{folder}/store").load()
    >>> print(dict(results.sizes), results.period_number.values)
    {'alpha': 2} [1 1]
    >>> print(results.itinerary.attrs["flag_meanings"])
    F5_F4_F1_F2 F5_F4_F5_F2
    """
    import xarray as xr  # its import takes longer than a small sweep, which needs none

    held = Held(Path(path))
    with undamaged(held.path):
        # Codecs of older formats of Zarr can run code.
        dataset: xr.Dataset = xr.open_zarr(
            held.path / RESULTS, chunks=None, consolidated=True, zarr_format=3
        )
        for index in held.recorded():
            held.check(index)
        if "itinerary" in dataset and "flag_values" not in dataset["itinerary"].attrs:
            dataset["itinerary"].attrs.update(itinerary_flags(held.tally().itineraries))
        return dataset


def info_record(path: Path) -> dict[str, Any]:
    """Summary of a store in plain values; raises InvalidInput if it is missing or damaged."""
    held = Held(path)
    tally, described = held.tally(), held.head["sweep"]
    ranked = sorted(tally.itineraries.items(), key=lambda one: -one[1][1])
    record: dict[str, Any] = {
        "store": str(path),
        "axes": described["axes"],
        "cells": math.prod(held.counts),
        "done": tally.outcomes.total(),
        "outcomes": dict(tally.outcomes),
        "itineraries": {text: cells for text, (_, cells) in ranked},
        "reasons": dict(tally.reasons.most_common(20)),
        "sweep": {name: v for name, v in described.items() if name != "axes"},
        "provenance": held.head["provenance"],
    }
    if held.head["kind"] == "basin":
        with open_results(path) as results:
            if ATTRACTOR in results:
                record["attractors"] = results[ATTRACTOR].attrs["attractors"]
    return record
