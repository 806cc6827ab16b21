"""Writing results: chunks are written whole or not at all, and damaged ones again."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import zarr
from filelock import FileLock, Timeout

from capsule_sym._errors import CapsuleError, InvalidInput
from capsule_sym._native import live
from capsule_sym._sweeps import layout
from capsule_sym._sweeps.cells import Block
from capsule_sym._sweeps.files import check_inside, checksums, ending, move, place, remove, sealed
from capsule_sym._sweeps.quantities import CellOutcome
from capsule_sym._sweeps.results import CHUNKS, COPY, FORMAT, RESULTS, SWEEP, Check, Held
from capsule_sym._sweeps.sweep import Sweep

_PARTIAL, _LOCK = "partial", "lock"


class NotWritten(CapsuleError):
    """Raised if results cannot be written, as on a full disk. Earlier results are kept."""


class Store:
    """Directory that receives the chunks of one sweep; made by `opened`."""

    def __init__(self, path: Path, sweep: Sweep, *, any_core: bool = False) -> None:
        self.path, self.sweep, self.any_core = path, sweep, any_core
        self.results, self.partial = path / RESULTS, path / _PARTIAL
        self.check = Check(frozenset(), (), ())
        self.held: Held
        self._staged: dict[str, Any] = {}

    def create(self, command: str) -> None:
        """Write an empty store; `sweep.json` comes last and marks it as complete."""
        for name in (RESULTS, CHUNKS):
            remove(self.path / name)
        origin = layout.provenance(command, self.sweep.parameters.scene)
        layout.lay(self.results, self.sweep, origin)
        head: dict[str, Any] = {
            "sweep": self.sweep.record(),
            "provenance": origin,
            "format": FORMAT,
        }
        head |= {"kind": self.sweep.kind, "files": checksums(self.results), "ended": {}}
        self._describe(head)

    def mend(self) -> None:
        """Find damage and rewrite the damaged files but chunks, which are computed again."""
        self.held = Held(self.path)
        self.check = self.held.check()
        if not self.check.files:
            return
        with writing(self.path):
            # As at the begin of a run, whose end writes all these files again with its additions.
            again = self.partial / RESULTS
            layout.lay(again, self.sweep, self.held.head["provenance"])
            files = checksums(again)
            move(files, again, self.results)
            remove(again)
            self._describe({**self.held.head, "files": files, "ended": {}})

    def publish(self, index: int, block: Block) -> None:
        """Write a chunk to `partial`, move its files to their places, and record it as finished.

        Raises NotWritten if that fails, and CapsuleError for a chunk of other kernels, or of
        another core than the one with which the store was begun.
        """
        kernels = self.sweep.parameters.scene.digest
        if block.kernels != kernels:
            raise CapsuleError(f"a worker has the kernels {block.kernels}, this process {kernels}")
        held = self.held
        if not self.any_core:
            check_core(self.path, block.core, held.head["provenance"]["core"])
        with writing(self.path):
            region = self.sweep.region(index)
            shape = tuple(part.stop - part.start for part in region)
            keys = held.keys(index)
            for name, staged in self._staging().items():
                column = block.columns[name]
                staged[region] = column.reshape(shape + column.shape[1:])
            outcomes = Counter(block.columns["outcome"].tolist())
            record = {
                "checksums": {name: ending(self.partial / key) for name, key in keys.items()},
                "core": block.core,
                "outcomes": {CellOutcome(o).name.lower(): n for o, n in sorted(outcomes.items())},
                "itineraries": block.itineraries,
                "reasons": block.reasons,
            }
            move(keys.values(), self.partial, self.results)
            place(sealed(record), held.record_path(index), self.partial)

    def finish(self, added: dict[str, layout.Added]) -> None:
        """Write the results that need all chunks: itineraries, cores, further results.

        All files of the results but the chunks are written again, which also repairs damage.
        """
        held = self.held
        tally = held.tally()
        itineraries = tally.itineraries if "itinerary" in self.sweep.compute else None
        with writing(self.path):
            last = self.partial / RESULTS
            layout.lay(last, self.sweep, held.head["provenance"], tally.cores, itineraries, added)
            files = checksums(last)
            # At any moment each file is either the old one or the one listed here.
            move([key for key in files if key not in held.head["files"]], last, self.results)
            self._describe({**held.head, "ended": files})
            move([key for key in files if key in held.head["files"]], last, self.results)

    def _describe(self, head: dict[str, Any]) -> None:
        for path in (self.path / COPY, self.path / SWEEP):
            place(sealed(head), path, self.partial)
        self.held = Held(self.path)

    def _staging(self) -> dict[str, Any]:
        """Arrays like those of the results, in `partial`."""
        if not self._staged:
            self._staged = layout.arrays(zarr.open_group(self.partial), self.sweep)
        return self._staged


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Raises NotWritten for an error of the operating system."""
    try:
        yield
    except OSError as error:
        where = error.filename2 or error.filename or path
        raise NotWritten(
            f"{where}: {error.strerror or error}; finished cells are kept; continue with --resume"
        ) from error


