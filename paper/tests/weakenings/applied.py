"""Plugin for pytest that lets one module be imported with a weakening; no file is changed.

`CAPSULE_SYM_WEAKENING` has the weakening's name.
"""

from __future__ import annotations

import os
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from types import CodeType

from paper.tests.weakenings.listed import Weakening, listed

NAME = "CAPSULE_SYM_WEAKENING"


class _Loader(SourceFileLoader):
    def __init__(self, weakening: Weakening) -> None:
        super().__init__(weakening.module, str(weakening.path))
        self._source = weakening.weakened

    def get_code(self, fullname: str) -> CodeType:
        return compile(self._source, self.path, "exec")


class _Finder(MetaPathFinder):
    def __init__(self, weakening: Weakening) -> None:
        self._weakening = weakening

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        if fullname != self._weakening.module:
            return None
        loader = _Loader(self._weakening)
        return spec_from_file_location(fullname, self._weakening.path, loader=loader)


if NAME in os.environ:
    (_chosen,) = (one for one in listed() if one.name == os.environ[NAME])
    assert _chosen.module not in sys.modules
    sys.meta_path.insert(0, _Finder(_chosen))
