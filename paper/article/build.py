"""Write the journal paper and the note on Section 4 from records of `make paper` and `enclose`.

The texts are `paper.md.in` and `note.tex.in`; numbers come from records.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from collections import Counter
from decimal import ROUND_DOWN, Decimal
from math import ceil, log10
from pathlib import Path
from typing import Any

import jinja2

HERE = Path(__file__).parent
DIGITS = Decimal("1e-12")
DATE = "24 November 2026"


def cut(number: str) -> str:
    """The decimals of an enclosed number, cut after twelve."""
    return str(Decimal(number).quantize(DIGITS, rounding=ROUND_DOWN))


def power(number: float, text: str = "{}") -> str:
    """Exponent of the power of ten that is an upper bound of a number, in TeX."""
    return text.format(ceil(log10(number)))


def scientific(number: float) -> str:
    """A number with two digits, in TeX."""
    mantissa, exponent = f"{number:.1e}".split("e")
    return rf"{mantissa}\cdot 10^{{{int(exponent)}}}"


def tex_line(line: str) -> str:
    """A line's name such as `L3^(2)` in TeX."""
    name, _, part = line.partition("^")
    return f"{name[0]}_{{{name[1:]}}}" + (f"^{{{part}}}" if part else "")


def deviation(thresholds: list[dict[str, Any]]) -> str:
    """Largest distance of a printed bifurcation value, in per cent of the exact one."""
    return f"{max(abs(t['printed'] / t['exact'] - 1) for t in thresholds) * 100:.2f}"


def sections(study: dict[str, Any], enclosed: dict[str, Any]) -> list[dict[str, Any]]:
    """Bifurcations of each mass ratio: enclosed and printed values, by growing alpha."""
    found = []
    for section in enclosed["sections"]:
        known = [t for t in study["thresholds"] if t["gamma"] == float(section["gamma"])]
        rows = []
        for proved, located in zip(section["thresholds"], known, strict=True):
            same = (proved["type"], proved["line"]) == (located["type"], located["line"])
            if not same or abs(float(proved["alpha"]) - located["exact"]) > 1e-9:
                sys.exit(f"the records differ in {located['type']} on {located['line']}")
            rows.append(
                {
                    "type": proved["type"],
                    "line": tex_line(proved["line"]),
                    "order": proved["order"],
                    "coefficient": f"{float(proved['coefficient']):.5f}",
                    "alpha": cut(proved["alpha"]),
                    "printed": located["printed"],
                    "place": located["printed_place"],
                    "radius": proved["radius"],
                }
            )
        found.append({"gamma": section["gamma"], "rows": rows, "known": known})
    return found


def numbers(
    casestudy: dict[str, Any], enclosed: dict[str, Any], verdicts: Counter[str]
) -> dict[str, Any]:
    """Everything the templates name, from the records."""
    if any(section["failed"] or not section["intervals"] for section in enclosed["sections"]):
        sys.exit("enclose.json has unproved steps: finish `python -m paper enclose --json`")
    shown = sections(casestudy["bifurcations"], enclosed)
    printed_gamma, other = shown
    if (printed_gamma["gamma"], other["gamma"]) != ("3.3", "3.0"):
        sys.exit("the templates are about the mass ratios 3.3 and 3.0")
    last = printed_gamma["rows"][-3:]
    by_place = sorted(printed_gamma["rows"], key=lambda row: row["place"])
    cases = [
        [c for c in casestudy["cases"] if str(c["parameters"]["gamma"]) == s["gamma"]]
        for s in shown
    ]
    away = [[c for c in group if not c["at_printed_threshold"]] for group in cases]
    parameters = casestudy["cases"][0]["parameters"]
    rows = [row for section in shown for row in section["rows"]]
    intervals = [i for section in enclosed["sections"] for i in section["intervals"]]
    return {
        "date": DATE,
        "sections": shown,
        "count": len(rows),
        "radius": power(max(row["radius"] for row in rows)),
        "last": [row["alpha"][:8] for row in last],
        "last_types": [row["type"] for row in last],
        "printed_types": [row["type"] for row in by_place[-3:]],
        "deviation33": deviation(printed_gamma["known"]),
        "deviation30": deviation(other["known"]),
        "order": [cut(c["gamma"])[:8] for c in enclosed["codimension_two"]],
        "crossings": [
            {"type": c["type"], "alpha": cut(c["alpha"]), "gamma": cut(c["gamma"])}
            for c in enclosed["codimension_two"]
        ],
        "statements": sum(verdicts.values()),
        **{status: verdicts[status] for status in ("proved", "conditional", "refuted")},
        "p": {**parameters, "fb": f"{parameters['f_b']:g}"},
        "first": f"{intervals[0]['from']:.3g}",
        "final": f"{intervals[-1]['to']:.3g}",
        "unproved": scientific(sum(s["unproved"] for s in enclosed["sections"])),
        "boxes": sum(i["boxes"] for i in intervals),
        "agree": [sum(c["agrees"] for c in group) for group in cases],
        "away": len(away[0]),
        "agree_away": [sum(c["agrees"] for c in group) for group in away],
    }


def rendered(name: str, values: dict[str, Any]) -> str:
    """The text of a template with its numbers; a name that is missing is an error."""
    environment = jinja2.Environment(
        variable_start_string="<<",
        variable_end_string=">>",
        block_start_string="<%",
        block_end_string="%>",
        loader=jinja2.FileSystemLoader(HERE),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    return environment.get_template(name).render(values)


def _record(path: Path, command: str) -> Any:
    """A record; exits with the command that writes it if it is missing."""
    if not path.exists():
        sys.exit(f"{path} is missing: {command} writes it")
    return json.loads(path.read_text(encoding="utf-8"))


def main() -> None:
    """Write paper.md beside its template, and the note with its figure in the folder given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=Path, default=Path("results"))
    parser.add_argument("--out", type=Path, default=Path("results/article"))
    given = parser.parse_args()
    casestudy, enclosed, verified = (
        _record(given.records / name, command)
        for name, command in (
            ("paper/casestudy.json", "make paper"),
            ("enclose.json", f"python -m paper enclose --json > {given.records}/enclose.json"),
            ("verify.json", "make paper"),
        )
    )
    values = numbers(casestudy, enclosed, Counter(item["status"] for item in verified["items"]))
    (HERE / "paper.md").write_text(rendered("paper.md.in", values), encoding="utf-8")
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "note.tex").write_text(rendered("note.tex.in", values), encoding="utf-8")
    shutil.copy(HERE / "paper.bib", given.out)
    figure = given.out / "bifurcations.pdf"
    command = [sys.executable, "-m", "paper", "figure", "bifurcations", "--out", str(figure)]
    subprocess.run(command, check=True)
    shutil.copy(figure, HERE)
    print(f"wrote {HERE / 'paper.md'}, {given.out / 'note.tex'}, {figure}")
    latex = shutil.which("latexmk")
    if not latex:
        print("latexmk is missing: the note is not typeset")
        return
    command = [latex, "-pdf", "-interaction=nonstopmode", "-halt-on-error", "-quiet", "note.tex"]
    subprocess.run(command, cwd=given.out, check=True)
    print(f"wrote {given.out / 'note.pdf'}")


if __name__ == "__main__":
    main()
