"""`make lint`: house style of English, checked by proselint with the rules of `prose.toml`.

It reads the pages, and in source code comments and strings: docstrings, help texts and messages.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from proselint.checks import __register__ as shipped
from proselint.registry.checks import Check, CheckResult, types
from proselint.registry.checks.engine import Fancy, RegexOptions

ROOT = Path(__file__).parents[1]
_STRINGS = r'"""(?:\\.|[^\\])*?"""|"(?:\\.|[^"\\\n])*"' + r"|'(?:\\.|[^'\\\n])*'"
_PYTHON = re.compile(rf"{_STRINGS}|#[^\n]*", re.S)
_C = re.compile(rf"/\*.*?\*/|//[^\n]*|{_STRINGS}|`[^`]*`", re.S)
KINDS = {
    **dict.fromkeys((".py", ".pyx", ".toml"), _PYTHON),
    **dict.fromkeys((".c", ".h", ".in", ".ts"), _C),
}
_QUOTED = re.compile(r"``.+?``|`[^`]+`|\{[^{}]*\}|https?://\S+", re.S)
_PAGE = re.compile(
    r"^#+ |^( *)(`{3,}|~{3,}|\${2}).*?^\1\2[ \t]*$|<!--.*?-->|`[^`]+`|\$[^$]+\$|\]\([^)]*\)",
    re.S | re.M,
)


@cache
def style() -> dict[str, Any]:
    """The rules, the checks taken from proselint, and the folders that are read."""
    with Path(__file__).with_suffix(".toml").open("rb") as file:
        return tomllib.load(file)


@cache
def checks() -> tuple[Check, ...]:
    """One check of proselint for each rule, after those that proselint brings."""
    own = [
        Check(
            check_type=types.ExistenceSimple(rule["not"].replace(" ", r"[\s*#]+")),
            engine=Fancy(RegexOptions(case_insensitive=not rule.get("case", False))),
            path=f"house.{rule['name']}",
            message=f"'{{}}': say {rule['say']}",
        )
        for rule in style()["rule"]
    ]
    return (*(one for one in shipped if one.path_segments[0] in style()["shipped"]), *own)


def _hidden(text: str) -> str:
    return re.sub(r"[^\n]+", " ", text)


def prose(text: str, suffix: str, *, strings: bool = True) -> str:
    """Prose of a file, line by line; without `strings` of one line, as for tests."""
    if suffix == ".md":
        # The mark of a heading stays, as a bar: its words are no sentence's.
        return _PAGE.sub(lambda found: "| " if found[0][0] == "#" else _hidden(found[0]), text)
    kept, last = [], 0
    for found in KINDS[suffix].finditer(text):
        piece = found[0]
        read = piece.startswith(("#", "/", '"""')) or (strings and piece.count(" ") > 2)
        kept += [_hidden(text[last : found.start()]), piece if read else _hidden(piece)]
        last = found.end()
    text = _QUOTED.sub(lambda found: _hidden(found[0]), "".join([*kept, _hidden(text[last:])]))
    return re.sub(r"[ \t]+", " ", text)


def faults(text: str) -> list[tuple[int, CheckResult]]:
    """Line and result of each check that objects to a text, in the order of lines."""
    text = f"\n{text}\n"  # proselint's patterns take a separator on both sides
    found = (result for check in checks() for result in check.check_with_flags(text))
    return sorted(
        ((text.count("\n", 0, one.span[0] + 1), one) for one in found), key=lambda of: of[0]
    )


def files(begins: tuple[str, ...] = ()) -> Iterator[Path]:
    """Files to read, by the beginning of their path if any is given."""
    unread = tuple(style()["unread"])
    for name in style()["read"]:
        for path in sorted(ROOT.glob(name)):
            place = path.relative_to(ROOT).as_posix()
            wanted = place.startswith(begins or "") and not place.startswith(unread)
            if wanted and path.suffix in {".md", *KINDS}:
                yield path


def main(*begins: str) -> int:
    """Print all faults of these files; the exit status is 1 if there are any."""
    count = 0
    for path in files(begins):
        place = path.relative_to(ROOT)
        text = path.read_text(encoding="utf-8")
        for line, one in faults(prose(text, path.suffix, strings="tests" not in place.parts)):
            print(f"{place.as_posix()}:{line}: {one.check_path}: {' '.join(one.message.split())}")
            count += 1
    return int(count > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
