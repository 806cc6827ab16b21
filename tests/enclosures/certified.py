"""Certificates put to the checker, and certificates with a digit changed."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator

from capsule_sym._enclosures.certificates import checker


def rejected(certificate: dict) -> bool:
    try:
        checker.check_certificate(certificate)
    except checker.Rejected:
        return True
    return False


def digits_changed(certificate: dict, count: int) -> Iterator[dict]:
    text = json.dumps({k: v for k, v in certificate.items() if k != "about"})
    rng = random.Random(11)
    for place in rng.sample([i for i, c in enumerate(text) if c.isdigit()], count):
        digit = rng.choice([d for d in "0123456789" if d != text[place]])
        yield json.loads(text[:place] + digit + text[place + 1 :].replace("NaN", "0"))
