"""Files of others: no file runs code, and folders of scenes are checked before theirs runs."""

from __future__ import annotations

import importlib.util
import json
import os
import pickle
import shutil
import sys
from collections.abc import Callable
from importlib.machinery import SourceFileLoader
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from capsule_sym import InvalidInput, _parameters, load_parameters, run_sweep, scenes, simulate
from capsule_sym._compile import CORE
from capsule_sym._folders import digest_of
from capsule_sym.figures import plot_diagram
from capsule_sym.inputs import Axis, Sweep, read_plan
from capsule_sym.results import open_results, orbit_from_record, read_branch

Command = Callable[..., CompletedProcess[str]]
Edit = Callable[[Path], object]

SLOPE = Path(str(scenes.slope.facts.__file__)).parent
ITSELF = {
    **{"parameters": {"omega": 1}, "itinerary": ["F1"], "period_number": 1, "phase": 0, "value": 1},
    **{"state": [0, 0, 0], "durations": [1]},
}
MARK = "planted"
PLANTED = f"import pathlib\n(pathlib.Path(__file__).parents[1] / {MARK!r}).touch()\n"
HIDDEN = shutil.ignore_patterns("__pycache__")


def of_slope(folder: Path) -> Path:
    """A copy of a scene."""
    shutil.copytree(SLOPE, folder, ignore=HIDDEN)
    return folder


def sealed_anew(folder: Path) -> None:
    """A manifest for the files that are in a folder."""
    path = folder / "manifest.json"
    manifest = json.loads(path.read_bytes())
    manifest["files"] = {
        file.relative_to(folder).as_posix(): digest_of(file.read_bytes())
        for file in folder.rglob("*")
        if file.is_file() and file != path
    }
    path.write_text(json.dumps(manifest), encoding="utf-8")


@pytest.fixture
def planted(tmp_path: Path) -> Path:
    """A folder beside which all of its code leaves a mark, and files of all kinds that name it."""
    folder = of_slope(tmp_path / "evil")
    for file in folder.glob("*.py"):
        file.write_text(f"{PLANTED}{file.read_text('utf-8')}", encoding="utf-8")
    sealed_anew(folder)
    named = str(folder)
    (tmp_path / "p.toml").write_text('scene = "evil"\nalpha = 0.5\n', encoding="utf-8")
    (tmp_path / "plan.toml").write_text('scene = "./evil/"\n[axes]\nalpha = [0.5]\n', "utf-8")
    (tmp_path / "link").symlink_to(folder)
    (tmp_path / "up").mkdir()
    (tmp_path / "up" / "up.toml").write_text('scene = "../evil"\n', encoding="utf-8")
    (tmp_path / "linked.toml").write_text('scene = "link"\n', encoding="utf-8")
    branch = {"format": 4, "scene": named, "parameter": "alpha", "ties": {}, "switched": []}
    branch |= {
        "bifurcations": [],
        "points": 2 * [{**ITSELF, "scene": named, "stable": True}],
        "origin": "",
        **ITSELF,
    }
    (tmp_path / "b.json").write_text(json.dumps(branch), encoding="utf-8")
    store = tmp_path / "store"
    run_sweep(Sweep((Axis.of("alpha", [0.5, 0.6]),), periods=2), store, workers=1)
    metadata = store / "results.zarr" / "zarr.json"
    group = json.loads(metadata.read_bytes())
    group["attributes"]["scene"] = named
    metadata.write_text(json.dumps(group), encoding="utf-8")
    head = json.loads((store / "sweep.json").read_bytes())
    head["sweep"]["scene"] = named
    (store / "sweep.json").write_text(json.dumps(head), encoding="utf-8")
    return tmp_path


LINES = [
    *("run --params p.toml", "run --params up/up.toml", "run --params linked.toml"),
    *("branch --params p.toml --alpha 1:2", "fit a.csv --params p.toml --unknown alpha"),
    *("sweep plan.toml --out new", "sweep plan.toml --out store --resume"),
    *("branch --restart b.json EP2 --to 1", "figure b.json --out a.svg"),
    "figure store --of work --out a.svg",
]


