"""`make contract`: private modules of the tool that the paper and the benchmarks import.

`houses.toml` lists them, each with the reason why its names are not public. A module that is not
listed, and an entry that nobody imports, are faults.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
HOUSES = ("paper", "benchmarks")
TOOL = "capsule_sym"
MODULES = ("figures", "inputs", "orbits", "results")
"""Modules of public names, beside those of scenes."""
PUBLIC = {f"{TOOL}.{name}" for name in (*MODULES, "scenes")}
_EXPORTED = "imported to be exported"  # comment of a module that is an interface


def imported(text: str) -> Iterator[str]:
    """Private modules of the tool that a file imports, or from which it imports names."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (
                one.name
                for one in node.names
                if one.name.startswith(f"{TOOL}.") and one.name not in PUBLIC
            )
        elif isinstance(node, ast.ImportFrom) and not node.level:
            home = node.module or ""
            if home.partition(".")[0] == TOOL and home not in PUBLIC:
                yield from (_module(home, one.name) for one in node.names if home != TOOL)
                yield from (f"{TOOL}.{n.name}" for n in node.names if home == TOOL and _hidden(n))


def _hidden(name: ast.alias) -> bool:
    return name.name.startswith("_") and not name.name.startswith("__")


def _module(home: str, name: str) -> str:
    """The module that is imported: that of this name in a package, or else the home of the name."""
    folder = ROOT.joinpath(*home.split("."))
    exports = folder / "__init__.py"
    if not exports.exists() or re.search(rf"\bimport {name}\b", exports.read_text("utf-8")):
        return home
    inside = (folder / f"{name}.py").exists() or (folder / name).is_dir()
    return f"{home}.{name}" if inside else home


def private_modules() -> dict[str, list[str]]:
    """Files of both houses, without their tests, by the private module that they import."""
    found: dict[str, list[str]] = {}
    for house in HOUSES:
        for path in sorted((ROOT / house).rglob("*.py")):
            place = path.relative_to(ROOT)
            if "tests" not in place.parts:
                for module in {*imported(path.read_text(encoding="utf-8"))}:
                    found.setdefault(module, []).append(place.as_posix())
    return dict(sorted(found.items()))


def unused_exports() -> list[str]:
    """Names that a listed module takes from others for the houses, and that no house imports."""
    taken: dict[str, set[str]] = {}
    for path in (path for house in HOUSES for path in (ROOT / house).rglob("*.py")):
        modules: dict[str, str] = {}  # by the name that it has in this file
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                taken.setdefault(node.module or "", set()).update(one.name for one in node.names)
                modules |= {n.asname or n.name: f"{node.module}.{n.name}" for n in node.names}
            elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                home = modules.get(node.value.id, "")
                taken.setdefault(home, set()).add(node.attr)
    found = []
    for path in sorted((ROOT / TOOL).glob("*/*.py")):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        text = path.read_text(encoding="utf-8")
        if _EXPORTED in text:
            nodes = (node for node in ast.parse(text).body if isinstance(node, ast.ImportFrom))
            names = {one.asname or one.name for node in nodes for one in node.names}
            found += [f"{module}.{name}" for name in sorted(names - taken.get(module, set()))]
    return found


def faults() -> list[str]:
    """A line for each module that is not listed, and for each entry or name without a user."""
    listed = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    used = private_modules()
    return [
        *(f"{module} is not listed: {', '.join(used[module])}" for module in used.keys() - listed),
        *(f"{module} is listed, and nobody imports it" for module in listed.keys() - used),
        *(f"{name} is exported, and nobody imports it" for name in unused_exports()),
    ]


if __name__ == "__main__":
    found = sorted(faults())
    print("\n".join(found) or f"{len(private_modules())} private modules are imported, as listed")
    sys.exit(bool(found))
