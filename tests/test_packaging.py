"""Contents of an installation, cost of imports, and allowed imports."""

import ast
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import zipfile
from importlib import import_module
from pathlib import Path

import pytest

import capsule_sym
from capsule_sym._compile import CORE
from capsule_sym._native import core
from tests.public import MODULES, PUBLIC
from tests.sampling import sampled, some

ROOT = Path(__file__).parent.parent
GENERATED = {path.relative_to(ROOT).as_posix() for path in (ROOT / "generated").rglob("*.*")}


def python(*arguments: str, **options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, check=False, **options
    )


def loaded_after(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(sorted({{name.split('.')[0] for name in sys.modules}}))"
    done = python("-c", code)
    assert done.returncode == 0, done.stderr
    return set(ast.literal_eval(done.stdout))


def test_the_version_is_the_one_in_pyproject() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert capsule_sym.__version__ == project["version"]


def test_importing_the_package_imports_nothing_else() -> None:
    assert "capsule_sym" in loaded_after("import capsule_sym")
    assert loaded_after("import capsule_sym") & {"sympy", "scipy", "mpmath", "numpy"} == set()


def test_an_import_beside_numpy_loads_little() -> None:
    # Modules are counted, not seconds, which are the machine's. Most are of the standard library.
    code = """
import numpy, sys
before = set(sys.modules)
from capsule_sym import Parameters, simulate
simulate(Parameters())
print(sorted(set(sys.modules) - before))
"""
    loaded = ast.literal_eval(python("-c", code).stdout)
    assert len(loaded) <= 40
    others = {"click", "dask", "matplotlib", "rich", "scipy", "sympy", "xarray", "zarr"}
    others |= {"html", "http", "json"}
    assert {name.partition(".")[0] for name in loaded} & others == set()


def test_parameters_need_no_library() -> None:
    loaded = loaded_after("from capsule_sym import Parameters; Parameters()")
    assert not loaded & {"sympy", "scipy", "mpmath", "numpy"}


def test_sympy_stays_unimported_by_the_map() -> None:
    assert "sympy" not in loaded_after(
        "from capsule_sym import simulate, results; results.Trajectory"
    )


@sampled
@pytest.mark.parametrize(
    ("absent", "line", "extra"),
    some(
        [
            ("sympy", "verify", "symbolic"),
            ("flint", "run --certify proof.json", "symbolic"),
            ("matplotlib", "figure . --out motion.svg", "plot"),
            ("zarr", "sweep --alpha 0.1:2:3 --out s", "sweep"),
        ],
        2,
    ),
)
def test_without_an_optional_library_one_line_says_what_brings_it(
    absent, line, extra, tmp_path
) -> None:
    code = (
        f"import sys; sys.modules['{absent}'] = None; from capsule_sym.__main__ import main; main()"
    )
    done = python("-c", code, *line.split(), cwd=str(tmp_path))
    assert (done.returncode, done.stdout) == (1, "")
    told = f"error: {absent} is missing: python -m pip install '.[{extra}]' in the checkout\n"
    assert done.stderr == told


def test_runs_orbits_and_branches_need_no_scipy() -> None:
    code = """
import sys
sys.modules["scipy"] = None
from capsule_sym import Parameters, continue_orbit, plot, simulate, solve_orbit
assert simulate(Parameters(), periods=20, backend="numpy").segments[0].outcome == "regular"
first = solve_orbit(Parameters(zeta=0.005, alpha=0.03))
branch = continue_orbit(first, "alpha", 0.08)
print(*(one.type for one in branch.bifurcations))
plot(branch)
"""
    done = python("-c", code)
    assert "period doubling" in done.stdout, done.stderr
    assert done.returncode == 0, done.stderr


def test_the_package_is_imported_from_an_archive_too(tmp_path: Path) -> None:
    archive = tmp_path / "one.zip"
    with zipfile.ZipFile(archive, "w") as file:
        for path in (ROOT / "capsule_sym").glob("**/*.py*"):
            file.write(path, path.relative_to(ROOT))
        for path in (ROOT / "generated").glob("**/*.py"):
            file.write(path, "capsule_sym" / path.relative_to(ROOT))
    code = f"""
import sys
sys.meta_path[:] = [one for one in sys.meta_path if isinstance(one, type)]  # no editable package
sys.path.insert(0, {str(archive)!r})
from capsule_sym import Parameters, simulate
import capsule_sym
print(capsule_sym.__file__, simulate(Parameters(), periods=3, backend="numpy").success)
"""
    done = python("-c", code)
    here = str(archive / "capsule_sym" / "__init__.py")
    assert done.stdout.split() == [here, "True"], done.stderr


def test_every_public_name_resolves_and_no_other_does() -> None:
    for module in map(import_module, MODULES):
        assert set(module.__all__) <= set(dir(module))
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = capsule_sym.nonsense


def private_imports(path: Path) -> list[str]:
    """Public names that a file imports from the modules behind them."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("capsule_sym."):
            public = node.module in MODULES
            names = [alias.name for alias in node.names if alias.name in PUBLIC and not public]
            home = import_module(node.module) if names else None
            # A module may have the name of what is in it.
            found += [n for n in names if getattr(home, n, None) is PUBLIC[n]]
    return found


@pytest.mark.parametrize("folder", ["tests", "docs"])
def test_public_names_are_imported_from_the_package_alone(folder: str) -> None:
    used = {str(path): private_imports(path) for path in (ROOT / folder).rglob("*.py")}
    assert used
    assert {path: names for path, names in used.items() if names} == {}


def test_a_private_import_would_be_seen(tmp_path: Path) -> None:
    file = tmp_path / "one.py"
    file.write_text("from capsule_sym._parameters import UNITS, Parameters as P\n")
    assert private_imports(file) == ["Parameters"]


@pytest.mark.parametrize("absent", ["flint", "zarr"])
def test_a_star_gives_what_is_installed(absent: str) -> None:
    code = (
        f"import sys; sys.modules[{absent!r}] = None; from capsule_sym import *; "
        "import capsule_sym; print(simulate, len(dir(capsule_sym)) - len(capsule_sym.__all__))"
    )
    done = python("-c", code)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[-1]) == {"flint": 4, "zarr": 2}[absent]


def built(
    kind: str, directory: Path, source: Path = ROOT, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Builds a wheel or sdist of a checkout in a process of its own, as CMake writes to stdout."""
    code = f"from scikit_build_core.build import build_{kind} as b; b({str(directory)!r})"
    return python("-c", code, cwd=str(source), env=os.environ | environment)


def wheel(directory: Path, source: Path = ROOT, **environment: str) -> Path:
    """A wheel of a checkout, unpacked."""
    done = built("wheel", directory, source, **environment)
    assert done.returncode == 0, done.stdout + done.stderr
    (made,) = directory.glob("*.whl")
    unpacked = directory / "site"
    zipfile.ZipFile(made).extractall(unpacked)
    return unpacked


@pytest.fixture(scope="module")
def no_compiler(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a machine with all that a build takes but a compiler."""
    tools = tmp_path_factory.mktemp("bin")
    for name in ("cmake", "ninja"):
        path = shutil.which(name, path=os.pathsep.join([sys.prefix + "/bin", os.environ["PATH"]]))
        if path is None:
            pytest.skip(f"{name} is not here")
        (tools / name).symlink_to(path)
    return {"PATH": str(tools)}


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory, no_compiler: dict[str, str]) -> Path:
    """A wheel built without a compiler, unpacked."""
    return wheel(tmp_path_factory.mktemp("plain"), **no_compiler)


def installed(unpacked: Path, code: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Runs code against an unpacked wheel; -S leaves out the editable install."""
    path = os.pathsep.join([str(unpacked), sysconfig.get_path("purelib")])
    environment = os.environ | {"PYTHONPATH": path}
    return python(*options, "-S", "-c", code, cwd=str(unpacked.parent), env=environment)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel of this machine, unpacked."""
    return wheel(tmp_path_factory.mktemp("whole"))


BACKEND = "from capsule_sym import Parameters, simulate; r = simulate(Parameters(), periods=1)"


@pytest.mark.long
def test_the_wheel_holds_the_generated_files_and_the_compiled_core(whole: Path) -> None:
    unpacked = whole
    shipped = {path.relative_to(unpacked).as_posix() for path in unpacked.rglob("*.*")}
    assert any(name.endswith(".c") for name in GENERATED)
    assert {f"capsule_sym/{name}" for name in GENERATED if "__pycache__" not in name} <= shipped
    assert "capsule_sym/py.typed" in shipped
    assert {"interface.toml", "kernels.toml"} == {
        Path(name).name for name in shipped if name.startswith("capsule_sym/codegen/inputs/")
    }
    done = installed(unpacked, "import capsule_sym.generated.capsule as g; print(g.__file__)")
    assert done.stdout.startswith(str(unpacked)), done.stderr
    if core is None:
        pytest.skip("no compiler here")
    (module,) = (name for name in shipped if name.startswith("capsule_sym/_native/_binding.abi3."))
    assert module.endswith((".so", ".pyd"))
    assert f"capsule_sym/generated/capsule/{CORE}" in shipped
    done = installed(unpacked, f"{BACKEND}; print(r.backend)", "-W", "error")
    assert done.stdout == "c\n", done.stderr


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler cc here")
def test_a_wheel_declares_and_compiles_a_scene_with_a_compiler_alone(whole, tmp_path) -> None:
    """In an empty folder, without CMake and Cython: a scene of one's own, and one that ships."""
    tools = tmp_path / "bin"
    tools.mkdir()
    for name in ("cc", "as", "ld"):
        (tools / name).symlink_to(shutil.which(name))
    shutil.copy(ROOT / "tests" / "scenes" / "two_stops.py", tmp_path)
    path = os.pathsep.join([str(whole), sysconfig.get_path("purelib")])
    environment = {"PATH": str(tools), "PYTHONPATH": path, "XDG_CACHE_HOME": str(tmp_path)}
    generator = ("-S", "-m", "capsule_sym.codegen", "--scene", "two_stops.py", "--core")
    done = python(*generator, cwd=str(tmp_path), env=environment)
    assert done.returncode == 0, done.stderr
    assert "compiled the C core of two_stops in" in done.stdout
    run = (
        "from capsule_sym import scenes, simulate\n"
        "for scene in (scenes.load('two_stops'), scenes.slope):\n"
        "    print(simulate(scene.Parameters(), periods=5).backend)"
    )
    compiling = "compiling the C core of scene slope, once: about 15 s\n"
    for told in (compiling, ""):
        done = python("-S", "-c", run, cwd=str(tmp_path), env=environment)
        assert (done.stdout, done.stderr) == ("c\nc\n", told)


@pytest.mark.long
def test_without_a_compiler_the_wheel_is_whole_and_says_once_what_runs(plain: Path) -> None:
    assert [path.name for path in plain.rglob("_binding.*")] == ["_binding.pyx"]
    assert not [*plain.rglob(CORE)]
    assert len([*plain.glob("capsule_sym/codegen/inputs/*.toml")]) == 2
    (about,) = plain.glob("*.dist-info")
    assert {path.name for path in plain.iterdir()} == {"capsule_sym", about.name}
    explorer = "capsule_sym/_explorer/page.html"
    assert (plain / explorer).read_bytes() == (ROOT / explorer).read_bytes()
    again = f"{BACKEND}; r = simulate(Parameters(), periods=1); print(r.backend)"
    done = installed(plain, again, "-W", "always")
    assert done.stdout == "numpy\n", done.stderr
    assert done.stderr.count("no compiled core of scene capsule") == 1
    refused = installed(plain, f"{BACKEND[:-1]}, backend='c')")
    assert "backend = 'c': must be numpy or mpmath" in refused.stderr


def test_python_started_in_a_clone_tells_that_it_has_no_core() -> None:
    """The clone is imported, as Python looks there first; -S leaves out the editable install."""
    code = f"{BACKEND}; import capsule_sym; print(capsule_sym.__file__, r.backend)"
    environment = os.environ | {"PYTHONPATH": sysconfig.get_path("purelib")}
    done = python("-S", "-c", code, cwd=str(ROOT), env=environment)
    assert done.stdout.split() == [str(ROOT / "capsule_sym" / "__init__.py"), "numpy"], done.stderr
    assert "no compiled core of scene capsule: " in done.stderr
    assert "to have the core, in a clone run make core, or start Python outside" in done.stderr


@pytest.mark.long
def test_the_version_tells_which_core_is_live(plain: Path) -> None:
    ask = "import sys; from capsule_sym._cli import main; main(['--version'])"
    assert installed(plain, ask).stdout == f"{capsule_sym.__version__} (no C core: NumPy)\n"
    if core is not None:
        lanes = f"{core.lanes()} lane{'s' * (core.lanes() > 1)}"
        expected = f"{capsule_sym.__version__} (C core, {lanes})\n"
        assert python("-c", ask).stdout == expected


@pytest.mark.long
def test_a_core_that_cannot_be_loaded_is_not_taken_for_none(plain: Path) -> None:
    broken = plain / "capsule_sym/_native" / f"_binding{sysconfig.get_config_var('EXT_SUFFIX')}"
    broken.write_bytes(b"not a library")
    try:
        done = installed(plain, "import capsule_sym._native")
    finally:
        broken.unlink()
    assert done.returncode == 1
    assert "ImportError" in done.stderr
    assert str(broken) in done.stderr


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    copy = tmp_path_factory.mktemp("checkout")
    ignored = shutil.ignore_patterns("__pycache__")
    for house in ("capsule_sym", "paper", "benchmarks"):
        shutil.copytree(ROOT / house, copy / house, ignore=ignored)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    return copy


@pytest.mark.long
@pytest.mark.skipif(core is None, reason="no compiler here")
@pytest.mark.parametrize(
    ("environment", "change", "words"),
    [
        ({"CC": "/bin/false"}, None, '"/bin/false"'),
        ({"CC": "/nowhere/cc"}, None, "/nowhere/cc"),
        # Older compilers only warn of it by default.
        ({}, ("tables.c", 'int wrong(void) { return "text"; }'), "wrong"),
    ],
    ids=["fails", "absent", "stops"],
)
def test_a_compiler_that_fails_ends_the_installation_with_its_words(
    checkout, tmp_path, environment, change, words
) -> None:
    source = tmp_path / "source"
    shutil.copytree(checkout, source)
    if change:
        file = source / "capsule_sym" / "_native" / change[0]
        file.write_text(f"{file.read_text()}\n{change[1]}\n")
    done = built("wheel", tmp_path / "wheels", source, **environment)
    assert done.returncode != 0
    assert words in done.stdout + done.stderr
    assert not list(tmp_path.glob("wheels/*.whl"))


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler cc here")
def test_the_binding_passes_pointers_of_their_types(tmp_path: Path) -> None:
    """As compilers ask for by themselves from GCC 14 on."""
    native = ROOT / "capsule_sym" / "_native"
    translated = str(tmp_path / "core.c")
    done = python("-m", "cython", "-3", str(native / "_binding.pyx"), "-o", translated)
    assert done.returncode == 0, done.stderr
    strict = ("incompatible-pointer-types", "int-conversion", "implicit-function-declaration")
    folders = (native, sysconfig.get_path("include"))
    command = ["cc", "-fsyntax-only", *(f"-Werror={name}" for name in strict)]
    done = subprocess.run(
        [*command, *(f"-I{folder}" for folder in folders), translated],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.long
def test_a_source_distribution_holds_what_is_generated_once(tmp_path, no_compiler) -> None:
    done = built("sdist", tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    (made,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(made) as archive:
        archive.extractall(tmp_path, filter="tar")
    (source,) = (path.parent for path in tmp_path.glob("*/pyproject.toml"))
    package = source / "capsule_sym" / "generated"
    assert package.is_symlink()
    assert {path.name for path in source.iterdir() if path.is_dir()} == {
        *("capsule_sym", "codegen", "generated")
    }
    # Output of `make generate` reaches the package, and a wheel that is built from here.
    written = source / "generated" / "capsule" / "__init__.py"
    written.write_text(f"{written.read_text()}\nNEW = 1\n")
    assert "NEW = 1" in (package / "capsule" / "__init__.py").read_text()
    unpacked = wheel(tmp_path / "wheels", source, **no_compiler)
    assert {f"capsule_sym/{name}" for name in GENERATED if "__pycache__" not in name} <= {
        path.relative_to(unpacked).as_posix() for path in unpacked.rglob("*.*")
    }
    assert "NEW = 1" in (unpacked / "capsule_sym/generated/capsule/__init__.py").read_text()


def contracts(checkout: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(checkout), sysconfig.get_path("purelib")])
    code = "from importlinter.cli import lint_imports_command as run; run(['--no-cache'])"
    return python("-S", "-c", code, cwd=str(checkout), env=os.environ | {"PYTHONPATH": path})


def test_the_picture_of_the_packages_is_that_of_the_contract() -> None:
    """Every package stands in it once, and none before one that it may import."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    (layers,) = (one["layers"] for one in contracts if one["id"] == "layers")
    levels = [set(re.findall(r"\w+", layer)) for layer in reversed(layers)]
    text = (ROOT / "docs/design.md").read_text(encoding="utf-8")
    picture = text.rpartition("```text")[2].partition("```")[0]
    written = re.findall(r"^(?:capsule_sym/(\w+)|generated/)", picture, re.M)
    names = [name or "generated" for name in written]
    assert sorted(names) == sorted(set().union(*levels))
    level = {name: number for number, names in enumerate(levels) for name in names}
    # The generator is drawn on the derivation's side of the line, beside the map in the contract,
    # and what it writes below the line, in the contract at the bottom: all may read its tables.
    level["codegen"] = level["generated"] = level["_symbolic"]
    assert [level[name] for name in names] == sorted(level[name] for name in names)


def test_the_import_contracts_hold(checkout: Path) -> None:
    done = contracts(checkout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 broken" in done.stdout


@sampled
@pytest.mark.parametrize(
    ("module", "statement", "broken"),
    some(
        [
            ("_map/__init__.py", "import sympy", "SymPy stays on the side of the derivation"),
            ("generated/__init__.py", "import sympy", "SymPy stays on the side of the derivation"),
            ("_parameters.py", "from sympy import pi", "SymPy stays on the side of the derivation"),
            (
                "_map/__init__.py",
                "import capsule_sym._symbolic.model.model",
                "the derivation is reached",
            ),
            ("_parameters.py", "import capsule_sym.codegen", "the derivation is reached"),
            ("_errors.py", "import capsule_sym._parameters", "imports run one way"),
            ("_map/segments.py", "import capsule_sym._map.trajectory", "no circle of modules"),
            ("_symbolic/model/model.py", "import capsule_sym._map", "imports run one way"),
            (
                "_symbolic/model/model.py",
                "import capsule_sym.generated.capsule",
                "the theory imports no",
            ),
            ("generated/capsule/__init__.py", "import capsule_sym._map", "imports run one way"),
            (
                "codegen/__init__.py",
                "import capsule_sym.generated.capsule",
                "by files, never by an import",
            ),
        ],
        5,
    ),
)
def test_a_forbidden_import_breaks_its_contract(checkout, module, statement, broken) -> None:
    file = checkout / "capsule_sym" / module
    text = file.read_text(encoding="utf-8")
    # Inside a function, where it would also escape a test that only imports the package.
    file.write_text(f"{text}\n\ndef smuggle():\n    {statement}\n", encoding="utf-8")
    try:
        done = contracts(checkout)
    finally:
        file.write_text(text, encoding="utf-8")
    assert done.returncode == 1
    failed = [line for line in done.stdout.splitlines() if " BROKEN" in line]
    assert any(broken in line for line in failed), done.stdout + done.stderr