def test_no_file_runs_code_of_a_folder_that_it_names(planted: Path, inside: Command) -> None:
    for line in LINES:
        done = inside(*line.split(), cwd=planted)
        assert (done.returncode, done.stdout) == (2, ""), line
        assert "evil" in done.stderr or "link" in done.stderr
        assert "so name it yourself: --scene FOLDER, or scenes.load in Python\n" in done.stderr
        assert done.stderr.count("\n") == 1
        helped = inside(*line.split(), "--help", cwd=planted)
        assert helped.returncode == 0
        assert "Usage: capsule-sym" in helped.stdout
    for line in ("sweep --info store", "figure store --out a.svg"):
        assert inside(*line.split(), cwd=planted).returncode != 1
    record = read_branch(planted / "b.json")
    open_results(planted / "store").load()
    for act in (
        lambda: load_parameters(planted / "p.toml"),
        lambda: read_plan(planted / "plan.toml"),
        lambda: plot_diagram([record]),
        lambda: orbit_from_record(record),
    ):
        with pytest.raises(InvalidInput, match="name it yourself"):
            act()
    assert not (planted / MARK).exists()
    # Named by the user, it is loaded, and the files that name it are read.
    assert inside("run", "--params", "p.toml", "--scene", "link", cwd=planted).returncode != 2
    assert (planted / MARK).exists()
    own = read_plan(planted / "plan.toml").parameters.scene
    assert own is load_parameters(planted / "p.toml").scene is scenes.load(str(planted / "evil"))
    refused = inside("run", "--params", "p.toml", "--scene", "slope", cwd=planted)
    assert "--scene = 'slope': must be slope in" in refused.stderr


def test_a_pickle_loads_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = scenes.load(str(of_slope(tmp_path / "own")))
    for kept in (own, own.Parameters(s=0.1), simulate(own.Parameters(s=0.1), periods=2)):
        data = pickle.dumps(kept)
        assert repr(pickle.loads(data)) == repr(kept)
        with monkeypatch.context() as patched:
            patched.setattr(_parameters, "_known", {})
            with pytest.raises(InvalidInput, match="name it yourself"):
                pickle.loads(data)


def edited(name: str, edit: Callable[[str], str]) -> Edit:
    """Edit of a text file in a folder."""

    def change(folder: Path) -> None:
        path = folder / name
        path.write_text(edit(path.read_text("utf-8")), encoding="utf-8")

    return change


def entry(**entries: Any) -> Edit:
    """Edit of entries in the manifest."""
    return edited("manifest.json", lambda text: json.dumps(json.loads(text) | entries))


def linked(folder: Path, name: str) -> None:
    """A file or a folder moved out, and a link in its place."""
    (folder / name).rename(folder.parent / "moved")
    (folder / name).symlink_to(folder.parent / "moved")


def emptied(folder: Path) -> None:
    shutil.rmtree(folder)
    folder.mkdir()


