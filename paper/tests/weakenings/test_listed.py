"""Lists of weakenings that cannot rot."""

from __future__ import annotations

from collections import Counter
from importlib import import_module
from pathlib import Path

import pytest

from paper.tests.weakenings.listed import Weakening, listed

LISTED = listed()


def test_names_are_different() -> None:
    names = Counter(one.name for one in LISTED)
    assert max(names.values()) == 1, names.most_common(1)


@pytest.mark.parametrize("one", LISTED, ids=lambda one: one.name)
def test_a_weakening_changes_one_text_and_names_a_test(one: Weakening) -> None:
    compile(one.weakened, one.file, "exec")
    assert one.find != one.put
    file, _, name = one.test.partition("::")
    module = import_module(".".join(Path(file).with_suffix("").parts))
    assert callable(getattr(module, name.partition("[")[0]))
