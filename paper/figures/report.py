"""The case study as one page of HTML: tables from saved results, figures drawn for it."""

from __future__ import annotations

import io
import platform
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from capsule_sym import InvalidInput, NotInstalled, Parameters
from capsule_sym import _explorer as explorer
from capsule_sym._files import read_json
from capsule_sym._records import write as write_texts
from capsule_sym.figures import figure_style
from capsule_sym.generated.capsule import DIGEST
from paper.figures.catalogue import FIGURES
from paper.printed import read
from paper.processes import end, spawning, undisturbed
from paper.study.casestudy import GAMMAS, THRESHOLDS
from paper.study.motions import Study, Track

EXPLORER = "explorer.html"
"""Name of the explorer's page beside the report."""

RESULTS = Path("results")
_BENCH = RESULTS / "bench" / "bench.json"
_PART = _BENCH.with_name("part.json")  # of a quick study, or one with some of the tools
SOURCES = {
    "cases": (RESULTS / "paper/casestudy.json", "python -m paper case-study --out results/paper"),
    "proofs": (RESULTS / "verify.json", "python -m paper"),
    "hard": (RESULTS / "hardcases.json", "python -m paper"),
    "bench": (_BENCH, "python -m benchmarks bench --out results/bench"),
}
"""Files whose results are shown, each with the command that writes it."""

_PRECISION = (
    "Work against precision",
    "A hollow marker: switches were missed or invented at that setting.",
    "Error over time per period on logarithmic axes, a curve with markers for each tool and way to "
    "use it.",
)
_VERSIONS = ("capsule-sym", "numpy", "scipy", "mpmath", "sympy", "matplotlib")
_RESOLUTION = 160  # of what is dots, in each inch
_PLAIN = " /:;=,.()+-!?@*_[]{}|"  # characters that an address of data holds as they are
_LONGEST = "chart"  # of the figures in the making

_Wanted = tuple[str, float]  # a figure's name, and gamma


class Picture(NamedTuple):
    """A figure of the page: what it shows, a data URI and its size, and the command that draws it.

    `alt` is the text alternative.
    """

    title: str
    caption: str
    alt: str
    source: str
    width: int
    height: int
    command: str


def write(path: Path, track: Track, workers: int = 1) -> None:
    """Write the page, and the explorer to which it links beside it as `explorer.html`.

    `workers` processes draw the figures. Each file is written whole or not at all; raises
    InvalidInput when they cannot be written.
    """
    if path.name == EXPLORER:
        raise InvalidInput("--out", str(path), f"a name other than {EXPLORER}, the explorer's")
    write_texts({path.name: page(track, workers), EXPLORER: explorer.page()}, path.parent)


def page(track: Track, workers: int = 1) -> str:
    """The page as text; `workers` processes draw its figures."""
    try:
        from jinja2 import Environment, StrictUndefined
    except ModuleNotFoundError as missing:
        raise NotInstalled(missing) from missing
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"maths": maths, "line_name": _line_name, "number": _number}
    environment.filters |= {"typeset": typeset, "formulas": formulas}
    template = environment.from_string(
        (files(__package__) / "report.html.j2").read_text(encoding="utf-8")
    )
    saved = {name: _load(path) for name, (path, _) in SOURCES.items() if name != "bench"}
    saved["bench"] = _load(bench := measured())
    differing = _differing(saved["proofs"])
    return template.render(
        **saved,
        missing={name: command for name, (_, command) in SOURCES.items()},
        partly=bench != _BENCH,
        parameters=Parameters(),
        gammas=GAMMAS,
        printed_thresholds=THRESHOLDS,
        titles={name: entry.title for name, entry in FIGURES.items()},
        equations=EQUATIONS,
        findings=_findings(saved),
        refuted=[item for item in differing if item["status"] == "refuted"],
        confirmed=[item for item in differing if item["status"] != "refuted"],
        lines=_lines(saved["proofs"]),
        statuses=Counter(item["status"] for item in saved["proofs"]["items"])
        if saved["proofs"]
        else {},
        pictures=_pictures(track, workers),
        precision=_precision(bench.with_suffix(".svg")),
        versions={"python": platform.python_version(), **_versions()},
        digest=DIGEST,
        explorer=EXPLORER,
    )


