import pytest


@pytest.fixture(autouse=True)
def _by_the_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    """These tests are about the readable map, whose segments the C core's are compared with."""
    monkeypatch.setattr("capsule_sym._map.backend._is_compiled", lambda _: False)
