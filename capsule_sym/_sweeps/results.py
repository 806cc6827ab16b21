"""The directory of a sweep, read and checked, never changed.

A store is a directory with:

- `results.zarr`, which xarray opens; its chunks end with checksums by Zarr's codec crc32c;
- `sweep.json`: the sweep, its provenance, and the checksums of the files of `results.zarr` that
  hold no chunk, as written first (`files`) and at the end of a run (`ended`, until then empty);
- `chunks`: a record of each finished chunk (texts of its itineraries, reasons of its failed
  cells), and a second copy of `sweep.json`.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from capsule_sym._errors import CapsuleError, InvalidInput
from capsule_sym._sweeps.files import checksum, ending, own_checksum, unsealed
from capsule_sym._sweeps.layout import itinerary_flags
from capsule_sym._sweeps.quantities import ATTRACTOR, QUANTITIES, variables
from capsule_sym._sweeps.sweep import MOST_CELLS

if TYPE_CHECKING:
    import xarray as xr

RESULTS, CHUNKS = "results.zarr", "chunks"
SWEEP, COPY = "sweep.json", "chunks/sweep.copy"


_AXIS = {
    **{"name": str, "quantities": [str], "count": int},
    **{"first": [int | float], "last": [int | float]},
}
_HEAD = {
    "format": int,
    "kind": str,
    "sweep": {"axes": [_AXIS], "chunk": [int], "compute": [str], "scene": str},
    "provenance": {"command": str, "kernels": str, "core": str, "versions": {str: str}},
    "files": {str: str},
    "ended": {str: str},
}
_RECORD = {
    "core": str,
    "outcomes": {str: int},
    "itineraries": {str: (int, int)},
    "reasons": {str: str},
    "checksums": {str: int},
}
_READ_WHOLE = 10**7  # cells of a store that is read in less than a second
FORMAT = 2
"""Format of a store; a changed one has another number."""


class Check(NamedTuple):
    """Undamaged finished chunks, and all that is damaged.

    `chunks` are the numbers of the damaged chunks, `files` the other damaged files.
    """

    whole: frozenset[int]
    chunks: tuple[int, ...]
    files: tuple[str, ...]


class Tally(NamedTuple):
    """Number of cells by outcome, itinerary, reason of failure and core.

    `itineraries` has (code, cells) by the itinerary's text.
    """

    outcomes: Counter[str]
    itineraries: dict[str, tuple[int, int]]
    reasons: Counter[str]
    cores: dict[str, int]


class Held:
    """Contents of a store; raises InvalidInput if there is none, or if its `sweep.json` is damaged.

    `head` has the kind of the store ("sweep" or "basin"), its `sweep`, `provenance`, `files` and
    `ended`.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self.results = self.path / RESULTS
        if not any(os.path.lexists(self.path / name) for name in (SWEEP, COPY)):
            raise InvalidInput("store", str(path), "a directory that holds a sweep")
        self.heads = {name: unsealed(self.path / name, _HEAD) for name in (SWEEP, COPY)}
        head = self.heads[SWEEP] or self.heads[COPY]
        if not head or head["format"] != FORMAT or not _is_sound(head):
            raise InvalidInput("store", str(path), f"of this version, with an undamaged {SWEEP}")
        self.head: dict[str, Any] = head

    @cached_property
    def grid(self) -> tuple[int, ...]:
        """Number of chunks along each axis."""
        counts = [axis["count"] for axis in self.head["sweep"]["axes"]]
        sides = self.head["sweep"]["chunk"]
        return tuple(-(-n // side) for n, side in zip(counts, sides, strict=True))

    def keys(self, index: int) -> dict[str, str]:
        """File of each result in a chunk, by the result's name."""
        place = "/".join(map(str, np.unravel_index(index, self.grid)))
        return {
            name: f"{name}/c/{place}" + ("/0" if v.dimension else "")
            for name, v in variables(self.head["sweep"]["compute"]).items()
        }

    def record_path(self, index: int) -> Path:
        """Path of the record of a finished chunk."""
        return self.path / CHUNKS / f"{index // 1000:06d}" / f"{index:09d}.json"

    def record(self, index: int) -> dict[str, Any] | None:
        """Record of a finished chunk; None if there is none or it is damaged."""
        record: dict[str, Any] | None = unsealed(self.record_path(index), _RECORD)
        return record

    def tally(self) -> Tally:
        """Sums over the records of all finished chunks."""
        outcomes, reasons, cores = Counter[str](), Counter[str](), Counter[str]()
        itineraries: dict[str, tuple[int, int]] = {}
        for record in filter(None, map(self.record, self._recorded())):
            outcomes.update(record["outcomes"])
            reasons.update(record["reasons"].values())
            cores[record["core"]] += sum(record["outcomes"].values())
            for text, (code, cells) in record["itineraries"].items():
                itineraries[text] = code, itineraries.get(text, (code, 0))[1] + cells
        if len({code for code, _ in itineraries.values()}) < len(itineraries):
            raise CapsuleError(f"two itineraries have one code: {itineraries}")
        return Tally(
            outcomes, dict(sorted(itineraries.items())), reasons, dict(sorted(cores.items()))
        )

    def damaged_files(self, *, data: bool = True) -> list[str]:
        """Damaged files of `results.zarr`, without the chunks.

        Without `data` only the coordinates and the metadata are checked.
        """
        begun, ended = self.head["files"], self.head["ended"]
        return [
            f"{RESULTS}/{key}"
            for key in {**begun, **ended}
            # The end of a run rewrites some of them; a killed run may leave either version.
            if (data or not key.startswith(f"{ATTRACTOR}/c/"))
            and checksum(self.results / key) not in {begun.get(key), ended.get(key)} - {None}
        ]

    def is_whole(self, index: int, checksum_of: Callable[[Path], int]) -> bool:
        """True for a finished chunk whose files have the checksums in its record."""
        record = self.record(index)
        return record is not None and all(
            checksum_of(self.results / key) == record["checksums"].get(name)
            for name, key in self.keys(index).items()
        )

    def damage(self) -> str:
        """First damaged file or chunk; empty if there is none.

        Of large stores only the ends of chunks are read.
        """
        small = math.prod(axis["count"] for axis in self.head["sweep"]["axes"]) <= _READ_WHOLE
        of = own_checksum if small else ending
        chunks = (f"chunk {index}" for index in self._expected() if not self.is_whole(index, of))
        return next(chain(self.damaged_files(data=False), chunks), "")

    def check(self) -> Check:
        """Compare every file with its checksum."""
        files = [*self.damaged_files(), *(name for name, head in self.heads.items() if not head)]
        whole: dict[bool, list[int]] = {True: [], False: []}
        for index in self._expected():
            whole[self.is_whole(index, own_checksum)].append(index)
        return Check(frozenset(whole[True]), tuple(whole[False]), tuple(files))

    def _expected(self) -> Iterable[int]:
        """Numbers of the chunks that are finished, damaged or not."""
        return range(math.prod(self.grid)) if self.head["ended"] else self._recorded()

    def _recorded(self) -> Iterator[int]:
        """Numbers of the chunks that have a record, damaged or not."""
        total = math.prod(self.grid)
        for entry in sorted((self.path / CHUNKS).glob("*/*.json")):
            if entry.stem.isdecimal() and entry == self.record_path(int(entry.stem)):
                index = int(entry.stem)
                if index < total:
                    yield index


def _is_sound(head: dict[str, Any]) -> bool:
    """True for a kind of store, and axes, chunks and results that a sweep can have."""
    described = head["sweep"]
    counts, sides = [axis["count"] for axis in described["axes"]], described["chunk"]
    within = (
        head["kind"] in ("sweep", "basin")
        and len(sides) == len(counts) > 0
        and all(1 <= side <= n for side, n in zip(sides, counts, strict=True))
    )
    return within and math.prod(counts) <= MOST_CELLS and {*described["compute"]} <= {*QUANTITIES}


def damaged(path: Path, what: str, kind: str = "sweep") -> InvalidInput:
    """Error about a damaged part of a store, with the command that mends it."""
    allowed = f"undamaged, but {what} is not: the same `capsule-sym {kind}` with --resume mends it"
    return InvalidInput("store", str(path), allowed)


def open_results(path: str | os.PathLike[str]) -> xr.Dataset:
    """Results of a store as an xarray Dataset.

    Values are loaded on access. Dimensions and coordinates are the sweep's axes. Attributes have
    the fixed parameters and the provenance: command, kernels, core and versions. Every result has a
    `long_name`.

    `outcome` has the outcome of each cell; 0, PENDING, marks a cell that is not computed.
    `itinerary` holds codes. Its attributes `flag_values` and `flag_meanings` give their texts, with
    _ between the fields.

    Parameters
    ----------
    path : str or path
        Directory of a store that `run_sweep`, `run_basin` or the commands `sweep` and `basin`
        wrote.

    Returns
    -------
    xarray.Dataset
        Variables with one value for each cell, over the axes of the sweep. They are dimensionless.
        For a device `si_scale` and `si_units` among their attributes convert them to SI units.

    Raises
    ------
    InvalidInput
        If there is no store, or if its coordinates, metadata or chunks are damaged. In a store of
        more than 10^7 cells only the ends of the chunks are checked.

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
    if not (what := held.damage()):
        try:
            # Codecs of older formats of Zarr can run code.
            dataset: xr.Dataset = xr.open_zarr(
                held.results, chunks=None, consolidated=True, zarr_format=3
            )
            if "itinerary" in dataset and "flag_values" not in dataset["itinerary"].attrs:
                dataset["itinerary"].attrs.update(itinerary_flags(held.tally().itineraries))
            return dataset
        except (ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError):
            what = RESULTS
    raise damaged(held.path, what, held.head["kind"])


def info_record(path: Path, check: bool = False) -> dict[str, Any]:
    """Summary of a store in plain values; with `check` also its damaged parts.

    Raises InvalidInput if there is no store, and without `check` for a damaged one.
    """
    held = Held(path)
    if not check and (what := held.damage()):
        raise damaged(path, what, held.head["kind"])
    tally = held.tally()
    described = held.head["sweep"]
    record: dict[str, Any] = {
        "store": str(path),
        "axes": described["axes"],
        "cells": math.prod(axis["count"] for axis in described["axes"]),
        "done": tally.outcomes.total(),
        "outcomes": dict(tally.outcomes),
        "itineraries": {text: cells for text, (_, cells) in tally.itineraries.items()},
        "reasons": dict(tally.reasons.most_common(20)),
        "cores": tally.cores,
        "sweep": {name: v for name, v in described.items() if name != "axes"},
        "provenance": held.head["provenance"],
    }
    if check:
        found = held.check()
        record["damaged_parts"] = [*found.files, *(f"chunk {index}" for index in found.chunks)]
    elif held.head["kind"] == "basin":
        with open_results(path) as results:
            if ATTRACTOR in results:
                record["attractors"] = results[ATTRACTOR].attrs["attractors"]
    return record
