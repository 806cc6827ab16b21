"""Runner of the suite of hard events: an integrator against the exact switches of events.json.

    python run_events.py adapters/solve_ivp.py [--kind KIND] [--only TEXT] [--json]

It needs Python 3.11 and NumPy. An adapter is a file with one of these functions (see README.md):

    first_event(field, t, y, end, leaving) -> (t, y, guard) or None
    switches(case) -> [(t, field entered), ...]
"""

import argparse
import difflib
import json
import math
import sys
from collections.abc import Callable, Sequence
from importlib.util import module_from_spec, spec_from_file_location
from itertools import pairwise
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

HERE = Path(__file__).parent
MERGE = 1e-9
"""Switches closer than this are one: only the field after the last of them is compared."""
MOST = 60
"""Switches after which a run counts as locked up."""


class Field:
    """One mode of motion at the parameters of a case: y' = rates(t, y) while all guards > 0."""

    def __init__(
        self, name: str, given: dict[str, Any], system: dict[str, Any], p: dict[str, float]
    ):
        self.name, self.given, self.system, self.parameters = name, given, system, p
        self.contact, self.drift = given["contact"], given["drift"]
        self.guard_names = [guard["name"] for guard in given["guards"]]
        names = [*system["state"], "t", *system["parameters"]]

        def function(expressions: Sequence[str]) -> Callable[..., Any]:
            text = f"lambda {', '.join(names)}: [{', '.join(expressions)}]"
            return eval(text, {"cos": math.cos, "sin": math.sin})  # of the suite's own file

        values = [p[name] for name in system["parameters"]]
        rates = function(given["rates"])
        guards = function([guard["positive"] for guard in given["guards"]])
        self._matrix = function([x for row in given["matrix"] for x in row])
        self._rows = function([x for guard in given["guards"] for x in guard["row"]])
        self._values = values
        self.rates = lambda t, y: rates(*map(float, y), t, *values)
        """Derivatives of the state y at a time t, three numbers."""
        self.guards = lambda t, y: guards(*map(float, y), t, *values)
        """Values of the guards."""

    @property
    def matrix(self) -> np.ndarray:
        """Matrix M (6, 6) of z' = M z for z = (x_r, v_r, v_c, cos(omega t), sin(omega t), 1)."""
        return np.array(self._matrix(0, 0, 0, 0, *self._values), float).reshape(6, 6)

    @property
    def guard_rows(self) -> np.ndarray:
        """Rows (guards, 6): a guard is its row times z."""
        return np.array(self._rows(0, 0, 0, 0, *self._values), float).reshape(-1, 6)

    def after(self, guard: int, t: float, y: np.ndarray) -> str:
        """Name of the field after a guard has fallen to zero; y is put onto the guard's zero."""
        name = self.guard_names[guard]
        if name == "gap":
            y[0] = self.parameters["delta"]
        elif name == "drift":
            y[2] = 0.0
        following = self.given["next"][name]
        if isinstance(following, str):
            return following
        names = dict(zip(self.system["state"], map(float, y), strict=True))
        pull, bound = eval(following["pull"], {}, self.parameters | names), self.parameters["f_b"]
        return following[
            "pull > f_b" if pull > bound else "pull < -f_b" if pull < -bound else "else"
        ]


def load(path: Path = HERE / "events.json") -> dict[str, Any]:
    """Content of the suite."""
    return json.loads(path.read_text(encoding="utf-8"))


def follow(case: dict[str, Any], system: dict[str, Any], first_event: Callable[..., Any]) -> Any:
    """Switches (time, field entered) that an adapter finds in a case."""
    fields = {
        name: Field(name, given, system, case["parameters"])
        for name, given in system["fields"].items()
    }
    t, y = case["start"]["t"], np.array(case["start"]["state"], float)
    field, found = fields[case["start"]["field"]], []
    while len(found) < MOST:
        leaving = tuple(k for k, value in enumerate(field.guards(t, y)) if abs(value) < 1e-14)
        passed = first_event(field, t, y.copy(), case["end"], leaving)
        if passed is None:
            break
        t, y, guard = float(passed[0]), np.array(passed[1], float), int(passed[2])
        field = fields[field.after(guard, t, y)]
        found.append((t, field.name))
    return found


def merged(switches: Sequence[tuple[float, str]]) -> list[tuple[float, str]]:
    """Switches of which those closer than MERGE are one."""
    kept: list[tuple[float, str]] = []
    for t, to in switches:
        if kept and t - kept[-1][0] < MERGE:
            kept[-1] = (kept[-1][0], to)
        else:
            kept.append((t, to))
    return kept


