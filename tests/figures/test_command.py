"""`capsule-sym figure`: in this process, and as one of its own where that makes a difference."""

from __future__ import annotations

import contextlib
import io
import re
import subprocess
import sys
from pathlib import Path

import pytest

from capsule_sym._cli import main


def run_here(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """The command in this process, which has imported already what it draws with."""
    out, err = io.StringIO(), io.StringIO()
    with (
        contextlib.chdir(cwd),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as ended,
    ):
        main(arguments)
    status = int(ended.value.code or 0)
    return subprocess.CompletedProcess(arguments, status, out.getvalue(), err.getvalue())


def call(*arguments: str, cwd: Path, code: str = "") -> subprocess.CompletedProcess[str]:
    program = ["-c", code] if code else ["-m", "capsule_sym"]
    return subprocess.run(
        [sys.executable, "-W", "error", *program, *arguments],
        capture_output=True,
        encoding="utf-8",
        cwd=cwd,
        check=False,
    )


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ("fig99 --out x.png", "fig99"),
        ("b.json --out x.jpg", "out = 'x.jpg': must be a file name that ends in .png, .svg, .pdf"),
        ("b.json", "--out"),
        ("folder b.json --out x.png", "folder is drawn alone: leave b.json out"),
        ("b.json folder --out x.png", "folder is drawn alone: leave b.json out"),
        ("folder --out x.png", "'folder': must be a directory that `branch`, `curve`, `sweep` or"),
        ("b.json --of loud --out x.png", "loud"),
        ("b.json --curve b.json --out x.png", "--curve is for sweeps, which b.json is not"),
        ("b.json --out x.png", "RESULT = 'b.json'"),
        ("b.json --out b.json/x.png", "'--out': 'b.json/x.png' cannot be written"),
    ],
)
def test_bad_input_is_one_line_and_status_2(tmp_path: Path, arguments: str, part: str) -> None:
    (tmp_path / "b.json").write_text("{}")
    (tmp_path / "folder").mkdir()
    done = run_here("figure", *arguments.split(), cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert re.fullmatch(r"error: .*\n", done.stderr)
    assert part in done.stderr
    assert len(list(tmp_path.iterdir())) == 2


def test_help_draws_nothing(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom capsule_sym._cli import main\ntry:\n    main(sys.argv[1:])\n"
        "finally:\n    print(sorted({m.split('.')[0] for m in sys.modules}), file=sys.stderr)"
    )
    done = call("figure", "--help", cwd=tmp_path, code=code)
    assert done.returncode == 0
    assert not {"matplotlib", "numpy", "jinja2"} & set(re.findall(r"\w+", done.stderr))


def test_a_figure_is_written_and_pyplot_stays_out(tmp_path: Path) -> None:
    branch = ["branch", "--alpha", "0.9:0.95", "--points", "2", "--out", "b"]
    assert run_here(*branch, cwd=tmp_path).returncode == 0
    code = (
        "import sys\nfrom capsule_sym._cli import main\ntry:\n    main(sys.argv[1:])\n"
        "finally:\n    print('LOADED', 'matplotlib.pyplot' in sys.modules, 'sympy' in sys.modules)"
    )
    done = call("figure", "b", "--out", "new/x.svg", cwd=tmp_path, code=code)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "wrote new/x.svg\n"
    assert done.stdout == "LOADED False False\n"
    assert (tmp_path / "new/x.svg").read_text().startswith("<?xml")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["x.svg"]
