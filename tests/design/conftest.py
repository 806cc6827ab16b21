"""Commands of design, called in a folder with a device."""

import pytest

from capsule_sym._cli import main

DEVICE = """M_m = 0.5\nM_c = 1.65\nk1 = 50\nk2 = 75\nc = 0.5\nG = 0.0017\nP_d = 3.0
Omega = 8.0\nmu = 0.2
"""


@pytest.fixture
def call(capfd, tmp_path, monkeypatch):
    """Runs a command in a folder; gives status, stdout and the lines of stderr."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "device.toml").write_text(DEVICE)

    def run(*arguments: str):
        with pytest.raises(SystemExit) as done:
            main(list(arguments))
        shown = capfd.readouterr()  # what LAPACK prints too
        return done.value.code, shown.out, shown.err.splitlines()

    return run