AGAIN = "write it again: python -m capsule_sym.codegen --scene FILE --out FOLDER"
BROKEN: dict[str, tuple[Edit, str]] = {
    "empty": (emptied, "it has no manifest.json; " + AGAIN),
    "partial": (lambda f: (f / "kernels.py").unlink(), "kernels.py is missing; " + AGAIN),
    "without C": (lambda f: shutil.rmtree(f / "c"), "is missing"),
    "without a manifest": (lambda f: (f / "manifest.json").unlink(), "no manifest.json"),
    "older": (entry(generator="0123"), "another version of the generator wrote it; " + AGAIN),
    "of another format": (entry(format=2), "another version of the generator"),
    "before formats": (
        edited("manifest.json", lambda t: t.replace('"format"', '"x"')),
        "its manifest.json is damaged; " + AGAIN,
    ),
    "mixed": (
        lambda f: shutil.copy(SLOPE.parent / "prototype" / "switching.py", f),
        "switching.py was changed; " + AGAIN,
    ),
    "edited": (edited("facts.py", lambda t: PLANTED + t), "facts.py was changed"),
    "truncated": (edited("kernels.py", lambda t: t[:500]), "kernels.py was changed"),
    "garbage": (lambda f: (f / "facts.py").write_bytes(bytes(range(256))), "facts.py was changed"),
    "further file": (lambda f: (f / "os.py").write_text(PLANTED), "os.py is not of it: remove"),
    "further folder": (
        lambda f: (f / "facts").mkdir() or (f / "facts" / "__init__.py").write_text(PLANTED),
        "facts/__init__.py is not of it: remove that",
    ),
    "further core": (lambda f: (f / CORE).touch(), f"{CORE} is not of it"),
    "linked file": (lambda f: linked(f, "facts.py"), "facts.py is a link"),
    "linked folder": (lambda f: linked(f, "c"), "c is not of it"),
    "linked manifest": (lambda f: linked(f, "manifest.json"), "its manifest.json is damaged"),
    "manifest no JSON": (edited("manifest.json", lambda t: t[:99]), "manifest.json is damaged"),
    "manifest a list": (edited("manifest.json", lambda _: "[]"), "manifest.json is damaged"),
    "files a list": (entry(files=[]), "manifest.json is damaged"),
    "files empty": (entry(files={}), "__init__.py was changed"),
    "nested manifest": (edited("manifest.json", lambda _: "[" * 3000), "manifest.json is damaged"),
    "manifest a folder": (
        lambda f: (f / "manifest.json").unlink() or (f / "manifest.json").mkdir(),
        "manifest.json is damaged",
    ),
    "core of another version": (
        entry(core={CORE: ""}, core_sources="0"),
        "another version compiled its core; " + AGAIN + " --core",
    ),
    "file a folder": (
        lambda f: (f / "facts.py").unlink() or (f / "facts.py").mkdir(),
        "facts.py is missing",
    ),
    "outside": (entry(files={"../p.py": "0"}), "../p.py is missing"),
}


def test_a_folder_that_is_not_whole_is_refused_in_one_line_before_it_runs(tmp_path: Path) -> None:
    for i, (edit, said) in enumerate(BROKEN.values()):
        folder = of_slope(tmp_path / str(i) / "scene")
        edit(folder)
        with pytest.raises(InvalidInput) as refused:
            scenes.load(str(folder))
        text = str(refused.value)
        assert text.startswith(f"scene = '{folder}': must be a whole scene, but ")
        assert said in text
        assert "\n" not in text
        assert not (tmp_path / str(i) / MARK).exists()
    for path in ("none", "file", "nul\0"):
        (tmp_path / "file").touch()
        with pytest.raises(InvalidInput, match=r"must be capsule, slope, .*, or a folder that"):
            scenes.load(path if "\0" in path else str(tmp_path / path))


def test_bytecode_beside_the_sources_does_not_run(tmp_path: Path) -> None:
    folder = of_slope(tmp_path / "scene")
    for name in ("__init__", "facts"):
        source = folder / f"{name}.py"
        stat = source.stat()
        code = compile(PLANTED + source.read_text("utf-8"), str(source), "exec")
        bytecode = importlib._bootstrap_external._code_to_timestamp_pyc(  # type: ignore[attr-defined]
            code, int(stat.st_mtime), stat.st_size
        )
        path = Path(importlib.util.cache_from_source(str(source)))
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(bytecode)
    loader = SourceFileLoader("_facts", str(folder / "facts.py"))
    exec(loader.get_code("_facts"), {"__file__": str(folder / "facts.py")})
    assert (tmp_path / MARK).exists()  # it would run
    (tmp_path / MARK).unlink()
    own = scenes.load(str(folder))
    assert own.Parameters(s=0.1).s == 0.1
    assert not (tmp_path / MARK).exists()
    assert {path.name for path in (folder / "__pycache__").iterdir()} == {
        Path(importlib.util.cache_from_source(f"{name}.py")).name for name in ("__init__", "facts")
    }
    # Modules that are imported later are those that were checked.
    (folder / "switching.py").write_text(PLANTED)
    assert own.switching.IMPACT_PLANES == scenes.slope.switching.IMPACT_PLANES
    assert sys.modules[own.package].__file__ == str(folder / "__init__.py")
    assert not os.path.exists(tmp_path / MARK)
