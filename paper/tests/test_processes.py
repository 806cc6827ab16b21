"""Worker processes, and the Ctrl-C that is not theirs."""

import os
import signal

import pytest

from paper.processes import undisturbed


def test_ctrl_c_waits_while_processes_start_and_is_not_theirs() -> None:
    before = signal.getsignal(signal.SIGINT)
    blocked = []
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012 (what comes after the signal is the point)
        with undisturbed():
            blocked.append(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))
            os.kill(os.getpid(), signal.SIGINT)
            blocked.append(True)
        blocked.append(False)
    assert blocked == [True, True]
    assert signal.getsignal(signal.SIGINT) is before
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
