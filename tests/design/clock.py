"""A clock for limits of time that no machine's speed moves."""

import re

from capsule_sym._native import watch

LIMIT = 1e6


class Clock:
    """Time that advances little until `progress` gets a certain text, then passes LIMIT."""

    def __init__(self, monkeypatch, text: str) -> None:
        self.text, self.now = text, 0.0
        monkeypatch.setattr(watch, "perf_counter", self.look)

    def look(self) -> float:
        self.now += 1e-6
        return self.now

    def progress(self, told: str) -> None:
        if re.search(self.text, told):
            self.now = 2 * LIMIT
