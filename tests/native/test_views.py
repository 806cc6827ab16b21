"""The binding's views of records."""

import re
from pathlib import Path

import capsule_sym._native

SOURCE = Path(capsule_sym._native.__file__).with_name("_binding.pyx")


def test_bytes_are_signed_where_char_is_not() -> None:
    """NumPy's "i1" is signed; a plain char is not on ARM, where such a view would be refused."""
    text = SOURCE.read_text(encoding="utf-8")
    assert text.count('.view("i1")') == 1
    assert re.findall(r"cdef (.*)\[::1\] view\n", text) == ["const signed char"]
    assert not re.search(r"(?<!signed )\bchar\[", text)
