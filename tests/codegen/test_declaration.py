"""A declaration that cannot be derived from is refused with its file and line."""

import ast
import importlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

import pytest
from sympy import Symbol

from capsule_sym import inputs, scenes
from capsule_sym._cli import group
from capsule_sym._sweeps.quantities import TAKEN
from capsule_sym._symbolic.model.declaration import SHIPPED, BadDeclaration, Model, home, load
from capsule_sym._symbolic.model.names import problem
from capsule_sym.codegen.backends.python.facts import documented

ZETA: dict[str, Any] = {
    **{"name": "zeta", "default": 0.05, "between": (0, 1), "label": "damping", "definition": "c"},
    **{"about": "Damping.", "slider": (0, 1, 0.1)},
}
UNFIT: list[tuple[str, tuple[Any, ...], str]] = [
    (
        "name",
        ("NAN", "INFINITY", "M_PI", "INT_MAX", "errno", "NaN", "linux", "size_t", "Py_None"),
        "macro or a type",
    ),
    (
        "name",
        ("scene", "points", "help", "own_stop", "to_dict", "period", "outcome", "add", "count"),
        "in use for something else",
    ),
    (
        "name",
        ("bool", "nullptr", "new", "cdef", "let", "typeof", "asm", "match", "é", "1x", "", 3),
        "no name in C, Python, TypeScript",
    ),
    (
        "label",
        ("a\nb", "a\u2028b", "\ud800", "a\0", "a\x1b[2J", "", 3, None),
        "the label .* is no text of one line",
    ),
    ("about", ("a\tb",), "the about .* is no text of one line"),
    ("label", ("damping " * 10,), "longer than 60"),
    ("tex", (3,), "the tex 3 is no text"),
    ("slider", ((), (0, 1), 3, None, "abc"[:2]), "the slider of zeta is 3 numbers"),
    ("slider", ((1, 0, 0.1), (0, 1, 0), (0, 0, 1)), "least, largest and step"),
    ("slider", (("a", 1, 2), (0, 1e999, 1), "abc"), "3 numbers|not finite"),
    ("default", ("a", None, 1e999, Symbol("q")), "not finite"),
]
CAPSULE = home("capsule")
IN_FULL = Path(__file__).with_name("in_full.py")
TEXT = IN_FULL.read_text(encoding="utf-8")

