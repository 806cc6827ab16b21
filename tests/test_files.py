"""Files are written whole or not at all."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from capsule_sym._errors import InvalidInput
from capsule_sym._files import whole, write_whole

posix = pytest.mark.skipif(sys.platform == "win32", reason="links, modes and pipes of POSIX")
# A disk with room for 1000 bytes more, to a process that is told so instead of ended.
FULL = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
"""


def content(folder: Path) -> dict[str, str]:
    """The text of every file in a folder, hidden ones too."""
    return {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}


def cut(path: Path, problem: type[BaseException]) -> None:
    """Begin to write a file, and fail."""
    path.write_text("fragm", encoding="utf-8")
    raise problem


def test_a_file_and_its_folders_are_written(tmp_path: Path) -> None:
    write_whole(tmp_path / "a" / "b" / "new.txt", "Σ\n")
    assert (tmp_path / "a" / "b" / "new.txt").read_bytes() == "Σ\n".encode()
    write_whole(tmp_path / "a" / "b" / "new.txt", b"\xff")
    assert (tmp_path / "a" / "b" / "new.txt").read_bytes() == b"\xff"
    assert [path.name for path in (tmp_path / "a" / "b").iterdir()] == ["new.txt"]


@pytest.mark.parametrize("problem", [KeyboardInterrupt, ValueError, MemoryError])
def test_what_was_there_stays_where_writing_is_cut(
    tmp_path: Path, problem: type[BaseException]
) -> None:
    write_whole(tmp_path / "kept.txt", "good")
    with pytest.raises(problem), whole(tmp_path / "kept.txt") as part:
        cut(part, problem)
    assert content(tmp_path) == {"kept.txt": "good"}


@posix
def test_sigterm_in_mid_write_leaves_the_good_file(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys\n"
        "from capsule_sym._files import whole\n"
        "with whole(sys.argv[1]) as part:\n"
        "    part.write_text('fragm')\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
    )
    write_whole(tmp_path / "kept.txt", "good")
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "kept.txt"], check=False)
    assert done.returncode == -signal.SIGTERM
    assert (tmp_path / "kept.txt").read_text(encoding="utf-8") == "good"


@posix
def test_a_full_disk_is_an_input_that_is_refused(tmp_path: Path) -> None:
    code = (
        "import sys\n"
        "from capsule_sym._files import write_whole\n"
        "try:\n"
        "    write_whole(sys.argv[1], 2000 * 'x', 'certify')\n"
        "except ValueError as error:\n"
        "    print(error)\n"
    )
    write_whole(tmp_path / "kept.txt", "good")
    done = subprocess.run(
        [sys.executable, "-c", FULL + code, "kept.txt"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "certify = 'kept.txt': must be writable (File too large)\n"
    assert content(tmp_path) == {"kept.txt": "good"}


@posix
def test_a_link_is_followed_and_the_mode_kept(tmp_path: Path) -> None:
    there, link = tmp_path / "there.txt", tmp_path / "link.txt"
    write_whole(there, "old")
    there.chmod(0o640)
    link.symlink_to(there.name)
    write_whole(link, "new")
    assert link.is_symlink()
    assert there.read_text(encoding="utf-8") == "new"
    assert stat.S_IMODE(there.stat().st_mode) == 0o640
    link.unlink()
    link.symlink_to("nothing.txt")
    write_whole(link, "first")
    assert content(tmp_path) == {"there.txt": "new", "link.txt": "first", "nothing.txt": "first"}


@posix
def test_a_pipe_is_written_as_it_is(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text(encoding="utf-8")))
    reader.start()
    write_whole(pipe, "told")
    reader.join()
    assert read == ["told"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@posix
def test_standard_output_is_written_as_it_is() -> None:
    code = "from capsule_sym._files import write_whole; write_whole('/dev/stdout', 'told')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "told"


def test_a_folder_or_what_lies_below_a_file_is_refused(tmp_path: Path) -> None:
    write_whole(tmp_path / "file", "good")
    for path in (tmp_path, tmp_path / "file" / "below"):
        with pytest.raises(InvalidInput, match=r"^out = .*: must be writable \("):
            write_whole(path, "text")
    assert content(tmp_path) == {"file": "good"}


@posix
@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write anywhere")
def test_a_file_that_may_not_be_changed_is_refused(tmp_path: Path) -> None:
    write_whole(tmp_path / "kept.txt", "good")
    (tmp_path / "kept.txt").chmod(0o440)
    with pytest.raises(InvalidInput, match="Permission denied"):
        write_whole(tmp_path / "kept.txt", "new")
    assert content(tmp_path) == {"kept.txt": "good"}
