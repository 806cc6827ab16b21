"""Writing results: a chunk is finished once its record is written, after its cells."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from filelock import FileLock, Timeout

from capsule_sym._errors import CapsuleError, InvalidInput
from capsule_sym._native import live
from capsule_sym._sweeps import layout
from capsule_sym._sweeps.cells import Block
from capsule_sym._sweeps.quantities import CellOutcome, variables
from capsule_sym._sweeps.results import FORMAT, RESULTS, SWEEP, Held, undamaged
from capsule_sym._sweeps.sweep import Sweep

_LOCK = "lock"


class NotWritten(CapsuleError):
    """Raised if results cannot be written, as on a full disk. Earlier results are kept."""


class Store:
    """Directory that receives the chunks of one sweep; made by `opened`."""

    def __init__(self, path: Path, sweep: Sweep) -> None:
        self.path, self.sweep, self.held = path, sweep, Held(path)
        with undamaged(path):
            self.group = zarr.open_group(path / RESULTS, mode="r+", zarr_format=3)
            self.arrays: dict[str, Any] = {one: self.group[one] for one in variables(sweep.compute)}
        self.whole = frozenset(index for index in self.held.recorded() if self._is_whole(index))

    def _is_whole(self, index: int) -> bool:
        """True if a finished chunk can be read: Zarr's codec compares its checksums."""
        region = self.sweep.region(index)
        try:
            found = {name: np.asarray(one[region]) for name, one in self.arrays.items()}
            return bool(found["outcome"].all()) and not self.held.lost(index)
        except (OSError, RuntimeError, TypeError, ValueError):
            return False

    def publish(self, index: int, block: Block) -> None:
        """Write a chunk, and then its record; raises NotWritten if that fails."""
        region = self.sweep.region(index)
        shape = tuple(part.stop - part.start for part in region)
        outcomes = Counter(block.columns["outcome"].tolist())
        record = {
            "outcomes": {CellOutcome(o).name.lower(): n for o, n in sorted(outcomes.items())},
            "itineraries": block.itineraries,
            "reasons": block.reasons,
        }
        with undamaged(self.path), writing(self.path):
            for name, column in block.columns.items():
                self.arrays[name][region] = column.reshape(shape + column.shape[1:])
            _write(self.held.record_path(index), record)

    def finish(self, added: dict[str, layout.Added]) -> None:
        """Write what needs all chunks: the texts of itineraries, and further results."""
        with undamaged(self.path), writing(self.path):
            if "itinerary" in self.sweep.compute:
                flags = layout.itinerary_flags(self.held.tally().itineraries)
                self.arrays["itinerary"].attrs.update(flags)
            layout.add(self.group, self.sweep, added)


def _write(path: Path, record: dict[str, Any]) -> None:
    """Write a record whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(record, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
    os.replace(part, path)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Context that raises NotWritten for an error of the operating system."""
    try:
        yield
    except OSError as error:
        where = error.filename2 or error.filename or path
        raise NotWritten(
            f"{where}: {error.strerror or error}; finished cells are kept; continue with --resume"
        ) from error


@contextmanager
def opened(path: Path, sweep: Sweep, *, resume: bool, command: str) -> Iterator[Store]:
    """Store of a sweep for one run: a new one, or with `resume` an existing one.

    Raises InvalidInput for a sweep that exists without `resume`, for a directory of another
    content, of another sweep, or of results of other kernels or another core, for one that cannot
    be written, and while another run writes to it.
    """
    try:
        entries = {one.name for one in path.iterdir()} if os.path.lexists(path) else set[str]()
        path.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path / _LOCK, timeout=0).acquire()
    except Timeout:
        raise InvalidInput("store", str(path), "free: another run is writing to it") from None
    except (OSError, ValueError) as error:  # ValueError: a path with a zero character
        reason = error.strerror if isinstance(error, OSError) else error
        raise InvalidInput("store", str(path), f"a writable directory ({reason})") from error
    with lock:
        if SWEEP in entries:
            if not resume:
                raise InvalidInput("store", str(path), "new; to continue it use --resume")
            _check_same(path, sweep)
        elif not entries <= {_LOCK, RESULTS}:  # of a run that ended while it was created
            raise InvalidInput("store", str(path), "new, empty, or a directory that holds a sweep")
        else:
            with writing(path):
                origin = layout.provenance(command, sweep.parameters.scene)
                layout.create(path / RESULTS, sweep, origin)
                head = {"format": FORMAT, "kind": sweep.kind, "sweep": sweep.record()}
                _write(path / SWEEP, head | {"provenance": origin})
        yield Store(path, sweep)


def _check_same(path: Path, sweep: Sweep) -> None:
    """Raises InvalidInput unless a store holds this sweep, computed by this code."""
    head, scene = Held(path).head, sweep.parameters.scene
    origin = {name: head["provenance"][name] for name in ("kernels", "core")}
    before = {"kind": head["kind"], **head["sweep"], **origin}
    now = {"kind": sweep.kind, **sweep.record(), "kernels": scene.digest, "core": live(scene)}
    for name, value in now.items():
        if (there := before.get(name)) != value:
            given, held = _apart(value, there), _apart(there, value)
            raise InvalidInput(name, given, f"{held!r}, as in {path}, or --out another directory")


def _apart(value: Any, other: Any) -> Any:
    """Parts of a sweep's value that another one does not have: parameters, or at most two axes."""
    if isinstance(value, dict) and isinstance(other, dict):
        return {name: part for name, part in value.items() if other.get(name) != part}
    if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
        return value
    axes = [one for one in value if one not in other] or value
    return "; ".join(
        f"{axis['count']} values of {axis['name']} from {axis['first'][0]:g} to {axis['last'][0]:g}"
        for axis in axes[:2]
    )
