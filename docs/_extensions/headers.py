"""The C library's reference, from the comments of its headers."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Declared(NamedTuple):
    """Functions under one comment, or a type with its fields."""

    names: tuple[str, ...]
    comment: str
    functions: tuple[str, ...]
    """Their declarations, each in one line; none for a type."""
    text: str


_DECLARED = re.compile(
    r"^/\*(?P<comment>(?:(?!\*/).)*)\*/\n"
    r"(?:(?P<functions>(?:(?:(?!typedef|static|#)\w[^;{}#]*\([^;{}#]*\);\n)+))"
    r"|(?P<type>typedef (?:struct|enum) \{.*?^\} (?P<name>\w+);))",
    re.M | re.S,
)


def declared(header: str) -> Iterator[Declared]:
    """Public declarations of a header, in its order."""
    for found in _DECLARED.finditer(header):
        comment = re.sub(r"\s*\n\s*", " ", found["comment"].strip())
        if found["type"]:
            yield Declared((found["name"],), comment, (), found["type"])
        else:
            lines = re.sub(r"\s+", " ", found["functions"]).replace("; ", ";\n").splitlines()
            functions = tuple(line.strip().rstrip(";") for line in lines)
            names = tuple(re.search(r"(\w+)\(", line)[1] for line in functions)  # type: ignore[index]
            yield Declared(names, comment, functions, found["functions"])


class Header(SphinxDirective):
    """`{header} path`: what the header declares, as the C domain has it."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The header's functions and types."""
        relative, absolute = self.env.relfn2path(self.arguments[0])
        self.env.note_dependency(relative)
        texts = (_described(one) for one in declared(Path(absolute).read_text(encoding="utf-8")))
        return self.parse_text_to_nodes("\n\n".join(texts))


def _described(one: Declared) -> str:
    """A declaration as the C domain has it, in Markdown; the comment is below the last name."""
    comment = re.sub(r"(?<!`)[*<](?!`)", r"\\\g<0>", one.comment)
    if not one.functions:
        return f"````{{c:type}} {one.names[0]}\n{comment}\n\n```c\n{one.text}\n```\n````"
    *others, last = one.functions
    above = "".join(f"````{{c:function}} {other}\n````\n" for other in others)
    return f"{above}````{{c:function}} {last}\n{comment}\n````"


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive("header", Header)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
