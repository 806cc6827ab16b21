"""The command line as a process: imports, bad input, interrupts, and streams."""

import ast
import json
import os
import re
import subprocess
import sys
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import pytest

import capsule_sym
from capsule_sym._cli import group
from tests.sampling import sampled, some


@sampled
@pytest.mark.parametrize("arguments", some(["run --omega 0", "run --params ."], 1))
def test_bad_input_ends_a_process_without_a_traceback(command, tmp_path, arguments) -> None:
    done = command(*arguments.split(), cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith("error: ")


def modules_after(*arguments: str) -> set[str]:
    code = (
        "import sys\nfrom capsule_sym._cli import main\ntry:\n    main(sys.argv[1:])\n"
        "finally:\n    print(sorted(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
    )
    return {name.split(".")[0] for name in ast.literal_eval(done.stderr.splitlines()[-1])}


def test_help_imports_nothing_that_computes() -> None:
    code = (
        "import sys\n"
        "before = set(sys.modules)\n"
        "from capsule_sym._cli import group, main\n"
        "for name in ('', *group.commands):\n"
        "    try:\n        main([*name.split(), '--help'])\n"
        "    except SystemExit as done:\n        assert done.code == 0, name\n"
        "    heavy = {'http', 'sympy', 'numpy', 'scipy', 'mpmath', 'rich'} & set(sys.modules)\n"
        "    assert not heavy, (name, heavy)\n"
        "    assert name or 'pathlib' not in set(sys.modules) - before"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("Usage: capsule-sym") == 1 + len(group.commands)


def test_every_command_takes_json(inside) -> None:
    assert not [name for name in group.commands if "--json" not in inside(name, "--help").stdout]


def test_json_says_what_was_written(inside, tmp_path: Path) -> None:
    lines = (("explore --out b.html", {}, ["b.html"]),)
    for line, told, names in lines:
        done = inside(*line.split(), "--json", cwd=tmp_path)
        assert done.returncode == 0
        record = json.loads(done.stdout)
        files = record.pop("files")
        assert record == told
        assert files == [{"path": n, "bytes": (tmp_path / n).stat().st_size} for n in names]
        assert not [line for line in done.stderr.splitlines() if line.startswith("wrote")]


@pytest.mark.parametrize(
    ("backend", "unwanted"), [("numpy", {"sympy"}), ("mpmath", {"sympy", "scipy"})]
)
def test_run_imports_what_its_backend_needs(backend: str, unwanted: set[str]) -> None:
    loaded = modules_after("run", "--periods", "1", "--backend", backend)
    assert "numpy" in loaded
    assert loaded & unwanted == set()


def test_help_and_version_succeed(command, inside) -> None:
    overview = inside("--help")
    assert overview.returncode == 0
    for name in ("run", "verify"):
        assert f"\n  {name} " in overview.stdout
        assert inside(name, "--help").returncode == 0
    assert re.fullmatch(
        re.escape(version("capsule-sym"))
        + r" \((C core, (8 lanes|4 lanes|1 lane)|no C core: NumPy)\)\n",
        command("--version").stdout,
    )
    alone = command()
    assert (alone.returncode, alone.stdout, alone.stderr) == (0, overview.stdout, "")


IMPORTED = ["capsule_sym._cli", "click", "capsule_sym._map", "numpy.random"]


@pytest.mark.parametrize(
    "name", ["numpy", *(pytest.param(name, marks=pytest.mark.long) for name in IMPORTED)]
)
def test_an_interrupt_while_python_imports_is_one_line(name: str) -> None:
    code = (
        "import os, runpy, signal, sys\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {name!r}:\n"
        "            try:  # as the first lines of modules that Cython compiled do\n"
        "                os.kill(os.getpid(), signal.SIGINT)\n"
        "                sys.version_info >= (3, 11)\n"
        "            except KeyboardInterrupt:\n"
        "                pass\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "sys.argv = ['capsule-sym', 'orbit', '--starts', '100000', '--max-seconds', '60']\n"
        "runpy.run_module('capsule_sym', run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr.startswith("error: interrupted")
    assert done.stderr.count("\n") == 1


def test_little_is_imported_before_an_interrupt_is_one_line() -> None:
    code = (
        "import _signal, sys\n"
        f"sys.path.insert(0, {str(Path(capsule_sym.__file__).parents[1])!r})\n"
        "before = {*sys.modules, *sys.builtin_module_names, '__future__'}\n"
        "import capsule_sym.__main__\n"
        "print(*sorted({*sys.modules} - before))\n"
        "_signal.raise_signal(_signal.SIGINT)"
    )
    # Without the packages of the site, some of which import more themselves.
    done = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True)
    assert done.stdout == "capsule_sym capsule_sym.__main__\n"
    assert (done.returncode, done.stderr) == (130, "error: interrupted\n")


@pytest.mark.parametrize(("end", "status"), [("sys.exit(0)", 0), ("raise KeyboardInterrupt", 130)])
def test_an_interrupt_after_the_result_changes_nothing(end: str, status: int) -> None:
    code = (
        "import atexit, os, runpy, signal, sys\n"
        "from capsule_sym import _cli\n"
        "def done():\n"
        f"    {end}\n"
        "_cli.main = done\n"
        "atexit.register(lambda: print(os.kill(os.getpid(), signal.SIGINT)))\n"
        "runpy.run_module('capsule_sym', run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    told = "error: interrupted\n" if status else ""
    assert (done.returncode, done.stdout, done.stderr) == (status, "None\n", told)


@pytest.mark.parametrize("cut_off", ["_cli._ended", "_cli.main"])
def test_an_interrupt_of_text_that_a_library_executes_exits(cut_off: str, tmp_path: Path) -> None:
    """`python -m` alone ends by a signal after it, whatever the exit status."""
    code = (
        "from capsule_sym import __main__, _cli\n"
        "def cut_off(*given):\n"
        "    exec('raise KeyboardInterrupt')\n"
        f"{cut_off} = cut_off\n"
        "__main__.main()"
    )
    (tmp_path / "cut_off.py").write_text(code)
    run = [sys.executable, "-m", "cut_off"]
    done = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted\n")


@pytest.mark.parametrize(
    "then", ["raise RuntimeError('cannot release un-acquired lock')", "exit()"]
)
def test_an_interrupt_that_a_library_drops_or_makes_another_error_is_one_line(then: str) -> None:
    code = (
        "import os, runpy, signal, sys\n"
        "from capsule_sym import _cli\n"
        "def cut_off():\n"
        "    try:\n"
        "        os.kill(os.getpid(), signal.SIGINT)\n"
        "        sys.version_info >= (3, 11)\n"
        "    except KeyboardInterrupt:\n"
        f"        {then}\n"
        "_cli.main = cut_off\n"
        "runpy.run_module('capsule_sym', run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted\n")


def test_a_core_of_other_kernels_is_one_line() -> None:
    code = (
        "import sys\n"
        "from capsule_sym.generated import capsule\n"
        "capsule.DIGEST = 'another'\n"
        "from capsule_sym import _cli as cli\n"
        "cli.main(['run'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    if find_spec("capsule_sym._native._binding") is None:
        pytest.skip("the core was not compiled")
    assert (done.returncode, done.stdout) == (1, "")
    assert re.fullmatch(
        r"error: the core .* has kernels .* install capsule-sym again.*\n", done.stderr
    )


@sampled
@pytest.mark.parametrize("options", some([(), ("--json",)], 1), ids=str)
def test_a_reader_that_leaves_is_not_told_off(options: tuple[str, ...]) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "capsule_sym", "run", "--periods", "2", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    process.stdout.close()
    assert process.wait(timeout=60) == 1
    assert process.stderr is not None
    assert process.stderr.read() == b""
    process.stderr.close()


@sampled
@pytest.mark.parametrize("options", some([(), ("--json",)], 1), ids=str)
def test_a_terminal_without_greek_is_served(options: tuple[str, ...]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "capsule_sym", "run", "--periods", "1", *options],
        capture_output=True,
        env=os.environ | {"PYTHONIOENCODING": "latin-1"},
        check=True,
    )
    text = done.stdout.decode("ascii")
    assert "\\u03a32" in text
    if options:
        assert json.loads(text)["segments"][0]["source"] == "Σ2"


def test_help_has_everyday_commands_first(inside) -> None:
    found = re.findall(r"^  ([a-z][a-z-]+)  +[A-Z].*\.$", inside("--help").stdout, re.M)
    assert found == list(group.commands)
    assert found[:4] == ["run", "orbit", "branch", "curve"]
    assert found[-1] == "verify"
