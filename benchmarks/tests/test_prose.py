"""The linter of English: each rule reports its bad example, at its line, and nothing else."""

import pytest

from benchmarks import prose

RULES = {rule["name"]: rule["example"] for rule in prose.style()["rule"]}
GOOD = {
    ".py": 'x = "What"  # Error bound of (22)\n"""Number of cells, `tells` is a name."""\n',
    ".c": "/* First root of the guard.\n * Its error is that of (4). */\nint asks(void);\n",
    ".md": "# What is a basin?\n\n```sh\nasks tells\n```\n\nThe fit did not converge.\n",
}


@pytest.mark.parametrize("name", RULES)
def test_rule_reports_its_example(name):
    (fault,) = prose.faults(RULES[name])
    assert fault[1].check_path == f"house.{name}"


@pytest.mark.parametrize("suffix", GOOD)
def test_code_and_plain_sentences_pass(suffix):
    assert not prose.faults(prose.prose(GOOD[suffix], suffix))


@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        (".py", 'x = 1\n"""How the cells\nended."""\n'),
        (".py", 'x = 1\noption("The core asks for it.")\n'),
        (".pyx", "x = 1\n# Whether it is so\n"),
        (".c", "int x;\n/* It goes\n * on. */\n"),
        (".toml", 'a = 1\ndoc = "The gap in words."\n'),
        (".md", "# A page\nThe fit tells the gap.\n"),
    ],
)
def test_bad_sentence_is_found_at_its_line(suffix, text):
    assert [line for line, _ in prose.faults(prose.prose(text, suffix))] == [2]


def test_linter_fails_on_a_bad_file(tmp_path, monkeypatch, capsys):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "page.md").write_text("One.\n\nWhat is left goes on.\n")
    monkeypatch.setattr(prose, "ROOT", tmp_path)
    assert prose.main("docs") == 1
    assert "docs/page.md:3: house.continue" in capsys.readouterr().out
    assert prose.main("README") == 0
