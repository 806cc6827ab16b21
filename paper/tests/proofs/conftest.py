from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

import pytest

from paper.proofs import subdivision as regions


@pytest.fixture(scope="session", autouse=True)
def digested_once() -> Iterator[None]:
    """Lets the code that proves, which no test changes, be read once and not for each file."""
    digest = cache(regions.digest)

    def known(code: Iterable[Any]) -> str:
        return digest(tuple(code))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(regions, "closure", cache(regions.closure))
        patch.setattr(regions, "digest", known)
        yield
