"""Files are written whole or not at all."""

import os
import signal
import stat
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click
import pytest
from matplotlib.figure import Figure

from capsule_sym import InvalidInput, figures
from capsule_sym._cli import _status, group
from capsule_sym._commands.values import WritablePath
from capsule_sym._explorer import page
from capsule_sym._files import growing, read_json, whole, write_whole

posix = pytest.mark.skipif(sys.platform == "win32", reason="links, modes and pipes of POSIX")


@contextmanager
def full_disk(room: int = 40) -> Iterator[None]:
    """Files of this process may have so many bytes; writes beyond fail without ending it."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    compiles, sys.dont_write_bytecode = sys.dont_write_bytecode, True  # a cut one would stay
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        yield
    finally:
        sys.dont_write_bytecode = compiles
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


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
def test_what_was_there_stays_where_writing_is_cut(tmp_path, problem) -> None:
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
    kept = tmp_path / "kept.txt"
    write_whole(kept, "good")
    with full_disk(), pytest.raises(InvalidInput) as error:
        write_whole(kept, 100 * "x", "certify")
    assert str(error.value) == f"certify = {str(kept)!r}: must be writable (File too large)"
    assert content(tmp_path) == {"kept.txt": "good"}


def draw(path: Path) -> None:
    """A figure with text, in a file."""
    figure = Figure(figsize=(1, 1))
    figure.text(0.5, 0.5, "alpha")
    figures.save_figure(figure, path)


@pytest.mark.parametrize("ending", [".pdf", ".svg"])
def test_a_date_of_the_environment_does_not_matter(ending, tmp_path, monkeypatch) -> None:
    written = []
    for date in ("abc", "1" * 30, "86400"):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", date)
        figures.save_figure(Figure(), tmp_path / f"a{ending}")
        written.append((tmp_path / f"a{ending}").read_bytes())
        assert os.environ["SOURCE_DATE_EPOCH"] == date
    assert written[0] == written[1] == written[2]


def command(line: str) -> Callable[[Path], None]:
    """A command line, with the file at its end."""

    def run(path: Path) -> None:
        status = _status([*line.split(), str(path)])
        if status == 2:
            raise InvalidInput("out", str(path), "writable")

    return run


WRITERS = [
    ("a.svg", draw),
    ("a.png", draw),
    ("a.pdf", draw),
    ("a.html", command("explore --no-open --out")),
    ("a.json", command("run --periods 2 --certify")),
]


@posix
@pytest.mark.parametrize(("name", "write"), WRITERS, ids=[name for name, _ in WRITERS])
def test_what_is_written_leaves_the_good_file_on_a_full_disk(name, write, tmp_path, capsys) -> None:
    write_whole(tmp_path / name, "good")
    with full_disk(), pytest.raises(InvalidInput, match="must be writable"):
        write(tmp_path / name)
    assert content(tmp_path) == {name: "good"}
    assert capsys.readouterr().err.count("\n") <= 1


@posix
def test_a_log_keeps_its_lines_on_a_full_disk_and_without_a_torn_one(tmp_path: Path) -> None:
    log = tmp_path / "new" / "log"
    with growing(log, "out", "begin\n") as add:
        add("one\n")
    log.write_text("begin\none\ntw", encoding="utf-8")
    with growing(log, "out", "begin\n") as add:
        add("two\n")
        assert log.read_text(encoding="utf-8") == "begin\none\ntwo\n"
    with (
        full_disk(room=10),
        pytest.raises(InvalidInput, match="must be writable"),
        growing(log, "out") as add,
    ):
        add("three\n")
    assert log.read_text(encoding="utf-8") == "begin\none\ntwo\n"


@pytest.mark.parametrize(
    "text", ["{", "\udcff", 100_000 * "[" + 100_000 * "]"], ids=["cut", "bytes", "deep"]
)
def test_json_that_is_none_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(text, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(InvalidInput, match=r"must be JSON$"):
        read_json(path, "JSON")
    for line in ("figure FILE --out a.svg", "figure s --curve FILE --out a.svg"):
        assert _status(line.replace("FILE", str(path)).split()) == 2


def test_every_file_to_write_is_looked_at_before_work_begins() -> None:
    context = click.Context(group)
    commands = [group.resolve_command(context, [name])[1] for name in group.commands]
    files = [
        (command.name, one.name)
        for command in commands
        if command
        for one in command.params
        if one.name in ("out", "certify", "region", "from_rest")
        and not isinstance(one.type, WritablePath)
    ]
    assert files == []


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
    line = [sys.executable, "-m", "capsule_sym", "explore", "--no-open", "--out", "/dev/stdout"]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    assert done.stdout == f"{page()}/dev/stdout\n"


def test_a_folder_or_what_lies_below_a_file_is_refused(tmp_path: Path) -> None:
    write_whole(tmp_path / "file", "good")
    for path in (tmp_path, tmp_path / "file" / "below"):
        with pytest.raises(InvalidInput, match=r"^out = .*: must be writable \("):
            write_whole(path, "text")
    assert content(tmp_path) == {"file": "good"}


@posix
def test_a_link_to_itself_is_refused_and_stays(tmp_path: Path) -> None:
    link = tmp_path / "link.txt"
    link.symlink_to(link.name)
    with pytest.raises(InvalidInput, match="symbolic links"):
        write_whole(link, "text")
    with pytest.raises(click.BadParameter, match=r"link.txt' cannot be written"):
        WritablePath(file=True).convert(str(link), None, None)
    assert link.is_symlink()


@posix
@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write anywhere")
def test_a_file_that_may_not_be_changed_is_refused(tmp_path: Path) -> None:
    write_whole(tmp_path / "kept.txt", "good")
    (tmp_path / "kept.txt").chmod(0o440)
    with pytest.raises(InvalidInput, match="Permission denied"):
        write_whole(tmp_path / "kept.txt", "new")
    assert content(tmp_path) == {"kept.txt": "good"}
