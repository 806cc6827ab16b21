from tests.figures.conftest import branch, here, settled  # noqa: F401
