"""`make lines`: the size of the code by room, and the rules of the house that a machine can count.

A room is a package of `capsule_sym`, the command line, or the generator with its templates. Code
that is generated does not count.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import grimp

ROOT = Path(__file__).parents[1]
KINDS = {
    ".py": "Python",
    ".pyi": "Python",
    ".c": "C",
    ".h": "C",
    ".pyx": "Cython",
    ".in": "templates",
    ".j2": "templates",
}
LONGEST = 100
"""Lines that a function may have."""
PARAMETERS = ("alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b")
GOALS = {
    "lines": 38_000,
    "functions over 100 lines": 0,
    "exceptions of the import contract": 0,
    "circles of imports": 0,
    "lines of explorer/core": 450,
    "homes of a parameter's facts": 1,
}
_TABLE = 100  # lines within which a table of the parameters has them all
COMMANDS = ("_cli.py", "_records.py", "__main__.py")
"""Files at the top that are of the room of the commands."""


class Place(NamedTuple):
    """A function and its length."""

    path: str
    line: int
    name: str
    lines: int


def files(*folders: str) -> Iterator[Path]:
    """The files of these folders that were written by hand, without links."""
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*")):
            parts = path.relative_to(ROOT).parts
            if path.is_file() and not {"generated", "__pycache__", "node_modules"} & {*parts}:
                yield path


def room(path: Path) -> str:
    """The room of a file."""
    first, *rest = path.relative_to(ROOT).parts
    if first == "codegen" or rest[0] == "codegen":
        return "codegen"
    if rest[0] == "_commands" or rest[0] in COMMANDS:
        return "commands"
    return rest[0] if len(rest) > 1 else "the rest"


def lines_by_room() -> dict[str, Counter[str]]:
    """Lines of each kind of source by room."""
    found: dict[str, Counter[str]] = {}
    for path in files("capsule_sym", "codegen"):
        if kind := KINDS.get(path.suffix):
            with path.open("rb") as lines:
                found.setdefault(room(path), Counter())[kind] += sum(1 for _ in lines)
    return dict(sorted(found.items()))


def long_functions() -> list[Place]:
    """Functions of Python, Cython and C with more lines than `LONGEST`, the longest first."""
    found = []
    for path in files("capsule_sym", "codegen", "explorer/core", "matlab", "benchmarks"):
        if read := _FUNCTIONS.get(path.suffix):
            name = path.relative_to(ROOT).as_posix()
            text = path.read_text(encoding="utf-8")
            found += [Place(name, *one) for one in read(text) if one[2] > LONGEST]
    return sorted(found, key=lambda place: -place.lines)


def _of_python(text: str) -> Iterator[tuple[int, str, int]]:
    """First line, name and number of lines of each function."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            assert node.end_lineno is not None
            yield node.lineno, node.name, node.end_lineno - node.lineno + 1


def _of_cython(text: str) -> Iterator[tuple[int, str, int]]:
    """The same of Cython, by indentation."""
    lines = text.splitlines()
    head = re.compile(r"( *)(?:cp?def|def)\b(?! class)[^=]*?(\w+)\(")
    for number, line in enumerate(lines):
        if begin := head.match(line):
            last = closed = number
            for place in range(number + 1, len(lines)):
                depth = len(lines[place]) - len(lines[place].lstrip())
                if lines[place].strip() and not lines[place].lstrip().startswith(")"):
                    if depth <= len(begin[1]):
                        break
                    closed = place
            last = closed
            yield number + 1, begin[2], last - number + 1


def _of_c(text: str) -> Iterator[tuple[int, str, int]]:
    """The same of C: what stands in braces after parentheses at the top level."""
    text = re.sub(r"/\*.*?\*/", lambda found: "\n" * found[0].count("\n"), text, flags=re.S)
    text = re.sub(r"//[^\n]*", "", text)
    text = re.sub(
        r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*",
        lambda found: "\n" * found[0].count("\n"),
        text,
        flags=re.M,
    )
    text = re.sub(r'"(?:\\.|[^"\\\n])*"' + r"|'(?:\\.|[^'\\\n])*'", "0", text)
    depth, begin, head = 0, 0, ""
    for place, letter in enumerate(text):
        if letter == "{":
            depth += 1
            if depth == 1:
                head = text[begin:place]
        elif letter == "}":
            depth -= 1
            if depth == 0 and (named := re.search(r"(\w+)\s*\((?:[^()]|\([^()]*\))*\)\s*$", head)):
                first = text.count("\n", 0, begin + len(head) - len(head.lstrip())) + 1
                yield first, named[1], text.count("\n", 0, place) + 2 - first
        if depth == 0 and letter in ";}":
            begin = place + 1


