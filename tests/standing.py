"""Tests that hang end, if pytest has the options `faulthandler_timeout` and `..._exit_on_timeout`.

pytest itself limits each test, but takes the limit back from the teardown of one that failed, and
has none for the end of a session; xdist takes the death of a worker at that end for a good one.
"""

import faulthandler
from typing import Any

import pytest
from _pytest.faulthandler import fault_handler_stderr_fd_key

_died: list[object] = []


def _limit(config: pytest.Config) -> None:
    if seconds := float(config.getini("faulthandler_timeout")):
        ends, file = config.getini("faulthandler_exit_on_timeout"), fault_handler_stderr_fd_key
        faulthandler.dump_traceback_later(seconds, exit=ends, file=config.stash[file])


def pytest_exception_interact(node: pytest.Item | pytest.Collector) -> None:
    _limit(node.config)


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    _limit(session.config)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(error: Any) -> None:
    if error:
        _died.append(error)


@pytest.hookimpl(wrapper=True)
def pytest_cmdline_main() -> Any:
    status = yield
    return status or bool(_died)
