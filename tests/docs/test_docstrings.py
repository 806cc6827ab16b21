"""Docstrings of public functions: each parameter with its unit and default, and an example."""

import doctest
import inspect
import re

import matplotlib as mpl
import pytest

import capsule_sym as cs
from tests.public import PUBLIC

FUNCTIONS = [name for name, one in PUBLIC.items() if inspect.isfunction(inspect.unwrap(one))]
HEADING = re.compile(r"\n(Parameters|Returns|Raises|Notes|See Also|Examples)\n-+\n")
ENTRY = re.compile(r"^(\*{0,2}[a-zA-Z_][\w, *]*) : (.*)\n((?:    .*\n?|\n)*)", re.M)
UNIT = re.compile(
    r"dimensionless|seconds?\b|periods?\b|radians?\b|\bunits?\b|rad/s|shares?\b|inch|metres?\b"
    r"|\((kg|N|m)[ )/]",
    re.I,
)


def sections(text: str) -> dict[str, str]:
    parts = HEADING.split("\n" + text + "\n")
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def lacks(name: str, parameters: dict[str, inspect.Parameter], text: str) -> list[str]:
    """Parameters, units and defaults that a docstring does not name."""
    entries = {
        one.strip(" *"): f"{head}\n{body}"
        for names, head, body in ENTRY.findall(sections(text).get("Parameters", ""))
        for one in names.split(",")
    }
    found = [f"{name} has no parameter {one}" for one in set(entries) - set(parameters)]
    for one, parameter in parameters.items():
        told = entries.get(one, "")
        if not told:
            found.append(f"{name}: {one} is not named")
        elif re.search("float|array", told.split("\n")[0]) and not UNIT.search(told):
            found.append(f"{name}: {one} has no unit")
        if (
            told
            and parameter.default is not parameter.empty
            and not re.search("default|optional", told)
        ):
            found.append(f"{name}: {one} has no default")
    return found


@pytest.mark.parametrize("name", FUNCTIONS)
def test_each_parameter_is_named_with_its_unit_and_default(name: str) -> None:
    function = PUBLIC[name]
    text = inspect.getdoc(function) or ""
    assert lacks(name, dict(inspect.signature(function).parameters), text) == []
    assert {"Returns", "Examples"} <= set(sections(text))


def test_what_a_docstring_lacks_is_found() -> None:
    def drawn(speed: float, count: int = 3) -> None: ...

    good = (
        "Parameters\n----------\nspeed : float\n    In SI units.\ncount : int, default 3\n    So."
    )
    given = dict(inspect.signature(drawn).parameters)
    assert lacks("drawn", given, good) == []
    for old, new, found in (
        ("In SI units", "Fast", "speed has no unit"),
        ("In SI units", "A number", "speed has no unit"),
        ("count :", "counts :", "count is not named"),
        (", default 3", "", "count has no default"),
        ("count :", "count, other :", "no parameter other"),
    ):
        assert any(found in one for one in lacks("drawn", given, good.replace(old, new)))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_each_example_runs(name: str) -> None:
    function = inspect.unwrap(PUBLIC[name])
    (example,) = doctest.DocTestFinder(recurse=False).find(function, name, globs={})
    assert example.examples
    with mpl.rc_context({"backend": "agg"}):
        assert doctest.DocTestRunner().run(example).failed == 0


@pytest.mark.parametrize("kind", [cs.Parameters, cs.PhysicalParameters])
def test_each_field_is_named_with_its_unit(kind: type) -> None:
    fields = dict(inspect.signature(kind).parameters)
    assert lacks(kind.__name__, fields, inspect.getdoc(kind) or "") == []
    source, told = inspect.getsource(kind.scene.dataclasses), " ".join((kind.__doc__ or "").split())
    for name in fields:
        meaning = re.search(rf'^    {name}: float[^\n]*\n    """(.*?)"""', source, re.M | re.S)
        assert meaning
        assert " ".join(meaning[1].split()) in told
        if name in kind.scene.facts.RANGES:
            assert ", {:.10g} to {:.10g} ".format(*kind.scene.facts.RANGES[name]) in told
