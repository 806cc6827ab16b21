"""Every example of the documentation is run, and prints the output on the page; all else parses."""

import ast
import contextlib
import inspect
import io
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from enum import StrEnum
from importlib import import_module
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

import capsule_sym
from capsule_sym._cli import group
from capsule_sym._orbits.continuation.kinds import INITIALS
from capsule_sym._sweeps.quantities import CellOutcome
from capsule_sym._texts import tables
from tests.examples import MAIN_JOB, PAGES, README, ROOT, Page, shown
from tests.public import HOMES, MODULES, PUBLIC

SLOW = {
    "docs/api/attractors.md",
    "docs/api/design.md",
    "docs/api/sweeps.md",
    "docs/howto/attractors.md",
    "docs/howto/branch.md",
    "docs/howto/optimise.md",
    "docs/howto/orbit.md",
    "docs/howto/own-scene.md",
    "docs/howto/pulse.md",
    "docs/howto/sweep.md",
    "docs/output.md",
    "docs/tutorials/prototype.md",
}
"""Pages that take more than a second. `make docs` runs them."""
SEGMENT = "docs/howto/c-library.md"
"""The page on generated functions."""
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))


def lay(page: Page, directory) -> None:
    for device in page.blocks("toml"):
        (directory / "device.toml").write_text(device, encoding="utf-8")
    for beside in (ROOT / page.name).with_suffix("").glob("*.*"):
        shutil.copy(beside, directory)
    for declared in page.blocks("python"):
        if "\nmodel = Model(" in declared:  # and the code generated for it
            (directory / "shuttle.py").write_text(declared, encoding="utf-8")
            generator = [sys.executable, "-m", "capsule_sym.codegen", "--scene", "shuttle.py"]
            subprocess.run(generator, cwd=directory, check=True)


def marks(page: Page) -> list[pytest.MarkDecorator]:
    return [pytest.mark.long] if page.name in SLOW else []


WITH_PYTHON = [
    pytest.param(page, id=page.name, marks=marks(page)) for page in PAGES if page.blocks("python")
]


@pytest.mark.parametrize("page", WITH_PYTHON)
def test_the_python_of_a_page_prints_what_it_says(page: Page, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    lay(page, tmp_path)
    names: dict[str, object] = {}  # shared: a page is read from its top
    for block in page.blocks("python"):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(block, page.name, "exec"), names)
        assert printed.getvalue().splitlines() == shown(block)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_c_of_a_segment_prints_what_the_page_says(tmp_path) -> None:
    """The state is that of the map, too."""
    (page,) = [page for page in PAGES if page.name == SEGMENT]
    for name in ("capsule_kernels.c", "capsule_kernels.h", "capsule_interface.h"):
        shutil.copy(ROOT / "generated" / "capsule" / "c" / name, tmp_path)
    lay(page, tmp_path)
    for line in page.blocks("sh")[-1].splitlines():
        printed = subprocess.run(line, shell=True, cwd=tmp_path, capture_output=True, check=True)
    assert printed.stdout.decode() == page.blocks("text")[-1]
    parameters = capsule_sym.Parameters(alpha=0.7)
    phase = 1 / parameters.omega
    run = capsule_sym.simulate(parameters, (-0.5, 0.2, 0.1), phase=phase, periods=1)
    assert list(map(float, printed.stdout.split())) == pytest.approx(run(phase + 0.2), abs=1e-12)


COMMANDS = [
    pytest.param(page, line, id=f"{page.name}: {line}", marks=marks(page))
    for page in PAGES
    for line in page.console
    if line != MAIN_JOB
]


