"""A picture drawn when the pages are built, above the Python or the commands that draw it."""

import ast
import contextlib
import hashlib
import io
import os
import re
import shlex
import shutil
import tempfile
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from capsule_sym import InvalidInput
from capsule_sym._cli import group

NARROW = 3.6
"""Width, in inches, of the picture for phones: its letters have the size of those of the page."""


def _draw(text: str, out: Path, alone: bool) -> None:
    """Save the figure that the last line of a block gives as `out`.wide.svg.

    If this line calls a function that takes a width, `out`.narrow.svg is drawn from the same
    arguments; `alone`, in place of the other.
    """
    *before, last = ast.parse(text).body
    assert isinstance(last, ast.Expr)
    names: dict[str, Any] = {}
    exec(compile(ast.Module(before, []), "<block>", "exec"), names)
    call = last.value
    if not isinstance(call, ast.Call):
        eval(compile(ast.Expression(call), "<block>", "eval"), names).savefig(f"{out}.wide.svg")
        return
    given = [eval(ast.unparse(one), names) for one in call.args]
    chosen = {one.arg: eval(ast.unparse(one.value), names) for one in call.keywords if one.arg}
    draw = eval(ast.unparse(call.func), names)
    with contextlib.suppress(InvalidInput):  # a figure that does not fit into a column
        draw(*given, **chosen | {"width": NARROW}).savefig(f"{out}.narrow.svg")
        if alone:
            return
    draw(*given, **chosen).savefig(f"{out}.wide.svg")


def _command(text: str, out: Path) -> None:
    """Run the commands of a block; the last one draws, wide and narrow."""
    *before, last = (shlex.split(line)[1:] for line in text.replace("\\\n", " ").splitlines())
    at = last.index("--out") + 1
    wide = [*last[:at], f"{out}.wide.svg", *last[at + 1 :]]
    narrow = [*last[:at], f"{out}.narrow.svg", *last[at + 1 :], "--width", str(NARROW)]
    told = io.StringIO()
    with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
        for arguments in (*before, narrow, wide):
            group.main(arguments, prog_name="capsule-sym", standalone_mode=False)


class Drawn(SphinxDirective):
    """Shows a figure, then its code; `alt` is the text alternative.

    The code is Python, or lines of capsule-sym. It runs in an empty folder, where the last TOML
    block of the page is `device.toml`, beside copies of the files in the folder of the page's name.
    """

    has_content = True
    option_spec: ClassVar[dict[str, Any]] = {
        "alt": directives.unchanged_required,
        "alone": directives.flag,  # the narrow figure, without the code
        "bare": directives.flag,  # the figure of the screen's width, without the code
    }

    def run(self) -> list[nodes.Node]:
        """The figure as images for wide and for narrow screens, and the code as a block."""
        text = "\n".join(self.content)
        shell = text.startswith("capsule-sym ")
        source = Path(self.env.doc2path(self.env.docname))
        page = source.read_text(encoding="utf-8")
        beside = sorted(source.with_suffix("").glob("*.*"))
        for one in beside:
            self.env.note_dependency(str(one))
        device = re.findall(r"^```toml\n(.*?)^```$", page, re.M | re.S)[-1:]
        alone, bare = "alone" in self.options, {"alone", "bare"} & set(self.options)
        known = "".join([text, *device]).encode() + b"".join(one.read_bytes() for one in beside)
        name = hashlib.sha256(known).hexdigest()[:16]
        folder = Path(self.env.app.doctreedir) / "drawn"
        if not list(folder.glob(f"{name}.{'*' if alone else 'wide'}.svg")):
            folder.mkdir(exist_ok=True)
            with tempfile.TemporaryDirectory() as empty, contextlib.chdir(empty):
                for given in device:
                    Path("device.toml").write_text(given, encoding="utf-8")
                for one in beside:
                    shutil.copy(one, empty)
                if shell:
                    _command(text, folder / name)
                else:
                    _draw(text, folder / name, alone)
        widths = [one for one in ("wide", "narrow") if (folder / f"{name}.{one}.svg").exists()]
        shown: list[nodes.Node] = []
        for width in widths[-1:] if alone else widths:
            uri = f"/{os.path.relpath(folder, self.env.srcdir)}/{name}.{width}.svg"
            classes = ["alone" if alone else width if len(widths) == 2 else "only"]
            svg = (folder / f"{name}.{width}.svg").read_text(encoding="utf-8")
            if "<image" in svg or svg.count("FillBetweenPolyCollection_") > 1:
                classes.append("coloured")  # areas, whose colours dark pages do not exchange
            shown.append(nodes.image(uri=uri, alt=self.options["alt"], classes=classes))
        code = nodes.literal_block(text, text, language="sh" if shell else "python")
        return [nodes.container("", *shown, classes=["picture"]), *([] if bare else [code])]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("drawn", Drawn)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
