"""`make lines`, on small trees whose counts are known."""

import json
from pathlib import Path

import pytest

from benchmarks import lines


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(lines, "ROOT", tmp_path)
    return tmp_path


def put(tree: Path, name: str, count: int) -> None:
    path = tree / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n" * count)


def test_rooms_are_counted_by_kind_without_what_is_generated(tree: Path) -> None:
    for number, name in enumerate(
        (
            "capsule_sym/_map/run.py",
            "capsule_sym/_native/run.c",
            "capsule_sym/_native/run.h",
            "capsule_sym/_native/_core.pyx",
            "capsule_sym/_commands/branch.py",
            "capsule_sym/_cli.py",
            "capsule_sym/_files.py",
            "capsule_sym/paper.toml",
            "capsule_sym/codegen/backends/c/run.c.in",
            "generated/capsule/c/run.c",
        )
    ):
        put(tree, name, 10**number % 9973)
    (tree / "capsule_sym/generated").symlink_to(tree / "generated")
    put(tree, "capsule_sym/_map/__pycache__/run.py", 5)
    assert {name: dict(counts) for name, counts in lines.lines_by_room().items()} == {
        "_map": {"Python": 1},
        "_native": {"C": 110, "Cython": 1000},
        "codegen": {"templates": 10**8 % 9973},
        "commands": {"Python": 10**4 % 9973 + 10**5 % 9973},
        "the rest": {"Python": 10**6 % 9973},
    }


@pytest.mark.parametrize("name", lines.COMMANDS)
def test_files_of_the_commands_are_there_and_nothing_else_is(name: str) -> None:
    assert (lines.ROOT / "capsule_sym" / name).is_file()
    assert lines.room(lines.ROOT / "capsule_sym" / name) == "commands"
    assert lines.room(lines.ROOT / "capsule_sym/_map" / name) == "_map"


@pytest.mark.parametrize("count", [99, 100])
@pytest.mark.parametrize(
    ("name", "head", "end", "lines_of_it"),
    [
        ("a.py", "@decorated\ndef long(\n    a: int,\n):\n", "", 3),
        ("a.pyx", "cdef int long(int a,\n              int b) except -1:\n", "x = 1\n", 2),
        (
            "a.c",
            "int a;\n/* { */\n#define B(x) { \\\n   x\nstatic int long_one(int a,\n  B b)\n{\n",
            "}\n",
            4,
        ),
        ("a.h", 'int long_one(int (*f)(int), char *s) {\n  g("}");\n', "}\nint b = 1;\n", 3),
    ],
)
def test_functions_are_as_long_as_they_are(
    tree: Path, name: str, head: str, end: str, lines_of_it: int, count: int
) -> None:
    inside = "    a = 1\n" if name.startswith("a.py") else "    if (a) { a = 0; }\n"
    (tree / "capsule_sym").mkdir()
    text = head + inside * (count + 1 - lines_of_it) + end
    (tree / "capsule_sym" / name).write_text(text)
    found = [place.lines for place in lines.long_functions()]
    assert found == ([101] if count == 100 else [])


def test_a_table_of_all_parameters_is_a_home_and_a_list_of_names_is_none() -> None:
    names = ["alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b"]
    facts = [f'    Parameter("{name}", {i}.0),' for i, name in enumerate(names)]
    assert lines.has_facts("\n".join(facts))
    assert lines.has_facts("\n".join(f"{name}: number({i})," for i, name in enumerate(names)))
    assert lines.has_facts("\n".join(f'{n} = parameter(\n    "{n}", 0.5,\n)' for n in names))
    assert not lines.has_facts("\n".join(f"    {name}," for name in names))
    assert not lines.has_facts("\n".join(facts[:-1]))
    assert not lines.has_facts("\n".join(f"c->{name} = {name};" for name in names))
    assert not lines.has_facts("\n".join([*facts[:3], *facts[:4]]))


def test_what_is_counted_of_the_house_is_printed_with_its_places(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for arguments in (["lines", "--json"], ["lines"]):
        monkeypatch.setattr("sys.argv", arguments)
        lines.main()
    text = capsys.readouterr().out
    record, end = json.JSONDecoder().raw_decode(text)
    assert set(lines.GOALS) < set(record)
    assert record["lines"] == sum(sum(room.values()) for room in record["rooms"].values()) > 20_000
    for name, goal in lines.GOALS.items():
        value = record[name] if isinstance(record[name], int) else len(record[name])
        assert f"{value:,}" in text[end:]
        assert f"{goal:,}" in text[end:]
    for place in record["functions over 100 lines"]:
        assert f"{place['path']}:{place['line']}" in text[end:]
    for importer in (*record["circles of imports"], *record["exceptions of the import contract"]):
        assert importer in text[end:]
