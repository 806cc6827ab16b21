"""Stores of which files are damaged: a chunk is computed again, or one line gives the reason."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from capsule_sym import InvalidInput, Parameters, run_basin, run_sweep
from capsule_sym._cli import main
from capsule_sym._sweeps.results import FORMAT, info_record
from capsule_sym.inputs import Axis, Sweep
from capsule_sym.results import open_results
from tests.sweeps import chart, contents

SMALL = chart(4, 3, periods=5, compute=("itinerary",), chunk=(2, 3))
STARTS = (Axis.of("x_r", [-0.5, 0.5]), Axis.of("v_r", [0.0, 1.0, 2.0]))


def run_small(path: Path, **how: Any) -> int:
    return run_sweep(SMALL, path, workers=1, **how).damaged


def run_small_basin(path: Path, **how: Any) -> int:
    sweep = Sweep(STARTS, Parameters(alpha=1.2), periods=100, chunk=(1, 3))
    return run_basin(sweep, path, workers=1, **how)[0].damaged


KINDS: dict[str, Callable[..., int]] = {"sweep": run_small, "basin": run_small_basin}


@pytest.fixture(scope="module")
def stores(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Finished stores by kind, which no test may change."""
    made: dict[str, Path] = {}

    def store(kind: str) -> Path:
        if kind not in made:
            made[kind] = tmp_path_factory.mktemp(kind) / "store"
            KINDS[kind](made[kind])
        return made[kind]

    return store


def copied(whole: Path, path: Path) -> Path:
    """A copy of a store."""
    shutil.copytree(whole, path)
    return path


def delete(path: Path) -> None:
    path.unlink()


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-3])


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 255
    path.write_bytes(data)


@pytest.mark.parametrize("damage", [delete, truncate, flip])
def test_a_damaged_chunk_is_not_shown_and_computed_again(damage, stores, tmp_path, capsys) -> None:
    for name in ("itinerary", "outcome", "period_number"):
        path = copied(stores("sweep"), tmp_path / name)
        damage(path / "results.zarr" / name / "c" / "1" / "0")
        if name == "itinerary":
            with pytest.raises(SystemExit) as stopped:
                main(["figure", str(path), "--out", str(tmp_path / "a.svg")])
            assert stopped.value.code == 2
            assert capsys.readouterr().err.count("\n") == 1
        assert run_small(path, resume=True) == 1
        assert contents(path) == contents(stores("sweep"))


@pytest.mark.parametrize(
    ("kind", "name"),
    [("sweep", "outcome"), ("sweep", "period_number"), ("basin", "final"), ("basin", "attractor")],
)
def test_a_file_that_is_lost_is_named(kind: str, name: str, stores, tmp_path) -> None:
    path = copied(stores(kind), tmp_path / "store")
    files = [one for one in (path / "results.zarr" / name / "c").rglob("*") if one.is_file()]
    sorted(files)[1].unlink()
    for read in (open_results, info_record):
        with pytest.raises(InvalidInput, match=f"chunk 1 of {name} is missing"):
            read(path)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("damage", [delete, truncate, flip])
def test_other_damage_raises_nothing_else(damage, kind, stores, tmp_path) -> None:
    files = [one for one in contents(stores(kind)) if "/c/" not in one and one != "lock"]
    assert len(files) > 5
    for k, file in enumerate(files):
        path = copied(stores(kind), tmp_path / str(k))
        damage(path / file)
        for read in (open_results, info_record, lambda one: KINDS[kind](one, resume=True)):
            with suppress(InvalidInput):
                read(path)


def test_a_store_of_another_version_says_so(stores, tmp_path) -> None:
    path = copied(stores("sweep"), tmp_path / "store")
    head = json.loads((path / "sweep.json").read_text())
    (path / "sweep.json").write_text(json.dumps(head | {"format": FORMAT - 1}))
    for read in (open_results, lambda one: run_small(one, resume=True)):
        with pytest.raises(InvalidInput, match="another version, so compute it again"):
            read(path)


OWN = f'{{"format": {FORMAT}}}'


@pytest.mark.parametrize("text", ["{}", "[]", "3", "x", OWN, '{"format": 2}'])
def test_another_file_is_no_store(text: str, stores, tmp_path) -> None:
    path = copied(stores("sweep"), tmp_path / "store")
    head = json.loads((path / "sweep.json").read_text())
    for changed in (text, *(json.dumps(head | {one: 3}) for one in head if one != "format")):
        (path / "sweep.json").write_text(changed)
        with pytest.raises(InvalidInput, match=r"^store = "):
            open_results(path)
    for changed in (text, '{"outcomes": 3}'):
        shutil.copy(stores("sweep") / "sweep.json", path)
        (path / "chunks/000000/000000000.json").write_text(changed)
        with pytest.raises(InvalidInput, match=r"^store = "):
            info_record(path)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.filterwarnings("error")
def test_xarray_opens_a_finished_store(kind: str, stores: Callable[[str], Path]) -> None:
    with (
        xr.open_zarr(stores(kind) / "results.zarr", chunks=None) as plain,
        open_results(stores(kind)) as ours,
    ):
        assert plain.load().identical(ours.load())


def test_a_sweep_does_not_go_on_with_a_basin(stores: Callable[[str], Path], tmp_path: Path) -> None:
    path = copied(stores("basin"), tmp_path / "store")
    compute = ("itinerary", "progression", "final")
    sweep = Sweep(STARTS, Parameters(alpha=1.2), periods=100, chunk=(1, 3), compute=compute)
    with pytest.raises(InvalidInput, match="kind = 'sweep': must be 'basin'"):
        run_sweep(sweep, path, resume=True)


def test_another_sweep_is_told_in_a_short_line(stores, tmp_path) -> None:
    path = copied(stores("sweep"), tmp_path / "s")
    many = [Axis.linear(name, 0.5, 0.7, 3) for name in ("alpha", "omega", "zeta", "beta", "f_b")]
    others = {
        "^axes = .5 values of alpha from 0.01 to 2.: must be .4 values": replace(
            SMALL, axes=(Axis.linear("alpha", 0.01, 2.0, 5), SMALL.axes[1])
        ),
        "^axes = .3 values of alpha .*; 3 values of omega .*": Sweep((*many,), periods=5),
        r"^parameters = {'zeta': 0.0123456789}: must be {'zeta': 0.05}, as": replace(
            SMALL, parameters=Parameters(zeta=0.0123456789)
        ),
        "^periods = 6": chart(4, 3, periods=6),
    }
    for said, other in others.items():
        with pytest.raises(InvalidInput, match=said) as refused:
            run_sweep(other, path, resume=True)
        assert len(str(refused.value).replace(str(path), "s")) < 200
        assert "did you mean" not in str(refused.value)