def measured() -> Path:
    """The file with the times of all tools or, where there is none, that of a part of the study."""
    return _PART if _PART.exists() and not _BENCH.exists() else _BENCH


def _precision(path: Path) -> list[Picture]:
    """The picture that the bench has written, if there is one."""
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    size = re.search(r'width="([\d.]+)pt" height="([\d.]+)pt"', text)
    wide, high = (round(float(points) * 96 / 72) for points in size.groups()) if size else (0, 0)
    return [Picture(*_PRECISION, _data_uri(text), wide, high, SOURCES["bench"][1])]


def _load(path: Path) -> Any:
    return read_json(path, "JSON", "results") if path.exists() else None


def _versions() -> dict[str, str]:
    found = {}
    for name in _VERSIONS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def _differing(proofs: Mapping[str, Any] | None) -> list[Mapping[str, Any]]:
    """Results on printed statements that do not hold exactly as printed."""
    items = proofs["items"] if proofs else []
    return [item for item in items if item.get("printed") and item["derived"] != "as printed"]


def _findings(saved: Mapping[str, Any]) -> list[str]:
    """Results, in a sentence each; missing ones are left out."""
    found = []
    cases, proofs, hard = saved["cases"], saved["proofs"], saved["hard"]
    if cases:
        for gamma in GAMMAS:
            own = [case for case in cases["cases"] if case["parameters"]["gamma"] == gamma]
            agree = sum(case["agrees"] for case in own)
            found.append(
                f"At γ = {gamma} the exact map gives the printed global map in {agree} of "
                f"{len(own)} panels of Fig. 7."
            )
        if cases.get("bifurcations"):
            said = cases["bifurcations"]["conclusion"].removesuffix(".").split(". ")
            found += [f"{sentence}." for sentence in said]
    if proofs:
        statuses = Counter(item["status"] for item in proofs["items"])
        told = ", ".join(f"{count} {status}" for status, count in statuses.items())
        found.append(f"Of {len(proofs['items'])} statements put to proof, {told}.")
    if hard:
        passed = sum(case["verdict"] == "ok" for case in hard["cases"])
        found.append(
            f"{passed} of {len(hard['cases'])} hard cases end as 50 digits have them, no switch "
            "missed and none invented."
        )
    return found


def _lines(proofs: Mapping[str, Any] | None) -> list[tuple[str, list[Mapping[str, Any]]]]:
    """The places of the paper in their order, each with the statements about what it prints."""
    found: dict[str, list[Mapping[str, Any]]] = {entry.place: [] for entry in read()}
    for item in proofs["items"] if proofs else []:
        if item.get("printed"):
            found.setdefault(item["equation"], []).append(item)
    return list(found.items())


def _pictures(track: Track, workers: int) -> dict[str, list[Picture]]:
    """The figures by name, one for each gamma where they depend on it."""
    wanted = [
        (name, gamma)
        for name, entry in FIGURES.items()
        for gamma in (GAMMAS if entry.by_gamma else GAMMAS[:1])
    ]
    found: dict[str, list[Picture]] = {}
    with _drawing(wanted, track, workers) as drawn:
        for one in track(wanted, _told, len(wanted)):
            found.setdefault(one[0], []).append(next(drawn))
    return found


@contextmanager
def _drawing(wanted: list[_Wanted], track: Track, workers: int) -> Iterator[Iterator[Picture]]:
    """The pictures in their order, each computed and drawn on request, or in the background."""
    if workers == 1:
        yield (_picture(one, track) for one in wanted)
        return
    executor = spawning(min(workers, len(wanted)))
    try:
        with undisturbed():
            # The one that takes longest is begun first.
            first = sorted(wanted, key=lambda one: one[0] != _LONGEST)
            under_way = {one: executor.submit(_picture, one) for one in first}
        yield (under_way[one].result() for one in wanted)
    finally:
        end(executor)


