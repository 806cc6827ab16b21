"""`capsule-sym figure`: in this process, and as one of its own where that makes a difference."""

from __future__ import annotations

import contextlib
import io
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from capsule_sym._cli import main
from capsule_sym._figures.catalogue import FIGURES


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
        ("motion --out x.jpg", "out = 'x.jpg': must be a file name that ends in .png, .svg, .pdf"),
        ("motion", "--out"),
        ("motion margins --out x.png", "motion is drawn alone: leave margins out"),
        ("motion --of v_c --out x.png", "--of is for branches, which motion is not"),
        ("motion --out x.png --gamma -1", "gamma = -1.0"),
        ("motion --out x.png --colours loud", "loud"),
    ],
)
def test_bad_input_is_one_line_and_status_2(tmp_path: Path, arguments: str, part: str) -> None:
    done = run_here("figure", *arguments.split(), cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert re.fullmatch(r"error: .*\n", done.stderr)
    assert part in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_path_that_cannot_be_written_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = run_here("figure", "motion", "--out", "file/x.png", cwd=tmp_path)
    assert done.returncode == 2
    assert "'--out': 'file/x.png' cannot be written" in done.stderr


def test_help_lists_every_name_and_draws_nothing(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom capsule_sym._cli import main\ntry:\n    main(sys.argv[1:])\n"
        "finally:\n    print(sorted({m.split('.')[0] for m in sys.modules}), file=sys.stderr)"
    )
    done = call("figure", "--help", cwd=tmp_path, code=code)
    assert done.returncode == 0
    for name in FIGURES:
        assert re.search(rf"^ +{name} ", done.stdout, re.M)
    assert not {"matplotlib", "numpy", "jinja2"} & set(re.findall(r"\w+", done.stderr))


def test_a_figure_is_written_and_pyplot_stays_out(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom capsule_sym._cli import main\ntry:\n    main(sys.argv[1:])\n"
        "finally:\n    print('LOADED', 'matplotlib.pyplot' in sys.modules, 'sympy' in sys.modules)"
    )
    done = call("figure", "motion", "--out", "new/x.svg", cwd=tmp_path, code=code)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "wrote new/x.svg\n"
    assert done.stdout == "LOADED False False\n"
    assert (tmp_path / "new/x.svg").read_text().startswith("<?xml")


def test_the_data_are_written_beside_the_figure(tmp_path: Path) -> None:
    line = ("figure", "motion", "--out", "x.png", "--dpi", "30", "--data", "--json")
    done = run_here(*line, cwd=tmp_path)
    sizes = {name: (tmp_path / name).stat().st_size for name in ("x.png", "x.csv")}
    files = [{"path": name, "bytes": size} for name, size in sizes.items()]
    assert json.loads(done.stdout) == {"figure": "motion", "files": files}
    assert (tmp_path / "x.csv").read_text().startswith("panel,x_label,y_label,series,x,y,z\n1,")


def test_nothing_but_the_figure_is_written_where_one_is(tmp_path: Path) -> None:
    here = tmp_path / "here"
    here.mkdir()
    assert run_here("figure", "margins", "--out", "x.png", "--dpi", "30", cwd=here).returncode == 0
    assert [path.name for path in here.iterdir()] == ["x.png"]