FREE = 'model.region("NC", x_r < delta, stiffness=0)'
HELD = 'model.region("C", x_r > delta, stiffness=beta)'
WRONG = [
    ("2 * zeta * v_r", "2 * zetta * v_r", "name 'zetta' is not defined"),
    (
        "model.mass(alpha * cos(omega * tau) - P)",
        "model.mass(alpha * cos(omega * tau) - P - Symbol('q'))",
        "unknown symbol q",
    ),
    (
        'model.region("C", x_r > delta,',
        'model.region("C", x_r**2 > delta,',
        "not affine in x_r, v_r, v_c",
    ),
    ('model.region("C", x_r > delta,', 'model.region("C", x_r > delta + 1,', "no way from NC to C"),
    ('model.rest("S", P < f_b,', 'model.rest("S", P < 2 * f_b,', "no way from S to FD or BD"),
    ('"zeta", 0.05, (0, 1e4),', '"zeta", 0.05,', "parameter zeta has no range"),
    ('"zeta", 0.05, (0, 1e4),', '"zeta", -0.05, (0, 1e4),', "zeta = -0.05 is not in [0, 10000]"),
    ("2 * zeta * v_r", "2 * zeta * v_r**2", "the interaction force is linear in x_r and v_r"),
    (f"{FREE}\n{HELD}", f"{HELD}\n{FREE}", "the first region is x_r < delta"),
    ("stiffness=0)", "stiffness=beta)", "with stiffness=0: no spring acts"),
    (
        '"delta", 0.02, (0, 1e10),',
        '"delta", 0.02, (-1, 1e10),',
        "delta ranges from -1, but a gap is at least 0",
    ),
    ("stiffness=beta)", "stiffness=x_r)", "no polynomial >= 0 of parameters"),
    ("2 * zeta * v_r", "1.9 * zeta * v_r", "1.9 is no double of at most 15 digits"),
    (
        "2 * zeta * v_r",
        "(1 + 2.0**-30) * zeta * v_r",
        "1.0000000009313226 is no double of at most 15",
    ),
    ("2 * zeta * v_r", "(2**60 + 1) * zeta * v_r / 2**60", "/1152921504606846976 is no double"),
    ("2 * zeta * v_r", "2 * (zeta + beta) * v_r", "is not zeta times a number above 0, at most 2"),
    (
        "stiffness=beta)",
        "stiffness=beta + zeta)",
        "the stiffness beta + zeta is not a parameter times what is above 0",
    ),
    (
        'model.drift("BD", v_c < 0, against=f_b)',
        'model.drift("BD", v_c < 0, against=1)',
        "1 is no parameter above 0",
    ),
    (
        "model.capsule(gamma, P)",
        "model.capsule(gamma, P - alpha * cos(omega * tau) / 2)",
        "all of that",
    ),
    (
        'model.rest("S", P < f_b, P > -f_b)',
        'model.rest("S", P - alpha * cos(omega * tau) < f_b, P > -f_b)',
        "no way from S to FD or BD",
    ),
    ("model.mass(alpha * cos(omega * tau) - P)", "model.mass(1)", "forces"),
    (
        "model.interaction(x_r + 2 * zeta * v_r + kappa * (x_r - delta))",
        "model.interaction(0)",
        "the interaction force is linear",
    ),
    ('model.region("NC", x_r < delta,', 'model.region("NC", True,', "True is no strict inequality"),
    (
        "model.interaction(x_r + ",
        "model.interaction(x_r * cos(tau) + ",
        "the interaction force is linear",
    ),
    (
        "2 * zeta * v_r + kappa",
        "2 * zeta * v_r + kappa**2 * x_r + kappa",
        "the interaction force is linear",
    ),
    ("2 * zeta * v_r", "2 * zeta * v_r / delta", "polynomials of the parameters"),
    ("2 * zeta * v_r", "2 * (zeta - beta) * v_r", "coefficients > 0 and >= 0"),
    ('"zeta", 0.05,', '"x_r", 0.05,', "is in use"),
    ('"zeta", 0.05,', '"K", 0.05,', "is in use"),
    ('"zeta", 0.05,', '"lambda", 0.05,', "no name in C"),
    ('"zeta", 0.05,', '"Alpha", 0.05,', "letters of any case"),
    ("(1e-6, 1e6)", "(0, 1e6)", "omega has to be > 0"),
    ('"alpha", 0.7, (0, 1e10)', '"alpha", 0.7, (-1, 1e10)', "alpha has to be >= 0"),
    ('"zeta", 0.05, (0, 1e4)', '"zeta", 0.05, (0, 1e999)', "not finite"),
    (
        "kappa = model.stiffness",
        'model.drift("FD", v_c > 0, against=f_b); kappa = model.stiffness',
        "said before the interaction",
    ),
    ('si="P_d / P_f"', 'si="P_0 / P_f"', "alpha = P_0 / P_f: unknown symbol P_0"),
    ('si="k2 / k1",', 'definition="k2 / k1",', "beta has no relation, si, to the device"),
    ('si="Omega / Omega0"', 'si="Omega * Omega0"', "omega = Omega * Omega0 is not in numbers"),
    ('"mu * (M_m + M_c) * g"', '"mu * (M_m + M_c)"', "P_f = mu * (M_m + M_c) is not in N"),
    ('"P_f / k1"', '"P_f / k1 + g"', "x_0 = P_f / k1 + g is not in m"),
    (
        'si="P_d / P_f"',
        'si="P_d ** 2"',
        "is not made of names, numbers, + - * /, sqrt and brackets",
    ),
    ('si="k2 / k1"', 'si="k2 /"', "is no arithmetic"),
    (
        'model.unit("length_scale",',
        'model.quantity("F_0", "N", (0, 1), default=0, label="F", about="F", slider=(0, 1, 1)); '
        'model.unit("length_scale",',
        "F_0 is in no relation",
    ),
    (
        'model.unit("length_scale",',
        'model.quantity("F_0", "N", (0, 1), 0, label="F", about="F", slider=(0, 1, 1)); '
        'model.unit("length_scale",',
        "F_0 has no default, and stands after g, which has one",
    ),
    ('"N s/m"', '"lb/m"', "lb is none of kg, m, s, rad, N"),
    (
        'model.unit("length_scale",',
        'model.unit("volume",',
        "one unit of each of friction_force, natural_frequency, length_scale, not volume",
    ),
    (
        '"mu", "", (1e-9, 1e6)',
        '"zeta", "", (1e-9, 1e6)',
        "zeta is a name of the model and of the device",
    ),
    ('"mu", "", (1e-9, 1e6), 0.2', '"mu", "", (1e-9, 1e6), -0.2', "mu = -0.2 is not in"),
    ('model.drift("BD", ', 'model.drift("FD", ', "FD is the name of two"),
    (
        "model.capsule(gamma, P)",
        "model.capsule(gamma, P, weight=gamma)",
        "the weight is 0, by the bias on the mass, not gamma",
    ),
    ('model.drift("BD", v_c < 0, against=f_b)\n', "\n", "rest and drift backward"),
]


