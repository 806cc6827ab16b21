"""What an installation holds, what an import costs, and who may import whom."""

import ast
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest

import capsule_sym
from capsule_sym._native import core

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


def test_an_import_beside_numpy_takes_less_than_150_ms() -> None:
    # Processor time: what other programs do meanwhile is not the package's.
    code = """
import numpy, time
began = time.process_time()
import capsule_sym
from capsule_sym import Parameters, simulate
print(time.process_time() - began)
"""
    assert float(python("-c", code).stdout) < 0.15


def test_parameters_need_numpy_alone() -> None:
    loaded = loaded_after("from capsule_sym import Parameters; Parameters()")
    assert loaded & {"sympy", "scipy", "mpmath", "numpy"} == {"numpy"}


def test_sympy_stays_unimported_by_the_map() -> None:
    assert "sympy" not in loaded_after("from capsule_sym import simulate, Trajectory")


def test_every_public_name_resolves_and_no_other_does() -> None:
    for name in capsule_sym.__all__:
        assert getattr(capsule_sym, name).__class__
        assert name in dir(capsule_sym)
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = capsule_sym.nonsense


def wheel(directory: Path, **environment: str) -> Path:
    """A wheel of this checkout, unpacked; in a process of its own, as CMake writes to stdout."""
    code = f"from scikit_build_core.build import build_wheel; build_wheel({str(directory)!r})"
    done = python("-c", code, cwd=str(ROOT), env=os.environ | environment)
    assert done.returncode == 0, done.stdout + done.stderr
    (built,) = directory.glob("*.whl")
    unpacked = directory / "site"
    zipfile.ZipFile(built).extractall(unpacked)
    return unpacked


def installed(unpacked: Path, code: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Runs code against an unpacked wheel; -S leaves out the editable install."""
    path = os.pathsep.join([str(unpacked), sysconfig.get_path("purelib")])
    environment = os.environ | {"PYTHONPATH": path}
    return python(*options, "-S", "-c", code, cwd=str(unpacked.parent), env=environment)


BACKEND = "from capsule_sym import Parameters, simulate; r = simulate(Parameters(), periods=1)"


def test_the_wheel_holds_the_generated_files_and_the_compiled_core(tmp_path: Path) -> None:
    unpacked = wheel(tmp_path)
    shipped = {path.relative_to(unpacked).as_posix() for path in unpacked.rglob("*.*")}
    assert any(name.endswith(".c") for name in GENERATED)
    assert {f"capsule_sym/{name}" for name in GENERATED if "__pycache__" not in name} <= shipped
    assert "capsule_sym/py.typed" in shipped
    done = installed(unpacked, "import capsule_sym.generated.py as g; print(g.__file__)")
    assert done.stdout.startswith(str(unpacked)), done.stderr
    if core is None:
        pytest.skip("no compiler here")
    assert f"capsule_sym/_native/_core{sysconfig.get_config_var('EXT_SUFFIX')}" in shipped
    done = installed(unpacked, f"{BACKEND}; print(r.backend)", "-W", "error")
    assert done.stdout == "c\n", done.stderr


def test_without_a_compiler_the_wheel_is_pure_and_says_once_what_runs(tmp_path: Path) -> None:
    unpacked = wheel(tmp_path, CC="/bin/false")
    assert [path.name for path in unpacked.glob("capsule_sym/_native/_core.*")] == ["_core.pyx"]
    (tags,) = unpacked.glob("*.dist-info/WHEEL")
    assert "Tag: py3-none-any" in tags.read_text()
    again = f"{BACKEND}; r = simulate(Parameters(), periods=1); print(r.backend)"
    done = installed(unpacked, again, "-W", "always")
    assert done.stdout == "numpy\n", done.stderr
    assert done.stderr.count("installed without a compiler") == 1
    refused = installed(unpacked, f"{BACKEND[:-1]}, backend='c')")
    assert "backend = 'c': must be numpy or mpmath" in refused.stderr


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    copy = tmp_path_factory.mktemp("checkout")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "capsule_sym", copy / "capsule_sym", ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", copy)
    return copy


def contracts(checkout: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(checkout), sysconfig.get_path("purelib")])
    code = "from importlinter.cli import lint_imports_command as run; run(['--no-cache'])"
    return python("-S", "-c", code, cwd=str(checkout), env=os.environ | {"PYTHONPATH": path})


def test_the_import_contracts_hold(checkout: Path) -> None:
    done = contracts(checkout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 broken" in done.stdout


@pytest.mark.parametrize(
    ("module", "statement", "broken"),
    [
        ("map/__init__.py", "import sympy", "SymPy stays on the side of the derivation"),
        ("generated/__init__.py", "import sympy", "SymPy stays on the side of the derivation"),
        ("parameters.py", "from sympy import pi", "SymPy stays on the side of the derivation"),
        ("map/__init__.py", "import capsule_sym.symbolic.model", "the derivation is reached"),
        ("parameters.py", "import capsule_sym.codegen", "the derivation is reached"),
        ("errors.py", "import capsule_sym.parameters", "imports run one way"),
        ("symbolic/model.py", "import capsule_sym.map", "imports run one way"),
        ("symbolic/model.py", "import capsule_sym.generated.py", "imports run one way"),
        ("generated/py/__init__.py", "import capsule_sym.map", "imports run one way"),
        ("codegen/__init__.py", "import capsule_sym.generated.py", "by files, never by an import"),
    ],
)
def test_a_forbidden_import_breaks_its_contract(
    checkout: Path, module: str, statement: str, broken: str
) -> None:
    file = checkout / "capsule_sym" / module
    text = file.read_text(encoding="utf-8")
    # Inside a function, where it would also escape a test that only imports the package.
    file.write_text(f"{text}\n\ndef smuggle():\n    {statement}\n", encoding="utf-8")
    try:
        done = contracts(checkout)
    finally:
        file.write_text(text, encoding="utf-8")
    assert done.returncode == 1
    failed = [line for line in done.stdout.splitlines() if line.endswith("BROKEN")]
    assert any(broken in line for line in failed), done.stdout + done.stderr
