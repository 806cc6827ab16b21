from tests.figures.conftest import branch, here, settled, store  # noqa: F401
