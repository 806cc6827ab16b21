"""The theory: model, closed forms, geometry and switching, derived and proved with SymPy."""

import os

# SymPy caches its last 1,000 results by default; proofs then take a third longer. It reads this
# when it is imported.
os.environ.setdefault("SYMPY_CACHE_SIZE", "100000")
