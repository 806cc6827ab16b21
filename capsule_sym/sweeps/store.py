"""Results on disk: chunks appear whole or not at all, and what is damaged is found and run again.

A store is a directory with `results.zarr` (what xarray opens), `sweep.json` (the sweep and its
provenance), and `chunks` (a record of each finished chunk: checksums of its files, the texts of
its words, the reasons of its failed cells).
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import math
import os
import shutil
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray

from capsule_sym.errors import CapsuleError, InvalidInput
from capsule_sym.sweeps.cells import KERNELS, Block, CellOutcome
from capsule_sym.sweeps.layout import (
    array,
    arrays,
    coordinates,
    outcome_flags,
    provenance,
    word_flags,
)
from capsule_sym.sweeps.sweep import Sweep

_RESULTS, _CHUNKS, _PARTIAL = "results.zarr", "chunks", "partial"
_LOCK, _SWEEP, _CHART = "lock", "sweep.json", "chart.zarr"


class NotWritten(CapsuleError):
    """Results could not be written, as on a full disk. What was written before stays good."""


class Store:
    """A directory that receives the chunks of one sweep; made by `opened`."""

    def __init__(self, path: Path, sweep: Sweep) -> None:
        self.path, self.sweep = path, sweep
        self.results, self.chunks = path / _RESULTS, path / _CHUNKS
        self._staged: dict[str, Any] = {}

    @property
    def partial(self) -> Path:
        """Where files are written before they are moved to their place."""
        return self.path / _PARTIAL

    def create(self, command: str) -> None:
        """Lays out an empty store; `sweep.json` comes last and says that it is whole."""
        for name in (_RESULTS, _CHUNKS):
            shutil.rmtree(self.path / name, ignore_errors=True)
        origin = provenance(command)
        self.chunks.mkdir()
        coordinates(self.sweep, origin).to_zarr(self.results, zarr_format=3, consolidated=False)
        arrays(zarr.open_group(self.results), self.sweep)
        head = {"sweep": self.sweep.record(), "provenance": origin}
        self._place(_text(head), self.path / _SWEEP)

    def publish(self, index: int, block: Block) -> None:
        """Writes a chunk beside, moves its files to their places, and records it as finished.

        Raises NotWritten if that cannot be done, CapsuleError for a chunk of other kernels.
        """
        if block.kernels != KERNELS:
            raise CapsuleError(f"a worker has the kernels {block.kernels}, this process {KERNELS}")
        with _writing(self.path):
            region = self.sweep.region(index)
            shape = tuple(part.stop - part.start for part in region)
            place = "/".join(map(str, np.unravel_index(index, self.sweep.chunks)))
            files = {}
            for name, staged in self._staging().items():
                column = block.columns[name]
                staged[region] = column.reshape(shape + column.shape[1:])
                key = f"{name}/c/{place}" + "/0" * (column.ndim - 1)
                files[key] = _checksum(self.partial / key)
            outcomes = Counter(block.columns["outcome"].tolist())
            record = {
                "files": files,
                "outcomes": {CellOutcome(o).name.lower(): n for o, n in sorted(outcomes.items())},
                "words": block.words,
                "reasons": block.reasons,
            }
            for key in files:
                (self.results / key).parent.mkdir(parents=True, exist_ok=True)
                os.replace(self.partial / key, self.results / key)
            self._place(_sealed(record), self._record_path(index))

    def state(self) -> tuple[set[int], int]:
        """The finished chunks whose files are as they were written, and how many are damaged."""
        whole, damaged = set(), 0
        for index in range(math.prod(self.sweep.chunks)):
            path = self._record_path(index)
            if path.exists():
                record = _unsealed(path)
                if record and all(
                    _checksum(self.results / k) == v for k, v in record["files"].items()
                ):
                    whole.add(index)
                else:
                    damaged += 1
        return whole, damaged

    def finish(self) -> None:
        """Writes the texts of all words to the array of their codes, as CF flags."""
        if "word" not in self.sweep.compute:
            return
        with _writing(self.path):
            self._staging()["word"].attrs.update(word_flags(words(self.path)))
            os.replace(self.partial / "word/zarr.json", self.results / "word/zarr.json")

    def add(self, name: str, values: NDArray[np.generic], attributes: dict[str, Any]) -> None:
        """Adds a result of all cells, computed from the others; raises NotWritten."""
        place = self.results / name
        with _writing(self.path):
            group = zarr.open_group(self.partial)
            array(group, name, self.sweep, values.dtype, attributes)[...] = values
            shutil.rmtree(place, ignore_errors=True)
            os.replace(self.partial / name, place)

    def _staging(self) -> dict[str, Any]:
        """Arrays like those of the results, beside them."""
        if not self._staged:
            self._staged = arrays(zarr.open_group(self.partial), self.sweep)
        return self._staged

    def _record_path(self, index: int) -> Path:
        return self.chunks / f"{index // 1000:06d}" / f"{index:09d}.json"

    def _place(self, text: str, path: Path) -> None:
        self.partial.mkdir(exist_ok=True)
        path.parent.mkdir(exist_ok=True)
        part = self.partial / path.name
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise NotWritten(
            f"{path}: {error.strerror or error}; what was finished is kept, and --resume goes on "
            "from there"
        ) from error


@contextmanager
def opened(path: Path, sweep: Sweep, *, resume: bool, command: str) -> Iterator[Store]:
    """The store of a sweep for one run: a new one, or with `resume` one that was begun.

    Raises InvalidInput for a directory that holds something else, another sweep or results of
    other kernels, and while another run has it.
    """
    _check_directory(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        lock = os.open(path / _LOCK, os.O_RDWR | os.O_CREAT)
    except OSError as error:
        raise InvalidInput("store", str(path), f"writable ({error.strerror})") from error
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InvalidInput("store", str(path), "free: another run is writing to it") from None
        store = Store(path, sweep)
        shutil.rmtree(store.partial, ignore_errors=True)
        if (path / _SWEEP).exists():
            if not resume:
                raise InvalidInput("store", str(path), "new, or continued with --resume")
            _check_same(path, sweep)
        else:
            with _writing(path):
                store.create(command)
        yield store
        shutil.rmtree(store.partial, ignore_errors=True)
    finally:
        os.close(lock)


def open_results(path: str | os.PathLike[str]) -> xr.Dataset:
    """The results in a store, read where they are used; cells not computed yet are PENDING.

    Dimensions and coordinates are the sweep's axes, attributes its provenance. `word` holds codes;
    its attributes `flag_values` and `flag_meanings` give their texts, with _ between the fields.
    Of a refined chart the whole chart is opened. Raises InvalidInput where there is no store.
    """
    if (Path(path) / _CHART).exists():
        chart: xr.Dataset = xr.open_zarr(Path(path) / _CHART, chunks=None, consolidated=False)
        return chart
    head(path)
    dataset: xr.Dataset = xr.open_zarr(Path(path) / _RESULTS, chunks=None, consolidated=False)
    if "word" in dataset and "flag_values" not in dataset["word"].attrs:
        dataset["word"].attrs.update(word_flags(words(Path(path))))
    return dataset


def write_chart(
    path: Path,
    sweep: Sweep,
    columns: dict[str, tuple[list[str], NDArray[np.generic]]],
    texts: dict[int, str],
    attributes: dict[str, Any],
) -> None:
    """Writes a refined chart: columns by name with their dimensions, texts of words by code."""
    chart = coordinates(sweep, provenance("")).assign(columns).assign_attrs(attributes)
    words = dict(sorted(texts.items()))
    chart["word"].attrs.update(flag_values=list(words), flag_meanings=" ".join(words.values()))
    chart["outcome"].attrs.update(outcome_flags())
    part = path / f"{_CHART}.{_PARTIAL}"
    with _writing(path):
        shutil.rmtree(part, ignore_errors=True)
        chart.to_zarr(part, zarr_format=3, consolidated=False)
        shutil.rmtree(path / _CHART, ignore_errors=True)
        os.replace(part, path / _CHART)


def head(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The sweep of a store and its provenance; raises InvalidInput where there is none."""
    try:
        loaded: dict[str, Any] = json.loads((Path(path) / _SWEEP).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidInput("store", str(path), "the directory of a sweep") from error
    return loaded


def words(path: Path) -> dict[str, tuple[int, int]]:
    """Code and number of cells of every word in the finished chunks of a store, by its text."""
    table: dict[str, tuple[int, int]] = {}
    for record in finished(path):
        for text, (code, cells) in record["words"].items():
            table[text] = code, table.get(text, (code, 0))[1] + cells
    if len({code for code, _ in table.values()}) < len(table):
        raise CapsuleError(f"two words have one code: {table}")
    return dict(sorted(table.items()))


def finished(path: Path) -> Iterator[dict[str, Any]]:
    """The records of the finished chunks of a store: `files`, `outcomes`, `words`, `reasons`."""
    for entry in sorted((path / _CHUNKS).glob("*/*.json")):
        record = _unsealed(entry)
        if record:
            yield record


def _check_directory(path: Path) -> None:
    ours = {_RESULTS, _CHUNKS, _PARTIAL, _LOCK, _SWEEP}
    try:
        held = {entry.name for entry in path.iterdir()} if path.exists() else set()
    except OSError as error:
        raise InvalidInput("store", str(path), f"a directory ({error.strerror})") from error
    # A store without its sweep.json, but with finished chunks, is not for this run to empty.
    chunks = any((path / _CHUNKS).rglob("*.json")) if _CHUNKS in held else False
    if _SWEEP not in held and (chunks or not held <= ours):
        raise InvalidInput("store", str(path), "new, or empty, or the directory of a sweep")


def _check_same(path: Path, sweep: Sweep) -> None:
    there = head(path)
    for name, value in sweep.record().items():
        if there["sweep"].get(name) != value:
            raise InvalidInput(name, value, f"{there['sweep'].get(name)!r}, as in {path}")
    if there["provenance"]["kernels"] != KERNELS:
        allowed = f"{there['provenance']['kernels']!r}, with which {path} was begun"
        raise InvalidInput("kernels", KERNELS, allowed)


def _checksum(path: Path) -> str:
    """SHA-256 of a file, empty if there is none."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except FileNotFoundError:
        return ""


def _text(record: dict[str, Any]) -> str:
    return json.dumps(record, ensure_ascii=False, indent=1) + "\n"


def _sealed(record: dict[str, Any]) -> str:
    seal = hashlib.sha256(_text(record).encode()).hexdigest()
    return _text({"sha256": seal, **record})


def _unsealed(path: Path) -> dict[str, Any] | None:
    """The record in a file, None if it is damaged."""
    try:
        record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        seal = record.pop("sha256")
    except (ValueError, KeyError, AttributeError):
        return None
    return record if seal == hashlib.sha256(_text(record).encode()).hexdigest() else None