def declared(folder: Path, old: str, new: str) -> tuple[Path, int]:
    """A declaration with a text changed, and the line of that."""
    text = TEXT.replace("from sympy import cos", "from sympy import Symbol, cos  # noqa: F401")
    assert text.count(old) == 1
    path = folder / "model.py"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path, text[: text.index(old)].count("\n") + 1


def test_a_capsule_of_shared_parts_is_that_in_full() -> None:
    shared, full = load(CAPSULE), load(IN_FULL)
    assert [one.name for one in shared.parameters][-1] == "f_b"
    for name in ("parameters", "quantities", "units", "state_labels", "force", "mass_force"):
        assert getattr(shared, name) == getattr(full, name), name


def test_a_parameter_that_would_not_compile_or_would_lie_is_refused() -> None:
    for fact, values, said in UNFIT:
        for value in values:
            with pytest.raises(BadDeclaration, match=said):
                Model().parameter(**ZETA | {fact: value})
    assert Model().parameter(**ZETA).name == "zeta"


@pytest.mark.parametrize("text", ['d"""', 'damping "', "C:\\n", "\\alpha", "δ"])
def test_any_text_can_be_documented(text: str) -> None:
    assert ast.literal_eval(documented(text)) == text


def test_what_is_said_once_is_refused_a_second_time() -> None:
    model = load(CAPSULE)
    x_r = model.state[0]
    for said, act in (
        ("a second mass", lambda: model.mass(1)),
        ("a second capsule", lambda: model.capsule(model.inertia, model.force)),
        ("a second interaction", lambda: model.interaction(x_r)),
        ("a second state", model.states),
        ("a second rest", lambda: model.rest("R", x_r > 0)),
        ("the region is said after", lambda: model.region("B", x_r < 0, stiffness=0)),
        ("quantity k1 is declared twice", lambda: model.device(k1=1)),
    ):
        with pytest.raises(BadDeclaration, match=rf"^.*{Path(__file__).name}:\d+: {said}"):
            act()


SHARED = [
    ("f_b=1.0", "f_a=1.0", "no part has a parameter f_a"),
    ("f_b=1.0", "mu=1.0", "no part has a parameter mu"),
    ("k2=75", "k_front=75", "no part has a quantity k_front"),
    (
        "FRICTION, {",
        '{"f_b": FRICTION["f_b"], "mu": FRICTION["mu"]}, {',
        "no part has a unit friction_force",
    ),
    ("zeta=0.05", "zeta=-0.05", "zeta = -0.05 is not in [0, 10000]"),
]


@pytest.mark.parametrize(("old", "new", "said"), SHARED, ids=[said for *_, said in SHARED])
def test_a_wrong_use_of_parts_is_refused_with_its_line(old, new, said, tmp_path) -> None:
    text = CAPSULE.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path = tmp_path / "model.py"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(BadDeclaration, match=r"model\.py:\d+: ") as refused:
        load(path)
    assert said in str(refused.value)
    word = "model.device(" if "device" in said or "quantity" in said or "unit" in said else "system"
    line = int(str(refused.value).split(":")[1])
    lines = path.read_text(encoding="utf-8").splitlines()
    assert word in "".join(lines[line - 2 : line])


@pytest.mark.parametrize(("old", "new", "said"), WRONG, ids=[said for *_, said in WRONG])
def test_a_wrong_declaration_is_refused_with_its_line(old, new, said, tmp_path) -> None:
    path, line = declared(tmp_path, old, new)
    with pytest.raises(BadDeclaration) as refused:
        load(path)
    text = str(refused.value)
    assert said in text
    assert "\n" not in text
    place, number, _ = text.split(":", 2)
    assert place == str(path)
    assert abs(int(number) - line) <= 1


