"""Files of measurements in the dialects of spreadsheets, loggers and programs."""

import codecs
from pathlib import Path

import numpy as np
import pytest

from capsule_sym import InvalidInput, inputs

TIMES, VALUES = [0.0, 0.5, 1.25, 2000.125], [0.0125, -1.5, 1234.5, np.nan]
PLAIN = "t,x_m\n0,0.0125\n0.5,-1.5\n1.25,1234.5\n2000.125,\n"
GERMAN = "t;x_m\n0;0,0125\n0,5;-1,5\n1,25;1234,5\n2000,125;\n"
MILLI = "0,12.5\n500,-1500\n1250,1234500\n2000125,-\n"
READ = [
    PLAIN,
    PLAIN.replace("\n", "\r\n"),
    PLAIN.replace("\n", "\r"),
    PLAIN.replace("\n", "\n\n"),
    PLAIN.replace(",", " , "),
    PLAIN.replace(",", "|"),
    PLAIN.replace("\n", ",\n"),
    PLAIN.replace("\n", ",\n").replace("x_m,", "x_m"),
    PLAIN.replace("t,x_m", '"Time","X_m"'),
    "\ufeff" + PLAIN,
    "# 5 Hz, 2 cameras\n" + PLAIN.replace("0.5", "% pause\n0.5"),
    "# " + PLAIN.replace(",\n", ",nan\n").replace(",", " "),  # as numpy.savetxt writes it
    GERMAN,
    GERMAN.replace(";", "\t"),
    GERMAN.replace("0,0125", "1,25E-2"),
    '"' + GERMAN[:-2].replace(";", '","').replace("\n", '"\n"') + '",\n',
    "sep=;\n" + GERMAN,
    "t [ms], x_m (mm)\n" + MILLI,
    "t/ms,x_m/mm\n" + MILLI,
    "time_ms,x_m_mm\n" + MILLI,
    "t [ms]  x_m [mm]\n" + MILLI.replace(",", "  "),
    "Time (ms);x_m (µm)\n0;12500\n500;-1500000\n1250;1234500000\n2000125;\n",
]


@pytest.mark.parametrize("text", READ)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_dialects_are_detected(text: str, encoding: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    found = inputs.read_measured(tmp_path / "a.csv")
    assert list(found) == ["t", "x_m"]
    np.testing.assert_allclose(found["t"], TIMES, rtol=1e-14)
    np.testing.assert_allclose(found["x_m"], VALUES, rtol=1e-14)


def test_one_line_says_what_was_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes("t [s];x_m [µm];x_c\n0;1;2\n".encode("latin-1"))
    assert inputs.read_measured(tmp_path / "a.csv").message == "1 row: t in s, x_m in μm, x_c"
    (tmp_path / "a.csv").write_bytes(codecs.BOM_UTF16_BE + GERMAN.encode("utf-16-be"))
    assert inputs.read_measured(tmp_path / "a.csv").message == "4 rows: t, x_m"


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("t;x_m\n1;1.2\n2;5,678\n", "x_m in row 3 = '5,678': must be a number with the"),
        ("t;x_m\n0,5;1,2\n1,5;1.7\n", "x_m in row 3 = '1.7': .* of the others, a comma"),
        ('t,x_m\n1,"1,234.5"\n', "x_m in row 2 = '1,234.5': must be a number"),
        ("t,x_m\n0,1\n1\n", "row 3 = '1'"),
        ("t,x_m\n0,1,0,5\n", "row 2"),
        ("# rate\n\nt;x_m\n0;1\n1;2 mm\n", "x_m in row 5 = '2 mm'"),
        ("t;x_m\n0;1\n2,5;2\n1,5;3\n", "t in row 4 = 1.5: must be after 2.5"),
        ("t;x_m\n0;1\nnan;2\n", "t in row 3"),
        ("t,x_m\n0,1_0\n", "x_m in row 2"),
        ("t;x_m\n0;1.2.3\n", "x_m in row 2"),
        ("0,1\n1,2\n", "header in row 1"),
        ("x_m,x_c\n0,1\n", "columns = 'x_m, x_c': must be t and"),
        (",t,x_m\n0,0,1\n", "column = ''"),
        ("t [mm],x_m [mm]\n0,1\n", "unit of t = 'mm': must be one of s"),
        ("t [s],x_m [s]\n0,1\n", "unit of x_m = 's': must be one of m"),
        ("A" * 140_000, "file = .*: must be a table of numbers"),
    ],
)
def test_what_is_not_clear_is_refused_with_its_place(text: str, named: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InvalidInput, match=named):
        inputs.read_measured(tmp_path / "a.csv")
