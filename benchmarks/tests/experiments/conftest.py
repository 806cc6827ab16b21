import pytest

from tests.scenes import Integrator, integrator


@pytest.fixture(scope="session")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Integrator:
    """The integrator of the equations of motion alone, compiled."""
    return integrator(tmp_path_factory.mktemp("judge"))