def test_stops_that_meet_by_the_defaults_are_refused(tmp_path: Path) -> None:
    text = CAPSULE.with_name("prototype.py").read_text(encoding="utf-8")
    path = tmp_path / "model.py"
    for name in ("delta_1", "delta_2"):
        text = re.sub(rf"\b{name}=[0-9.]+", f"{name}=0.0", text)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadDeclaration, match="no room is between -delta_2 and delta_1"):
        load(path)


def test_a_device_without_one_of_its_units_is_refused(tmp_path: Path) -> None:
    path, _ = declared(tmp_path, 'model.unit("length_scale",', '("length_scale",')
    with pytest.raises(BadDeclaration, match="the device has no length_scale"):
        load(path)


def test_names_in_generated_code_are_refused() -> None:
    """All names in functions into which a parameter is unpacked, but those of parameters."""
    own, found = set(), set()
    for scene in SHIPPED:
        own |= {one.name for one in load(home(scene)).parameters}
        for file in ("kernels.py", "formulas.py"):
            text = (CAPSULE.parents[3] / "generated" / scene / file).read_text(encoding="utf-8")
            for body in ast.walk(ast.parse(text)):
                if isinstance(body, ast.FunctionDef):
                    found |= {body.name, *(one.arg for one in body.args.args)}
                    found |= {one.id for one in ast.walk(body) if isinstance(one, ast.Name)}
    assert len(found) > 150
    assert not [name for name in sorted(found - own) if "in use" not in problem(name, "parameter")]


def test_names_of_options_results_and_members_are_refused() -> None:
    shipped = [scenes.load(one).facts for one in SHIPPED]
    own = {name for facts in shipped for name in (*facts.PARAMETERS, *facts.DEVICE)}
    found = {*dir(inputs.SceneParameters), *TAKEN}
    for entry in group.commands.values():
        module = importlib.import_module(entry.module)
        made = getattr(module, entry.name.replace("-", "_")).of_line([])
        flags = (flag.lstrip("-") for one in made.params for flag in one.opts)
        found |= {flag.replace("-", "_") for flag in flags} | {one.name for one in made.params}
    public = {name for name in found - own if name[0] != "_" and name[0].islower()}
    assert len(public) > 80
    assert not [name for name in sorted(public) if not problem(name, "parameter")]
    of_devices = {name for name in dir(scenes.slope.PhysicalParameters) if name[0] != "_"} - own
    assert not [name for name in sorted(of_devices) if not problem(name, "quantity")]


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_macros_of_the_headers_of_c_and_python_are_refused() -> None:
    names = ("complex", "errno", "float", "iso646", "limits", "math", "stdbool", "stdio", "stdlib")
    headers = "".join(f"#include <{name}.h>\n" for name in names)
    if os.path.exists(include := sysconfig.get_path("include")):
        headers += "#include <Python.h>\n"
    command = ["cc", "-std=gnu11", "-dM", "-E", f"-I{include}", "-"]
    done = subprocess.run(command, input=headers, capture_output=True, text=True, check=True)
    macros = set(re.findall(r"^#define ([A-Za-z]\w*) ", done.stdout, re.MULTILINE))
    assert len(macros) > 500
    for kind in ("parameter", "quantity"):
        assert not [name for name in sorted(macros) if not problem(name, kind)]


def test_a_model_without_a_declaration_names_its_file(tmp_path: Path) -> None:
    for text, said in (
        ("from capsule_sym.codegen import *\nmodel = Model()\n", "nothing is said of the state"),
        ("", "declares no Model named model"),
        ("model = 3\n", "declares no Model named model"),
        ("import nowhere\n", "No module named 'nowhere'"),
    ):
        path = tmp_path / "empty.py"
        path.write_text(text, encoding="utf-8")
        with pytest.raises(BadDeclaration) as refused:
            load(path)
        assert str(refused.value) == f"{path}:1: {said}"


def test_the_generator_says_it_in_one_line_and_writes_nothing(tmp_path: Path) -> None:
    path, line = declared(tmp_path, "2 * zeta * v_r", "2 * zetta * v_r")
    command = [sys.executable, "-m", "capsule_sym.codegen", "--scene", path]
    done = subprocess.run(
        [*command, "--out", tmp_path / "out"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"error: {path}:{line}: name 'zetta' is not defined\n"
    assert not (tmp_path / "out").exists()