_FUNCTIONS = {".py": _of_python, ".pyx": _of_cython, ".c": _of_c, ".h": _of_c}


def exceptions() -> list[str]:
    """The imports that a contract of `make contract` passes over."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    return [one for contract in contracts for one in contract.get("ignore_imports", ())]


def circles() -> list[str]:
    """Imports between neighbours, modules or packages, without which no circle would be left."""
    graph = grimp.build_graph("capsule_sym", cache_dir=None)
    return sorted(
        f"{importer} -> {imported}"
        for package in sorted(graph.modules)
        if len(graph.find_children(package)) > 1
        for importer, imported in graph.nominate_cycle_breakers(package)
    )


def homes() -> list[str]:
    """Files with a table of facts of the model's parameters, each at a line of its own.

    The transcription of the paper does not count: the model is checked against it.
    """
    return [
        path.relative_to(ROOT).as_posix()
        for path in files("capsule_sym", "codegen", "explorer/src", "matlab")
        if path.suffix in {".py", ".toml", ".c", ".h", ".ts", ".in", ".m"}
        and "paper" not in path.relative_to(ROOT).as_posix()
        and has_facts(path.read_text(encoding="utf-8"))
    ]


def has_facts(text: str) -> bool:
    """True if a text has a line for each parameter, one after another."""
    named = re.compile(rf"\W*(?:[A-Za-z]\w*\W+)?({'|'.join(PARAMETERS)})\W+\w")
    lines = [line for line in text.splitlines() if "->" not in line]
    found = [(number, one[1]) for number, line in enumerate(lines) if (one := named.match(line))]
    found = [
        one for before, one in zip([(0, ""), *found], found, strict=False) if one[1] != before[1]
    ]
    count = len(PARAMETERS)
    runs = (found[place : place + count] for place in range(len(found) - count + 1))
    return any(
        len({name for _, name in run}) == count and run[-1][0] - run[0][0] < _TABLE for run in runs
    )


def core_of_the_explorer() -> int:
    """Lines of C that the explorer adds to the library."""
    return sum(
        len(path.read_text(encoding="utf-8").splitlines())
        for path in files("explorer/core")
        if path.suffix in {".c", ".h"}
    )


def measure() -> dict[str, Any]:
    """All counts, ready for JSON."""
    rooms = lines_by_room()
    return {
        "rooms": {name: dict(counts) for name, counts in rooms.items()},
        "lines": sum(counts.total() for counts in rooms.values()),
        "functions over 100 lines": [place._asdict() for place in long_functions()],
        "exceptions of the import contract": exceptions(),
        "circles of imports": circles(),
        "lines of explorer/core": core_of_the_explorer(),
        "homes of a parameter's facts": homes(),
    }


def table(found: dict[str, Any]) -> str:
    """The counts as plain text."""
    kinds = list(dict.fromkeys(KINDS.values()))
    rows = [["room", *kinds, "all"]]
    total: Counter[str] = Counter()
    for name, counts in found["rooms"].items():
        total.update(counts)
        rows.append(
            [name, *(f"{counts.get(kind, 0):,}" for kind in kinds), f"{sum(counts.values()):,}"]
        )
    rows.append(["all", *(f"{total[kind]:,}" for kind in kinds), f"{total.total():,}"])
    text = _columns(rows) + "\n"
    rows, places = [["", "now", "goal"]], []
    for name, goal in GOALS.items():
        value = found[name]
        rows.append([name, f"{value if isinstance(value, int) else len(value):,}", f"{goal:,}"])
        if isinstance(value, list):
            places += [f"  {name}:", *(f"    {_told(one)}" for one in value)] if value else []
    return "\n".join([text, _columns(rows), *([""] if places else []), *places])


def _told(one: Any) -> str:
    return one if isinstance(one, str) else "{path}:{line}  {name}, {lines} lines".format(**one)


def _columns(rows: list[list[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if place == 0 else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def main() -> None:
    """Print the counts."""
    parser = argparse.ArgumentParser(prog="make lines", description=__doc__)
    parser.add_argument("--json", action="store_true", help="One JSON object, with all places.")
    found = measure()
    print(json.dumps(found, indent=2) if parser.parse_args().json else table(found))


if __name__ == "__main__":
    main()
