"""`make lines`: the size of the house beside its goals, and lines of code by package.

A line of code is one that holds neither a comment nor a docstring alone, and is not blank.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import capsule_sym
from benchmarks.houses import MODULES, private_modules
from capsule_sym._cli import group

ROOT = Path(__file__).parents[1]
TOOL = ("capsule_sym", "codegen")
BINDING = ("_binding.pyx", "core.c", "capsule_core.h", "__init__.py")
_NATIVE = "capsule_sym/_native/"
ROOMS = (
    ("the binding and its table", [f"{_NATIVE}{name}" for name in BINDING], 800),
    ("design and attractors", ["capsule_sym/_design", "capsule_sym/_attractors"], 3_600),
    ("commands", ["capsule_sym/_commands"], 1_800),
)
"""Names of parts of the tool, their files, and goals."""
_PYTHON = {".py", ".pyi"}
_C = {".c", ".h", ".ts"}
_OTHER = {".pyx", ".pxd", ".pxi", ".in", ".j2", ".part", ".toml"}
_NO_CODE = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE),
    *(tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER),
}


class Row(NamedTuple):
    """A count of the house and what it is to be at most."""

    what: str
    now: int
    goal: int


def files(*folders: str) -> Iterator[Path]:
    """Files of these folders under version control, without links."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", *folders], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for name in filter(None, listed.stdout.split("\0")):
        path = ROOT / name
        if path.is_file() and not path.is_symlink():
            yield path


def count(path: Path) -> int:
    """Lines of code of a file; 0 for a file of another kind."""
    if path.suffix not in _PYTHON | _C | _OTHER:
        return 0
    text = path.read_text(encoding="utf-8")
    if path.suffix in _PYTHON:
        return _of_python(text)
    if path.suffix in _C:
        text = re.sub(r"/\*.*?\*/", lambda found: "\n" * found[0].count("\n"), text, flags=re.S)
        return sum(bool(line.strip()) for line in re.sub(r"//[^\n]*", "", text).splitlines())
    return sum(not line.strip().startswith("#") for line in text.splitlines() if line.strip())


def _of_python(text: str) -> int:
    said, code = set[int](), set[int]()
    for node in ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        for one in body if isinstance(body, list) else ():
            match one:
                case ast.Expr(value=ast.Constant(value=str())):
                    said.update(range(one.lineno, (one.end_lineno or one.lineno) + 1))
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _NO_CODE:
            code.update(range(token.start[0], token.end[0] + 1))
    return len(code - said)


def by_package(*folders: str) -> dict[str, Counter[str]]:
    """Lines of "code" and of "toml" of each package, or of the files beside them."""
    found: dict[str, Counter[str]] = {}
    for path in files(*folders):
        first, *rest = path.relative_to(ROOT).parts
        package = f"{first}/{rest[0]}" if len(rest) > 1 else first
        kind = "toml" if path.suffix == ".toml" else "code"
        if lines := count(path):
            found.setdefault(package, Counter())[kind] += lines
    return found


def targets() -> list[str]:
    """Targets of make with a line of help."""
    return re.findall(r"^([a-z-]+):.*## ", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)


def classes() -> Counter[str]:
    """Numbers of classes of the tool by their names."""
    trees = (
        ast.parse(path.read_text("utf-8")) for path in files("capsule_sym") if path.suffix == ".py"
    )
    nodes = (node for tree in trees for node in ast.walk(tree))
    return Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))


def modules() -> list[list[str]]:
    """Names in each module of public names, without those of scenes."""
    return [dir(getattr(capsule_sym, name)) for name in MODULES]


def rows() -> list[Row]:
    """All counts beside their goals."""
    tool = sum(by_package(*TOOL).values(), Counter())
    generated = (path for path in files("generated") if path.suffix == ".py")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return [
        Row("lines of code in capsule_sym and codegen", tool["code"], 32_000),
        Row("lines of TOML in them", tool["toml"], 600),
        Row(
            "lines of generated Python",
            sum(len(path.read_text(encoding="utf-8").splitlines()) for path in generated),
            6_000,
        ),
        Row("lines of code in tests", sum(by_package("tests").values(), Counter())["code"], 30_000),
        Row("commands of capsule-sym", len(group.commands), 17),
        Row("targets of make", len(targets()), 20),
        Row("extras", len(project["optional-dependencies"]), 4),
        Row("private modules that paper and benchmarks import", len(private_modules()), 25),
        Row("names of classes that stand for two", sum(n > 1 for n in classes().values()), 0),
        Row("names in capsule_sym", len(dir(capsule_sym)), 40),
        Row("names in it and its modules", len(dir(capsule_sym)) + sum(map(len, modules())), 110),
        *(
            Row(f"lines of code in {name}", sum(map(count, files(*of))), goal)
            for name, of, goal in ROOMS
        ),
    ]


def main() -> None:
    """Print lines by package, and the counts beside their goals."""
    packages = by_package(*TOOL, "paper", "benchmarks", "tests")
    for name, lines in sorted(
        packages.items(), key=lambda one: (one[0].split("/")[0], -one[1]["code"])
    ):
        print(f"{lines['code']:7,} {lines['toml']:6,}  {name}")
    print()
    print(f"{'':50}{'now':>8}{'goal':>8}")
    for what, now, goal in rows():
        print(f"{what:50}{now:8,}{goal:8,}{'' if now <= goal else '  over'}")


if __name__ == "__main__":
    main()