@pytest.mark.parametrize(("page", "line"), COMMANDS)
def test_the_commands_of_a_page_print_what_it_shows(page: Page, line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lay(page, tmp_path)
    prompt, program, *arguments = shlex.split(line)
    assert (prompt, program) == ("$", "capsule-sym")
    done = CliRunner().invoke(group, arguments, catch_exceptions=False)
    assert done.exit_code == line.startswith("$ capsule-sym check")  # a switch is missed
    page.assert_shown(line, done.stdout)


@pytest.mark.long
def test_every_printed_word_is_explained(tmp_path, monkeypatch) -> None:
    """Heads of tables, labels of rows, and statuses, collected from an example of each command."""
    monkeypatch.chdir(tmp_path)
    (page,) = [page for page in PAGES if page.name == "docs/output.md"]
    lay(page, tmp_path)
    words = {name.lower() for name in CellOutcome.__members__}
    monkeypatch.setattr(tables, "table", lambda heads, *_, **__: words.update(heads))
    monkeypatch.setattr(
        tables, "grid", lambda rows: words.update(row[0] for row in rows if row[0][2:3] != "F")
    )
    lines = [shlex.split(line)[2:] for line in page.console]
    assert {line[0] for line in lines} | {"basin", "explore", "figure"} == set(group.commands)
    for line in lines:
        printed = CliRunner().invoke(group, line, catch_exceptions=False).stdout
        if line[0] == "sweep":
            words |= set(re.findall(r"^([a-z]+(?: \w+)?)  ", printed, re.M))
    kinds = [kind for kind in StrEnum.__subclasses__() if "capsule_sym." in kind.__module__]
    words |= {*INITIALS, *(value.value for kind in kinds for value in kind)}
    named = r"^(greatest|least|axis) .*|^by |^in (?=[xv]_)"
    words = {re.sub(named, r"\1", word.strip()) for word in words}
    prose = re.sub(r"^```.*?^```$", "", page.text, flags=re.M | re.S).replace("\\|", "|")
    explained = set(re.findall(r"`([^`]+)`", prose)) | set(capsule_sym.Parameters().to_dict())
    assert sorted(words - explained - {"", "cost_of_transport"}) == []


def lines_of(page: Page) -> list[str]:
    """The command lines of a page's shell blocks, continued lines joined, comments cut off."""
    text = "\n".join(page.blocks("sh")).replace("\\\n", " ")
    return [line for line in text.splitlines() if line.strip() and not line.startswith("#")]


LINES = [pytest.param(line, id=line) for page in [README, *PAGES] for line in lines_of(page)]


@pytest.mark.parametrize("line", LINES)
def test_a_command_that_is_not_run_exists_with_its_options(line, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("device.toml", "chart.toml", "branch.json"):
        (tmp_path / name).write_text("")
    program, *arguments = shlex.split(line, comments=True)
    if program == "make":
        words = [word for word in arguments if "=" not in word]
        assert words[:1] == ["-C"] or set(words) <= TARGETS
    elif program.endswith("capsule-sym") and arguments:
        name, *rest = [
            str(tmp_path / "branch.json")
            if word.endswith("branch.json") or (word in arguments[1:2] and "/" in word)
            else word
            for word in arguments
        ]
        _, command, _ = group.resolve_command(click.Context(group), [name, *rest])
        assert command is not None
        with contextlib.suppress(click.exceptions.Exit):
            command.make_context(name, rest)
    else:
        assert program in {
            "./example",
            "./prototype",
            "./segment",
            "cc",
            "cmake",
            "eval",
            "export",
            "octave-cli",
            "python",
            "python3",
            ".venv/bin/python",
        }


def test_what_the_readme_links_to_is_there() -> None:
    linked = re.findall(r"\]\(\s*((?!https?:)[^)\s]+)", README.text)
    assert len(linked) > 10
    assert [path for path in linked if not (ROOT / path).exists()] == []


def test_each_reference_has_a_doi_or_a_volume_and_a_use() -> None:
    (page,) = [page for page in PAGES if page.name == "docs/references.md"]
    rows = re.findall(r"^\| (?!reference)(.+?) \| (.+) \|$", page.text, re.M)
    assert len(rows) > 20
    for reference, use in rows:
        doi = r"\[(10\.\d{4,5}/\S+)\]\(https://doi\.org/\1\)$"
        assert re.search(rf"{doi}| \d+ \(\d{{4}}\)(, \d+–\d+)?$", reference), reference
        assert len(use) > 4


def test_what_has_to_hold_is_what_is_run_before_a_change_is_taken() -> None:
    run = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    page = Page(ROOT / "CONTRIBUTING.md")
    targets = "test lint types contract check-generated second-model docs wheel packaging"
    assert re.findall(r"^for target in (.+); do$", run, re.M) == [targets]
    assert re.findall(r"`make (test lint [^`]+)`", page.text) == [targets]
    assert set(targets.split()) <= TARGETS


@pytest.mark.parametrize("made", ["verify.md", "claims.md"])
def test_a_result_is_made_anew_when_what_it_is_made_from_changes(made: str) -> None:
    """By the rules that make has read, of which none is run."""
    rules = subprocess.run(
        ["make", "-pn", "help"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    needs = set(re.findall(rf"^results/{made}: (.*)$", rules, re.M)[0].split())
    packages = [
        f"capsule_sym/{one}" for one in ["_symbolic", "_enclosures", "_orbits", "_map", "_native"]
    ]
    sources = {
        path.relative_to(ROOT).as_posix()
        for package in [*packages, "capsule_sym/generated", "paper/claims", "paper/proofs"]
        for path in (ROOT / package).glob("**/*.*")
        if path.suffix in {".c", ".h", ".py", ".pyx", ".toml"}
    }
    assert len(sources) > 100
    assert {*sources, "capsule_sym/_closed_forms.py", "capsule_sym/_parameters.py"} <= needs
    assert not [name for name in needs if "__pycache__" in name or "/tests/" in name]


def listed() -> list[str]:
    """The public names that the pages of the Python interface list."""
    texts = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs/api").glob("*.md"))]
    return re.findall(r"^\.\. auto\w+:: (capsule_sym\.\S+)$", "\n".join(texts), re.M)


def test_the_pages_list_every_public_name_once() -> None:
    names = {f"{home}.{name}" for name, home in HOMES.items()} | {*MODULES} - {"capsule_sym"}
    assert sorted(listed()) == sorted({*names, "capsule_sym.scenes", "capsule_sym.codegen.Model"})


@pytest.mark.parametrize("module", MODULES)
def test_type_checkers_see_the_same_names(module: str) -> None:
    file = Path(str(import_module(module).__file__)).with_suffix(".pyi")
    stub = ast.parse(file.read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    names = {alias.asname for node in imports for alias in node.names}
    assert names == set(import_module(module).__all__) - {"__version__"}


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_a_public_name_says_what_it_is(name: str) -> None:
    found = PUBLIC[name]
    assert found.__name__ == name
    assert len(found.__doc__ or "") > 20


def called(name: str) -> Iterator[tuple[str, Callable[..., object]]]:
    """A public function, or the public methods of a class."""
    found = PUBLIC[name]
    if not inspect.isclass(found):
        yield name, inspect.unwrap(found)
        return
    for method, value in vars(found).items():
        function = getattr(value, "__func__", value)
        if inspect.isfunction(function) and not method.startswith("_"):
            yield f"{name}.{method}", function


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_a_docstring_says_what_is_raised(name: str) -> None:
    """Exceptions that a function raises itself, by name."""
    for called_name, function in called(name):
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        calls = [n.exc for n in ast.walk(tree) if isinstance(n, ast.Raise)]
        raised = {
            call.func.id
            for call in calls
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name)
        }
        told = function.__doc__ or ""
        assert told, called_name
        assert [error for error in raised if error not in told] == [], called_name


ARRAY = r"NDArray|ArrayLike|Vector|Matrix"
SHAPE = r"shape|\((\d|n|k|many|\.\.\.),? ?"
UNIT = r"(?i)dimensionless|\bSI\b|\bunits?\b|\((m|s|N|J|kg|rad)\b"
DRAWN = ("capsule_sym._figures",)  # what figures show has its units on their axes


def numbers_of(name: str) -> Iterator[tuple[str, str, str]]:
    """A public name, or its methods and properties: the types it takes and gives, and its text.

    The text of a class includes its docstring, and that of an attribute the string below it.
    """
    found = PUBLIC[name]
    if not inspect.isclass(found):
        yield name, str(inspect.signature(found)), inspect.getdoc(found) or ""
        return
    whole = f"{inspect.getdoc(found)}\n{inspect.getsource(found)}"
    attributes = vars(found).get("__annotations__", {})
    yield name, " ".join(map(str, attributes.values())), whole
    for member, value in vars(found).items():
        function = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
        if inspect.isfunction(function) and not member.startswith("_"):
            text = f"{inspect.getdoc(found)}\n{inspect.getdoc(function)}"
            yield f"{name}.{member}", str(inspect.signature(function)), text


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_a_docstring_has_shapes_and_units(name: str) -> None:
    for each, types, text in numbers_of(name):
        types = types.replace("max_seconds: 'float'", "")  # its name has its unit
        if re.search(ARRAY, types):
            assert re.search(SHAPE, text), f"{each}: of which shape is {types}?"
        drawn = inspect.unwrap(PUBLIC[name]).__module__.startswith(DRAWN)
        if not drawn and re.search(rf"\bfloat\b|\bNumber\b|{ARRAY}", types):
            assert re.search(UNIT, text), f"{each}: in which units is {types}?"


@pytest.mark.parametrize("page", [README, *PAGES], ids=lambda page: page.name)
def test_examples_import_from_the_package_alone(page: Page) -> None:
    allowed = {"capsule_sym"}
    if page.name == "docs/howto/own-scene.md":
        allowed.add("capsule_sym.codegen")
    assert set(re.findall(r"^ *from (capsule_sym\S*) import", page.text, re.M)) <= allowed


def test_names_in_prose_are_those_of_the_project() -> None:
    folders = ("capsule_sym", "paper", "codegen", "matlab", "generated")
    sources = [ROOT / folder for folder in folders]
    known = set(re.findall(r"\w+", (ROOT / "pyproject.toml").read_text(encoding="utf-8")))
    for path in (path for source in sources for path in source.rglob("*")):
        if path.suffix in {".py", ".pyi", ".pyx", ".c", ".h", ".m", ".toml", ".txt", ".in"}:
            known |= set(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    # Those of COCO, which a page translates, and of CMake.
    others = {"coco_bd_read"}
    others |= {"ode_PD2hspo", "ode_BP2hspo"}
    others |= {"ode_hspo2SN", "ode_hspo2PD", "ode_hspo2TR"}
    others |= {"PKG_CONFIG_PATH", "DCMAKE_PREFIX_PATH", "test_certificate"}
    others |= {name.lower() for name in CellOutcome.__members__}
    assert "solve_orbit" in known
    for page in PAGES:
        prose = re.sub(r"^```.*?^```$", "", page.text, flags=re.M | re.S)
        spans = " ".join(re.findall(r"(?<![\w}])`([^`]+)`", prose))
        named = {word for word in re.findall(r"[A-Za-z_]\w+", spans) if "_" in word}
        assert named - known - others == set(), page.name
