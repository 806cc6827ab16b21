"""Smoke test of an installed wheel and its dependencies: `python -W error tests/smoke.py`.

No tests' tools and no file of the checkout are used, so that it runs wherever a wheel is tried.
"""

import json
import subprocess
import sys
import sysconfig
from importlib.metadata import files, version
from pathlib import Path

import numpy as np

import capsule_sym
from capsule_sym import Parameters, simulate, simulate_many


def command(*arguments: str) -> str:
    name = "capsule-sym.exe" if sys.platform == "win32" else "capsule-sym"
    program = Path(sysconfig.get_path("scripts")) / name
    done = subprocess.run([program, *arguments], capture_output=True, text=True, check=True)
    return done.stdout


def main() -> None:
    assert not Path(capsule_sym.__file__).is_relative_to(Path(__file__).resolve().parents[1])
    shipped = [path.name for path in files("capsule-sym")]
    (module,) = {name for name in shipped if name.startswith("_binding.")} - {"_binding.pyx"}
    assert "abi3" in module or module == "_binding.pyd", module
    assert shipped.count("core.dll" if sys.platform == "win32" else "core.so.1") == 5

    run = simulate(Parameters(), periods=100)
    assert run.backend == "c"
    motion, same = run.steady(), simulate(Parameters(), periods=100, backend="numpy").steady()
    assert motion is not None
    assert same is not None
    assert [*motion.itinerary] == [*same.itinerary]
    assert abs(motion.progression - same.progression) < 1e-9

    (short,), (exact,) = (
        simulate(Parameters(), periods=2, backend=backend)([12.0]) for backend in ("c", "mpmath")
    )
    np.testing.assert_allclose(short, np.asarray(exact, float), rtol=0, atol=1e-12)

    rows = [Parameters(alpha=alpha) for alpha in (0.3, 0.7, 1.2)] * 4
    alone = [simulate(row, periods=50).final[1] for row in rows]
    np.testing.assert_allclose(simulate_many(rows, periods=50).states, alone, rtol=0, atol=1e-9)

    assert command("--version").startswith(f"{version('capsule-sym')} (C core, ")
    assert json.loads(command("run", "--alpha", "1.2", "--json"))
    python = sys.version.split()[0]
    print(f"capsule-sym {version('capsule-sym')} works by {module} on Python {python}")


if __name__ == "__main__":
    main()