@contextmanager
def opened(
    path: Path, sweep: Sweep, *, resume: bool, command: str, any_core: bool = False
) -> Iterator[Store]:
    """Store of a sweep for one run: a new one, or with `resume` an existing one.

    Raises InvalidInput for a directory of another content, of another sweep, of results of other
    kernels, or of another core unless `any_core`, and while another run writes to it.
    """
    begun = _is_begun(path)
    # The content of the lock file is cleared once the lock is held.
    lock = FileLock(path / _LOCK, timeout=0, on_acquired=lambda file: os.ftruncate(file, 0))
    try:
        path.mkdir(parents=True, exist_ok=True)
        held = lock.acquire()
    except Timeout:
        raise InvalidInput("store", str(path), "free: another run is writing to it") from None
    except OSError as error:
        raise InvalidInput("store", str(error.filename), f"writable ({error.strerror})") from error
    with held:
        store = Store(path, sweep, any_core=any_core)
        if begun:
            if not resume:
                raise InvalidInput("store", str(path), "new; to continue it use --resume")
            for at, folders, _ in os.walk(path):
                for link in (one for one in folders if os.path.islink(os.path.join(at, one))):
                    if link != _PARTIAL:
                        check_inside(Path(at, link), path)
            _check_same(path, sweep, any_core)
        with writing(path):
            remove(store.partial)
            if not begun:
                store.create(command)
        if begun:
            store.mend()
        yield store
        remove(store.partial)


def check_core(path: Path, core: str, begun: str) -> None:
    """Raises InvalidInput unless results of a core may be added to a store begun with `begun`."""
    if core != begun:
        allowed = f"{begun!r}, the core of {path}: results of two cores differ in the last bits; "
        allowed += "--any-core allows it, and the record of each chunk names its core"
        raise InvalidInput("core", core, allowed)


def _is_begun(path: Path) -> bool:
    """True if a directory is a store; raises InvalidInput for one with other content."""
    ours = {RESULTS, CHUNKS, _PARTIAL, _LOCK, SWEEP}
    try:
        held = {entry.name for entry in path.iterdir()} if os.path.lexists(path) else set()
        if SWEEP in held or os.path.lexists(path / COPY):
            return True
        # A store without sweep.json but with finished chunks is not emptied.
        chunks = any((path / CHUNKS).rglob("*.json")) if CHUNKS in held else False
    except (OSError, ValueError) as error:  # ValueError: a path with a zero character
        reason = error.strerror if isinstance(error, OSError) else error
        raise InvalidInput("store", str(path), f"a directory ({reason})") from error
    if chunks or not held <= ours:
        raise InvalidInput("store", str(path), "new, empty, or a directory that holds a sweep")
    return False


def _check_same(path: Path, sweep: Sweep, any_core: bool) -> None:
    head, scene = Held(path).head, sweep.parameters.scene
    origin = head["provenance"]
    before = {"kind": head["kind"], **head["sweep"], "kernels": origin["kernels"]}
    now = {"kind": sweep.kind, **sweep.record(), "kernels": scene.digest}
    for name, value in now.items():
        if before.get(name) != value:
            there = before.get(name)
            given, held = _apart(value, there), _apart(there, value)
            raise InvalidInput(name, given, f"{held!r}, as in {path}, or --out another directory")
    if not any_core:
        check_core(path, live(scene), origin["core"])


def _apart(value: Any, other: Any) -> Any:
    """Parts of a sweep's value that another one does not have: parameters, or at most two axes."""
    if isinstance(value, dict) and isinstance(other, dict):
        return {name: part for name, part in value.items() if other.get(name) != part}
    if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
        return value
    axes = [one for one in value if one not in other] or value
    shown = [
        f"{axis['count']} values of {axis['name']} from {axis['first'][0]:g} to {axis['last'][0]:g}"
        for axis in axes[:2]
    ]
    return "; ".join([*shown, *([f"{len(axes) - 2} more"] if axes[2:] else [])])
