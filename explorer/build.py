"""Builds the explorer's page, or checks that it was built from the sources as they are.

    python explorer/build.py            builds capsule_sym/_explorer/page.html
    python explorer/build.py --check    exit status 1 where the page is stale

Needs Node.js with `npm ci` run in explorer/, and `pip install --group explorer`.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import subprocess
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
PAGE = ROOT / "capsule_sym" / "_explorer" / "page.html"
COLOURS = ROOT / "capsule_sym" / "_figures" / "colours.json"
"""The figures' colours, which are the page's."""
NATIVE = ROOT / "capsule_sym" / "_native"
SCENES = {folder.parent.name: folder for folder in sorted((ROOT / "generated").glob("*/c"))}
"""Folder of the generated C of each scene."""

LIBRARY = (
    *("tables.c", "scalar.c", "double_double.c", "run.c", "steady.c", "linear.c", "equations.c"),
    *("blocks.c", "shooting.c", "sensitivities.c", "orbit.c", "metrics.c", "extrema.c"),
)
"""Parts of the C library that the page needs: no lanes, no fused multiply-adds."""
FLAGS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c99", "-O3", "-ffp-contract=off"),
    *("-Wall", "-Wextra", "-Werror", "-Wno-bitwise-instead-of-logical"),
    *("-Wl,--strip-all", "-Wl,--gc-sections"),
)
_TEXTS = {".c", ".css", ".h", ".html", ".json", ".py", ".ts"}


def sources() -> Iterator[Path]:
    """All files that the page is made from, in a fixed order."""
    skipped = {"node_modules", "tests"}
    own = (path for path in HERE.rglob("*") if not skipped & {*path.relative_to(HERE).parts})
    yield from sorted(path for path in own if path.is_file() and path.suffix in _TEXTS)
    yield from sorted([NATIVE / name for name in LIBRARY] + list(NATIVE.glob("*.h")))
    for kernels in SCENES.values():
        yield from sorted(kernels.glob("*.[ch]"))
    yield COLOURS


def digest() -> str:
    """Digest of the sources, by their names and texts; line endings do not count."""
    found = hashlib.sha256()
    for path in sources():
        text = path.read_text(encoding="utf-8")
        found.update(f"{path.relative_to(ROOT).as_posix()}\0{text}\0".encode())
    return found.hexdigest()[:16]


def stale() -> str:
    """Reason why the page is out of date; empty if it is not."""
    try:
        page = PAGE.read_text(encoding="utf-8")
    except OSError as error:
        return f"{PAGE.name} cannot be read ({error.strerror})"
    found = re.search(r'name="capsule-sym-digest" content="(\w+)"', page)
    if found and found[1] == digest():
        return ""
    return f"{PAGE.name} was built from other sources; build it again: make explorer"


def build() -> None:
    """Compile, bundle and write the page, with the facts of each scene."""
    for name in SCENES:
        (HERE / "src" / "models" / f"{name}.ts").write_bytes(model(name))
    with TemporaryDirectory() as folder:
        libraries = {
            name: _compile(kernels, Path(folder) / f"{name}.wasm")
            for name, kernels in SCENES.items()
        }
        worker = _bundle("worker.ts", {})
        packed = {
            name: base64.b64encode(zlib.compress(library, 9)).decode()
            for name, library in libraries.items()
        }
        script = _bundle("main.ts", {"WORKER": json.dumps(worker)})
    plot = (HERE / "node_modules/uplot/dist/uPlot.min.css").read_text(encoding="utf-8")
    colours = json.loads(COLOURS.read_text(encoding="utf-8"))
    named = {"f4": colours["fields"][3], "f6": colours["fields"][5], "accent": colours["series"][0]}
    root = ":root {" + "".join(f"--{name}: {colour};" for name, colour in named.items()) + "}"
    style = _bundle_style(plot + root + (HERE / "style.css").read_text(encoding="utf-8"))
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(_page(script, style, packed), encoding="utf-8", newline="\n")
    print(f"{PAGE.relative_to(ROOT)}: {PAGE.stat().st_size:,} bytes")
    for name, library in libraries.items():
        print(f"  {name}: {len(library):,} bytes of library, {len(packed[name]):,} in the page")


def model(scene: str) -> bytes:
    """Facts of a scene in TypeScript; in a process of their own, which has one model."""
    command = [sys.executable, str(HERE / "model.py"), scene]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout


def _page(script: str, style: str, packed: dict[str, str]) -> str:
    # Nothing is loaded from anywhere; only this very script and this very style may run.
    policy = "; ".join(
        (
            "default-src 'none'",
            f"script-src '{_hash(script)}' 'wasm-unsafe-eval'",
            f"style-src '{_hash(style)}'",
            "img-src data: blob:",
            "worker-src blob:",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )
    blocks = (
        f'<script type="text/plain" id="library-{name}">{text}</script>'
        for name, text in packed.items()
    )
    parts = {"policy": policy, "digest": digest(), "style": style, "script": script}
    parts["libraries"] = "\n".join(blocks)
    frame = (HERE / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{(\w+)\}", lambda found: parts.get(found[1], found[0]), frame)


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _compile(kernels: Path, out: Path) -> bytes:
    files = [*sorted((HERE / "core").glob("*.c")), *(NATIVE / name for name in LIBRARY)]
    folders = [f"-I{folder}" for folder in (HERE / "core", NATIVE, kernels)]
    command = [sys.executable, "-m", "ziglang", "cc", *FLAGS, *folders]
    names = [str(path) for path in (*files, kernels / "capsule_kernels.c")]
    subprocess.run([*command, *names, "-o", str(out)], check=True)
    return out.read_bytes()


def _bundle(name: str, defined: dict[str, str]) -> str:
    given = [f"--define:{key}={value}" for key, value in defined.items() if len(value) < 10_000]
    options = ["--bundle", "--minify", "--format=iife", "--target=es2022", "--charset=utf8"]
    text = _esbuild([str(HERE / "src" / name), *options, *given])
    # Longer than a command line may be: put in where the name stands.
    for key, value in defined.items():
        if len(value) >= 10_000:
            text = re.sub(rf"\b{key}\b", lambda _, value=value: value, text)
    return text.strip().replace("</script", "<\\/script")


def _bundle_style(text: str) -> str:
    return _esbuild(["--loader=css", "--minify", "--charset=utf8"], text).strip()


def _esbuild(options: list[str], given: str | None = None) -> str:
    tool = HERE / "node_modules" / ".bin" / "esbuild"
    done = subprocess.run(
        [str(tool), *options],
        input=given,
        check=True,
        stdout=subprocess.PIPE,
        encoding="utf-8",
        cwd=HERE,
    )
    return done.stdout


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        sys.exit(stale() or 0)
    build()
