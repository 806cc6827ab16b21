"""Backends: how each spells a function, what templates may name, and that all of it is theirs."""

import ast
import importlib
import json
import math
import operator
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import sympy as sp

from capsule_sym._symbolic.model.formulas import Formula
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.symbols import PARAMETERS
from capsule_sym.codegen import _render
from capsule_sym.codegen._backend import Language
from capsule_sym.codegen._blocks import segment_constants
from capsule_sym.codegen._derived import Derived, derive, lowered
from capsule_sym.codegen._lower import lower
from capsule_sym.codegen.backends import BACKENDS, Shared
from capsule_sym.codegen.backends.c import C, Real
from capsule_sym.codegen.backends.python import Python

CODEGEN = Path(_render.__file__).parent
X, Y, K = sp.symbols("x y K")
# A result that replaces an argument, a shared subexpression, a constant, and a quotient.
SWAPPED = lower(
    "swapped",
    "Two results.",
    [(X, K * sp.exp(X * Y) + Y), (Y, sp.exp(X * Y) / Y**2 + X)],
    ("x", "y"),
    ("x", "y"),
    frozenset({"K"}),
)
TUPLE = lower("alone", "A tuple of one.", [(X, K * X)], ("x",), ("x",), frozenset({"K"}))
ONE = lowered(Formula("one", "One result.", (X,), (("r", K * X + 1),)))
ROW = lowered(Formula("row", "An array.", (X,), (("a", X**2), ("b", K - X)), array=True))
NAMED = lowered(Formula("named", "Named results.", (X,), (("a", X**2), ("b", K - X))))
DOUBLED = lowered(Formula("doubled", "No constant.", (X,), (("r", 2 * X),)))


@pytest.fixture(scope="module")
def derived() -> Derived:
    return derive("Generated.\n\nInputs.", "0123")


def expected(x: float, y: float, k: float) -> tuple[float, float]:
    return k * math.exp(x * y) + y, math.exp(x * y) / y**2 + x


def test_a_function_in_python_is_its_kernel(derived: Derived) -> None:
    names: dict[str, Any] = {}
    python = Python(derived)
    for kernel in (SWAPPED, TUPLE, ONE, ROW):
        exec(python.function(kernel), names)
    c = SimpleNamespace(K=3.0)
    assert names["swapped"](math, c, 0.5, 2.0) == pytest.approx(expected(0.5, 2.0, 3.0), rel=1e-15)
    assert names["alone"](c, 2.0) == (6.0,)
    assert names["one"](c, 2.0) == 7.0
    assert names["row"](c, 2.0) == (4.0, 1.0)
    assert names["one"].__doc__ == "One result. 2 operations."


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_a_function_in_c_is_its_kernel(derived: Derived, tmp_path: Path) -> None:
    real = Real(derived)
    source = """
#include <math.h>
#include <stdio.h>
typedef double real;
typedef struct { double K; } capsule_constants;
typedef capsule_constants segment;
static double num(double a) { return a; }
static double add(double a, double b) { return a + b; }
static double sub(double a, double b) { return a - b; }
static double mul(double a, double b) { return a * b; }
static double mad(double a, double b, double c) { return a * b + c; }
"""
    source += C(derived).function(SWAPPED)
    source += "".join(map(real.function, (ONE, ROW, NAMED, DOUBLED)))
    source += """
int main(void)
{
    const capsule_constants c = {3.0};
    const swapped_results s = swapped(&c, 0.5, 2.0);
    double by[2], a, b;
    row(&c, 2.0, by);
    named(&c, 2.0, &a, &b);
    printf("%.17g %.17g ", s.x, s.y);
    printf("%g %g %g %g %g %g\\n", one(&c, 2.0), by[0], by[1], a, b, doubled(&c, 2.0));
    return 0;
}
"""
    (tmp_path / "main.c").write_text(source, encoding="utf-8")
    program = tmp_path / "main"
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function"]
    subprocess.run(["cc", *strict, tmp_path / "main.c", "-lm", "-o", program], check=True)
    done = subprocess.run([program], capture_output=True, text=True, check=True)
    values = [float(word) for word in done.stdout.split()]
    assert values[:2] == pytest.approx(expected(0.5, 2.0, 3.0), rel=1e-15)
    assert values[2:] == [7.0, 4.0, 1.0, 4.0, 1.0, 4.0]


NUMBERS: dict[str, Any] = {
    **{"add": operator.add, "sub": operator.sub, "mul": operator.mul, "over": operator.truediv},
    **{"mad": lambda a, b, c: a * b + c, "neg": operator.neg, "num": float},
}
VALUES = {parameter: 0.3 + 0.2 * i for i, parameter in enumerate(PARAMETERS)}


