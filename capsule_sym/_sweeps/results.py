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
from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from capsule_sym._errors import CapsuleError, InvalidInput
from capsule_sym._sweeps.files import checksum, sound, unsealed
from capsule_sym._sweeps.layout import itinerary_flags
from capsule_sym._sweeps.quantities import ATTRACTOR, variables

if TYPE_CHECKING:
    import xarray as xr

RESULTS, CHUNKS = "results.zarr", "chunks"
SWEEP, COPY = "sweep.json", "chunks/sweep.copy"


_HEAD = ("kind", "sweep", "provenance", "files", "ended")
_RECORD = ("core", "outcomes", "itineraries", "reasons")


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
        if not (head := self.heads[SWEEP] or self.heads[COPY]):
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
        return unsealed(self.record_path(index), _RECORD)

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

    def missing(self) -> Iterator[str]:
        """Files that finished chunks have lost."""
        for index in self._expected():
            for key in self.keys(index).values():
                if not (self.results / key).is_file():
                    yield f"{RESULTS}/{key}"

    def check(self) -> Check:
        """Compare every file with its checksum."""
        files = [*self.damaged_files(), *(name for name, head in self.heads.items() if not head)]
        whole, damaged = set(), []
        for index in self._expected():
            parts = (self.results / key for key in self.keys(index).values())
            if self.record(index) and all(map(sound, parts)):
                whole.add(index)
            else:
                damaged.append(index)
        return Check(frozenset(whole), tuple(damaged), tuple(files))

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


def open_results(path: str | os.PathLike[str]) -> xr.Dataset:
    """Results of a store as an xarray Dataset, loaded on access; cells not computed are PENDING.

    Dimensions and coordinates are the sweep's axes, attributes its provenance. `itinerary` holds
    codes; its attributes `flag_values` and `flag_meanings` give their texts, with _ between the
    fields. Raises InvalidInput if there is no store, or if its coordinates or metadata are damaged.
    """
    import xarray as xr  # its import takes longer than a small sweep, which needs none

    held = Held(Path(path))
    place, damaged = held.results, held.damaged_files(data=False) or list(islice(held.missing(), 1))
    try:
        if not damaged:
            dataset: xr.Dataset = xr.open_zarr(place, chunks=None, consolidated=True)
            if "itinerary" in dataset and "flag_values" not in dataset["itinerary"].attrs:
                dataset["itinerary"].attrs.update(itinerary_flags(held.tally().itineraries))
            return dataset
    except (OSError, ValueError):
        damaged = [place.name]
    raise InvalidInput("store", str(path), f"undamaged: repair {damaged[0]} with --resume")


def info_record(path: Path, check: bool = False) -> dict[str, Any]:
    """Summary of a store in plain values; with `check` also its damaged parts.

    Raises InvalidInput if there is no store.
    """
    held = Held(path)
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