def judge(case: dict[str, Any], found: Sequence[tuple[float, str]]) -> dict[str, Any]:
    """Verdict on the switches of a case: missed, invented, late, and the largest error of a time.

    A time is late that is off by more than a quarter of the way to its neighbours, or to the start.
    """
    exact = merged([(float(one["t"]), one["to"]) for one in case["switches"]])
    given = merged(found)
    names = [[to for _, to in one] for one in (exact, given)]
    missed = invented = late = 0
    for _, a, b, c, d in difflib.SequenceMatcher(None, *names, autojunk=False).get_opcodes():
        same = names[0][a:b] == names[1][c:d]
        missed, invented = missed + (not same) * (b - a), invented + (not same) * (d - c)
    error = None
    if not (missed or invented):
        marks = [case["start"]["t"], *(t for t, _ in exact), math.inf]
        gaps = [max(b - a, MERGE) for a, b in pairwise(marks)]
        errors = [abs(s - t) for (t, _), (s, _) in zip(exact, given, strict=True)]
        late = sum(e > min(gaps[k : k + 2]) / 4 for k, e in enumerate(errors))
        error = max(errors, default=0.0)
    return {"name": case["name"], "kind": case["kind"], "distance": case["distance"],
            "right": not (missed or invented or late), "missed": missed, "invented": invented,
            "late": late, "error": error}  # fmt: skip


def numbers(found: Sequence[Any], fields: Sequence[str]) -> list[tuple[float, str]]:
    """Switches of an adapter, or ValueError where they are no rising times with known fields."""
    switches = [(float(t), to) for t, to in found]
    last = -math.inf
    for t, to in switches:
        if not math.isfinite(t):
            raise ValueError(f"the time of a switch is {t}")
        if t < last - MERGE:
            raise ValueError(f"a switch at {t} follows one at {last}")
        if to not in fields:
            raise ValueError(f"field {to!r} is none of {', '.join(fields)}")
        last = t
    return switches


def check(module: Any, suite: dict[str, Any], chosen: Sequence[Any]) -> list[Any]:
    """Verdicts on some cases by an adapter; one that raises fails the case."""
    verdicts = []
    fields = [*suite["system"]["fields"]]
    for case in chosen:
        began = process_time()
        try:
            if hasattr(module, "switches"):
                found = module.switches({k: v for k, v in case.items() if k != "switches"})
            else:
                found = follow(case, suite["system"], module.first_event)
            verdict = judge(case, numbers(found, fields))
        except KeyboardInterrupt:
            raise SystemExit(f"error: interrupted in case {case['name']!r}") from None
        except Exception as error:  # whatever an integrator raises
            verdict = judge(case, []) | {
                "right": False,
                "failed": f"{type(error).__name__}: {error}",
            }
        verdicts.append(verdict | {"seconds": process_time() - began})
    return verdicts


def show(verdicts: Sequence[dict[str, Any]]) -> None:
    """Table by kind, then tangencies by their distance."""
    print(f"{'kind':26}{'right':>9}  missed  invented  late  failed  largest error")
    for kind in [*dict.fromkeys(one["kind"] for one in verdicts), None]:
        rows = [one for one in verdicts if kind in (None, one["kind"])]
        right = f"{sum(one['right'] for one in rows)} of {len(rows)}"
        sums = [sum(one[name] for one in rows) for name in ("missed", "invented", "late")]
        failed = sum("failed" in one for one in rows)
        error = max((one["error"] for one in rows if one["error"] is not None), default=math.nan)
        counts = f"{sums[0]:>8}{sums[1]:>10}{sums[2]:>6}{failed:>8}"
        print(f"{kind or 'all':26}{right:>9}{counts}{error:>15.1e}")
    near = [one for one in verdicts if one["kind"] == "tangency"]
    if near:
        print("\ntangencies by distance")
    for distance in sorted({one["distance"] for one in near}, reverse=True):
        rows = [one for one in near if one["distance"] == distance]
        print(f"  {distance:<8.0e}{sum(one['right'] for one in rows):>4} of {len(rows)}")
    failures = {one["failed"]: one["name"] for one in reversed(verdicts) if "failed" in one}
    if failures:
        print("\nfailed, each message once, with its first case")
    for message, name in [*reversed(failures.items())][:5]:
        print(f"  {name}: {message}")


def adapter(path: Path) -> Any:
    """The module of an adapter's file."""
    spec = spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise SystemExit(f"error: {path} is no Python file")
    module = module_from_spec(spec)
    sys.path.insert(0, str(HERE))
    try:
        spec.loader.exec_module(module)
    except (ImportError, SyntaxError) as error:
        message = f"error: {path} does not load: {type(error).__name__}: {error}"
        raise SystemExit(message) from None
    if not (hasattr(module, "first_event") or hasattr(module, "switches")):
        raise SystemExit(f"error: {path} has neither first_event nor switches")
    return module


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Check an integrator on the suite of hard events.")
    parser.add_argument("adapter", type=Path)
    parser.add_argument("--kind", default="", help="only this kind of case")
    parser.add_argument("--only", default="", help="only cases with this in their name")
    parser.add_argument("--json", action="store_true", help="print all verdicts as JSON")
    given = parser.parse_args()
    suite = load()
    chosen = [
        case
        for case in suite["cases"]
        if given.kind in ("", case["kind"]) and given.only in case["name"]
    ]
    if not chosen:
        kinds = ", ".join(dict.fromkeys(case["kind"] for case in suite["cases"]))
        parser.error(f"no case is of this kind and name; kinds: {kinds}")
    verdicts = check(adapter(given.adapter), suite, chosen)
    if given.json:
        print(json.dumps({"version": suite["version"], "cases": verdicts}, indent=1))
    else:
        show(verdicts)


if __name__ == "__main__":
    main()