def evaluated(text: str) -> float:
    """An expression of the parameters, printed in any language."""
    plain = re.sub(r"\.(?=[*/^])|\w+(->|\.)(?=[a-z])", "", text).replace("^", "**")
    return float(eval(plain, NUMBERS | {p.name: value for p, value in VALUES.items()}))


def cases(text: str) -> dict[int, str]:
    """Assignments in a switch by a field's number."""
    return {int(n): body for n, body in re.findall(r"case (\d)(.*?)(?=    case|\Z)", text, re.S)}


@pytest.mark.parametrize("name", ["segment_constants", "field_constants"])
def test_constants_are_those_of_the_fields(derived: Derived, name: str) -> None:
    found = cases(C(derived).texts()[name])
    for segment in SEGMENTS:
        pairs = re.findall(r"c(?:->|\.)(\w+) = ([^;]*);", found[segment.index])
        values = {key: evaluated(value) for key, value in pairs}
        assert (values.pop("contact"), values.pop("drift")) == (segment.contact, segment.drift)
        expected = {str(key): float(v.subs(VALUES)) for key, v in segment_constants(segment.index)}
        assert values == pytest.approx(expected, rel=1e-14)


def test_no_two_backends_write_one_file_and_no_template_is_left_over() -> None:
    paths = [path for backend in BACKENDS for path in backend.files]
    assert len(paths) == len(set(paths))
    used = {name for backend in (*BACKENDS, Shared) for name in backend.files.values()}
    assert {path.name for path in CODEGEN.rglob("*.in")} == used


@pytest.mark.long
def test_every_text_of_a_backend_stands_in_a_template(derived: Derived) -> None:
    common = set(Language.texts(Python(derived)))
    for kind in (*BACKENDS, Shared):
        backend = kind(derived)
        named = {name for text in backend.templates().values() for name in text.get_identifiers()}
        assert backend.texts().keys() - named - common == set(), kind


ADDED = """
from typing import ClassVar

from capsule_sym.codegen._backend import Language
from capsule_sym.codegen._blocks import segment_constants
from sympy.printing.julia import JuliaCodePrinter


class Julia(Language):
    printer = JuliaCodePrinter({"user_functions": {"expm1": "expm1"}})
    comment = "#"
    files: ClassVar = {"jl/kernels.jl": "kernels.jl.in"}

    def function(self, kernel):
        given = ", ".join(("c", *kernel.arguments))
        results = ", ".join(map(self.expression, kernel.results))
        return f"function {kernel.name}({given})\\n{self.body(kernel)}    {results}\\nend\\n"

    def texts(self):
        kernels = "\\n".join(map(self.function, self.derived.shared[1:]))
        return {**super().texts(), "kernels": kernels}
"""


def test_a_backend_is_a_folder_and_a_line(derived, tmp_path, monkeypatch) -> None:
    folder = tmp_path / "julia"
    folder.mkdir()
    (folder / "__init__.py").write_text(ADDED, encoding="utf-8")
    (folder / "kernels.jl.in").write_text(
        "$marked_header\nterms() = $series_terms\n$kernels", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(tmp_path)
    added = importlib.import_module("julia").Julia
    monkeypatch.setattr(_render, "BACKENDS", (added,))
    monkeypatch.setattr(_render, "derive", lambda *_: derived)
    files = _render.render()
    assert files.keys() == {"jl/kernels.jl", "manifest.json"}
    text = files["jl/kernels.jl"]
    assert text.startswith("# Generated.\n# Inputs.\nterms() = 24\nfunction overdamped(c, h)\n")
    assert text.count("\nfunction ") == len(derived.shared) - 1
    assert "oscillating" in json.loads(files["manifest.json"])["operations"]


LANGUAGES = r"numpy|mpmath|matlab|octave|cython|c99|python|c|[#%]|//"


def test_nothing_but_a_backend_knows_a_language() -> None:
    for path in CODEGEN.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            values = (getattr(node, name, None) for name in ("id", "attr", "value", "module"))
            words = [word for value in values if isinstance(value, str) for word in value.split()]
            if not isinstance(getattr(node, "value", None), str) or len(words) == 1:
                assert not any(re.fullmatch(LANGUAGES, word, re.I) for word in words), path.name


def test_what_is_loaded_to_derive_is_in_the_digest() -> None:
    """All modules but those that only name their package."""
    code = (
        "import sys; from capsule_sym.codegen import _render; "
        "print(*(m.__file__ for n, m in sys.modules.items() if n.startswith('capsule_sym')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    counted = {*map(str, _render.sources())}
    loaded = {*done.stdout.split()} - counted
    assert {Path(path).parent.name for path in loaded} <= {"capsule_sym", "_symbolic"}
    assert {Path(path).name for path in loaded} == {"__init__.py"}
    assert {str(path) for path in CODEGEN.rglob("*.in")} < counted
