"""A block of Python, run when the pages are built, and the matplotlib figure that it ends in."""

import ast
import contextlib
import hashlib
import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


def _last_value(text: str) -> Any:
    """Run the block; what its last line, an expression, gives."""
    *before, last = ast.parse(text).body
    assert isinstance(last, ast.Expr)
    names: dict[str, Any] = {}
    exec(compile(ast.Module(before, []), "<block>", "exec"), names)
    return eval(compile(ast.Expression(last.value), "<block>", "eval"), names)


class Drawn(SphinxDirective):
    """Shows the code, then its figure; `alt` is the text for who does not see it.

    The code runs in an empty folder, where the last TOML block of the page is `device.toml`, beside
    copies of the files in the folder with the page's name.
    """

    has_content = True
    option_spec: ClassVar[dict[str, Any]] = {"alt": directives.unchanged_required}

    def run(self) -> list[nodes.Node]:
        """The code as a block, and the figure as an image."""
        text = "\n".join(self.content)
        source = Path(self.env.doc2path(self.env.docname))
        page = source.read_text(encoding="utf-8")
        beside = sorted(source.with_suffix("").glob("*.*"))
        device = re.findall(r"^```toml\n(.*?)^```$", page, re.M | re.S)[-1:]
        known = "".join([text, *device]).encode() + b"".join(one.read_bytes() for one in beside)
        name = hashlib.sha256(known).hexdigest()[:16]
        path = Path(self.env.app.doctreedir) / "drawn" / f"{name}.svg"
        if not path.exists():
            path.parent.mkdir(exist_ok=True)
            with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
                for given in device:
                    Path("device.toml").write_text(given, encoding="utf-8")
                for one in beside:
                    shutil.copy(one, folder)
                _last_value(text).savefig(path)
        code = nodes.literal_block(text, text, language="python")
        here = Path(self.env.doc2path(self.env.docname)).parent
        image = nodes.image(uri=os.path.relpath(path, here), alt=self.options["alt"])
        return [code, image]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("drawn", Drawn)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
