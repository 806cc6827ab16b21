"""Formulas as MathML, typeset by the browser: a page needs no script and no network for them."""

import re
from itertools import cycle

from docutils.nodes import Element, SkipNode
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util.logging import getLogger
from sphinx.writers.html5 import HTML5Translator

LOGGER = getLogger(__name__)

_SPELLED = {r"\iff": r"\Longleftrightarrow"}
"""LaTeX commands that docutils does not have."""

_BAR = '<mo form="{}" stretchy="false">|</mo>'

_LONG = 40
"""Length, in characters of LaTeX, above which a formula within a line may be wider than a phone."""


def _mathml(node: Element, as_block: bool) -> str:
    formula = node.astext()
    for name, known in _SPELLED.items():
        formula = formula.replace(name, known)
    # Primes above, not apostrophes.
    formula = re.sub(r"'+(?!['^])", lambda one: "^{" + r"\prime " * len(one[0]) + "}", formula)
    # Browsers put no space around functions: one before them, and one after without parenthesis.
    formula = re.sub(r"(?<=[\w)}])\s*(?=\\(?:cos|sin|tan)\b)", r" \\,", formula)
    formula = re.sub(r"(\\(?:cos|sin|tan)(?:\^\w)?)(?=\s*[\\a-zA-Z])(?!\w)", r"\1\\,", formula)
    try:
        shown = tex2mathml(formula, as_block=as_block)
        # A bar does not tell on which side of a value it is.
        sides = cycle(("prefix", "postfix"))
        return re.sub("<mo[^>]*>\\|</mo>", lambda _: _BAR.format(next(sides)), shown)
    except MathError as error:
        LOGGER.warning("formula not understood: %s", error, location=node)
        return ""


def _inline(writer: HTML5Translator, node: Element) -> None:
    shown = _mathml(node, as_block=False)
    if len(node.astext()) > _LONG:
        shown = f'<span class="formula" tabindex="0">{shown}</span>'
    writer.body.append(shown)
    raise SkipNode


def _display(writer: HTML5Translator, node: Element) -> None:
    # Focusable, as a formula wider than the page is scrolled.
    shown = _mathml(node, as_block=True)
    number = f'<span class="eqno">({node["number"]})</span>' if node["number"] else ""
    ids = f' id="{node["ids"][0]}"' if node["ids"] else ""
    writer.body.append(f'<div class="math"{ids} tabindex="0">{shown}{number}</div>\n')
    raise SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer under the name `mathml`."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
