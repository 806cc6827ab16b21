"""`python -m paper.tests.proofs.tampering`: tampered certificates that a checker accepts."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from capsule_sym._enclosures.certificates import checker
from paper.proofs import second_checker
from paper.tests.proofs.tampering.tampered import KINDS, tampered
from tests.enclosures.certified import produced, refused

RECORD = Path("results/tampering.json")
FEW = {checker: 3, second_checker: 1}  # of a kind and a certificate


def main() -> int:
    """Put some of each kind to both checkers, print those that are accepted, and write a record."""
    trials, accepted, kinds = 0, 0, 0
    for kind in KINDS:
        before = trials
        for module, count in FEW.items():
            for one in tampered(kind, (*produced(),), count):
                trials += 1
                if not refused(one, module):
                    accepted += 1
                    print(f"{module.__name__} accepts {kind}: {json.dumps(one)}")
        kinds += trials > before
    told = {"kinds": kinds, "trials": trials, "accepted": accepted}
    RECORD.parent.mkdir(exist_ok=True)
    RECORD.write_text(json.dumps(told) + "\n", encoding="utf-8")
    print(f"{accepted} of {trials} accepted, {kinds} kinds")
    return int(accepted > 0)


if __name__ == "__main__":
    sys.exit(main())
