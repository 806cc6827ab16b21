"""Lists of weakenings that cannot rot."""

from __future__ import annotations

from collections import Counter
from importlib import import_module
from pathlib import Path

from paper.tests.weakenings.listed import listed

LISTED = listed()


def test_names_are_different() -> None:
    names = Counter(one.name for one in LISTED)
    assert max(names.values()) == 1, names.most_common(1)


def test_every_weakening_changes_one_text_and_names_a_test() -> None:
    for one in LISTED:
        compile(one.weakened, one.file, "exec")
        assert one.find != one.put, one.name
        file, _, name = one.test.partition("::")
        module = import_module(".".join(Path(file).with_suffix("").parts))
        assert callable(getattr(module, name.partition("[")[0], None)), one.name