def _picture(one: _Wanted, track: Track = lambda items, text, total: items) -> Picture:
    from capsule_sym._figures.interface import on_page

    name, gamma = one
    entry = FIGURES[name]
    title, command = entry.title, f"python -m paper figure {name} --out {name}.svg"
    if entry.by_gamma:
        title, command = f"{title}, γ = {gamma}", f"{command} --gamma {gamma}"
    drawn = entry.make(Study(track, Parameters(gamma=gamma)))
    uri, size = _data_uri(_svg(drawn)), on_page(drawn)
    return Picture(title, entry.caption, entry.seen, uri, *size, command)


def _told(one: _Wanted) -> str:
    name, gamma = one
    return f"Drawing {name}, γ = {gamma}" if FIGURES[name].by_gamma else f"Drawing {name}"


def _svg(figure: Any) -> str:
    """A figure as curves."""
    text = io.StringIO()
    with figure_style():
        figure.savefig(text, format="svg", dpi=_RESOLUTION, metadata={"Date": None})
    return text.getvalue()


def _data_uri(picture: str) -> str:
    """An SVG as an address that holds it, without what nobody can see."""
    # Paths to a hundredth of a point, which no screen and no print can show.
    short = re.sub(r'(?<= d=")[^"]+', lambda path: re.sub(r"(?<=\.\d{2})\d+", "", path[0]), picture)
    return f"data:image/svg+xml,{quote(short, safe=_PLAIN)}"


def maths(text: str) -> Any:
    """The text with its subscripts and superscripts, such as P_{Σ5,F2,Σ2}, as HTML."""
    from markupsafe import Markup, escape

    marked = str(escape(text))
    # A name of several letters with an underscore, such as one_way, is no symbol.
    marked = re.sub(r"(?<![A-Za-z])([A-Za-zΑ-ω])_(\w+)", r"\1_{\2}", marked)
    marked = re.sub(r"_\{([^}]*)\}", r"<sub>\1</sub>", marked)
    marked = re.sub(r"\^\{?\(?(\d)\)?\}?", r"<sup>(\1)</sup>", marked)
    return Markup(marked)


def _line_name(line: str) -> Any:
    """A line's name such as L2^(1) as HTML."""
    return maths(re.sub(r"^([LO])(\d+)", r"\1_{\2}", line))


def _number(value: float | None, form: str) -> str:
    """A number as text, a dash where there is none."""
    return "–" if value is None else form % value


EQUATIONS = (
    (
        "Forces between mass and capsule, without and with contact of the second spring",
        r"P_3 = x_r + 2 \zeta v_r, \qquad P_4 = P_3 + \beta (x_r - \delta)",
    ),
    ("Relative motion, in all fields", r"x_r' = v_r"),
    (
        "Stick, F2 and F5, with P_3 and P_4 as P",
        r"v_r' = -P + \alpha \cos \omega \tau, \qquad v_c' = 0, \qquad |P| \le f_b",
    ),
    (
        "Forward drift, F1 and F4",
        r"v_r' = -\frac{\gamma + 1}{\gamma} P + \frac{f_b}{\gamma} + \alpha \cos \omega \tau, "
        r"\qquad v_c' = \frac{P - f_b}{\gamma}",
    ),
    (
        "Backward drift, F3 and F6",
        r"v_r' = -\frac{\gamma + 1}{\gamma} P - \frac{f_b}{\gamma} + \alpha \cos \omega \tau, "
        r"\qquad v_c' = \frac{P + f_b}{\gamma}",
    ),
)
"""Eqs. (7)-(12) of the paper, each with its meaning."""


def formulas(line: str) -> Any:
    """A line of text with its formulas as MathML."""
    from markupsafe import Markup

    from capsule_sym._symbolic.theory import text
    from paper.claims.formulas import with_formulas

    # Each scrolls by itself where it is wider than the screen.
    formula = Markup('<span class="formula">{}</span>')
    parts = enumerate(with_formulas(line, text).split("$"))
    shown = (formula.format(typeset(part, False)) if at % 2 else maths(part) for at, part in parts)
    return Markup("").join(shown)


def typeset(formula: str, as_block: bool = True) -> Any:
    """A formula of LaTeX as MathML, on a line of its own or within one."""
    try:
        from docutils.utils.math.latex2mathml import tex2mathml
        from markupsafe import Markup
    except ModuleNotFoundError as missing:
        raise NotInstalled(missing) from missing
    return Markup(tex2mathml(formula, as_block=as_block))
