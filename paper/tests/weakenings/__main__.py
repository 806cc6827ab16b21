"""Each weakening applied alone: `python -m paper.tests.weakenings --only fields`.

Results are appended to a file, a line each, so that interrupted work resumes; those of other code
or of other tests are not counted. Survivors are printed, and end with status 1.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from paper.tests.weakenings.applied import NAME
from paper.tests.weakenings.listed import ROOT, Weakening, digest, listed

LIMIT = 300.0  # seconds after which a test is given up
NOTICED, PASSED = 1, 0  # statuses of pytest


def tried(tests: Sequence[str], weakening: str | None = None) -> str:
    """Outcome of some tests, with a weakening or without: noticed, survived, or what went wrong."""
    words = ["-x", "-q", "-p", "paper.tests.weakenings.applied", "-p", "no:cacheprovider", "-m", ""]
    environment = os.environ | ({NAME: weakening} if weakening else {})
    try:
        run = subprocess.run(
            [sys.executable, "-m", "pytest", *words, *tests],
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no end in {LIMIT:g} s"
    if run.returncode in (NOTICED, PASSED):
        return "noticed" if run.returncode == NOTICED else "survived"
    return f"pytest ended with {run.returncode}: {run.stdout[-300:]}{run.stderr[-300:]}"


def known(path: Path, code: str) -> dict[tuple[str, ...], str]:
    """Outcomes in a file that hold for this code."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    records = [json.loads(line) for line in lines]
    return {tuple(one["weakening"]): one["outcome"] for one in records if one["code"] == code}


def shown(outcomes: dict[Weakening, str]) -> int:
    """Print the survivors, and how many there are."""
    left = {one: outcome for one, outcome in outcomes.items() if outcome != "noticed"}
    for one, outcome in left.items():
        print(f"{one.name} ({one.file}; {one.test}): {outcome}")
    print(f"{len(outcomes)} weakenings, {len(left)} survive")
    return int(bool(left))


def main() -> int:
    """Apply each weakening, and try the test that has to fail."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--only", default="", help="part of a name, a file or a test")
    parser.add_argument("--out", type=Path, default=ROOT / "results" / "weakenings.jsonl")
    given = parser.parse_args()
    chosen = [one for one in listed() if any(given.only in text for text in one)]
    if not chosen:
        parser.error(f"no weakening has {given.only!r} in its name, file or test")
    given.out.parent.mkdir(parents=True, exist_ok=True)
    code, begin = digest(), time.perf_counter()
    done = known(given.out, code)
    left = [one for one in chosen if done.get((*one,)) != "noticed"]
    if left and (outcome := tried(sorted({one.test for one in left}))) != "survived":
        print(f"a test fails without any weakening: {outcome}")
        return 1
    outcomes = dict.fromkeys(chosen, "noticed")
    with given.out.open("a", encoding="utf-8") as file:
        for number, one in enumerate(left, 1):
            print(f"{number}/{len(left)} {one.name}", file=sys.stderr)
            outcomes[one] = tried([one.test], one.name)
            record = {"weakening": one, "code": code, "outcome": outcomes[one]}
            file.write(json.dumps(record) + "\n")
            file.flush()
    print(f"{time.perf_counter() - begin:.0f} s for {len(left)} of them")
    if not given.only:
        survive = sum(outcome != "noticed" for outcome in outcomes.values())
        told = {"weakenings": len(outcomes), "survive": survive}
        given.out.with_suffix(".json").write_text(json.dumps(told) + "\n", encoding="utf-8")
    return shown(outcomes)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
