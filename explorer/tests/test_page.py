import base64
import hashlib
import re
import signal
import socket
import struct
import subprocess
import sys
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import pytest
from click.testing import CliRunner

from capsule_sym._cli import group
from capsule_sym._explorer import page
from capsule_sym._figures.style import field_colour
from capsule_sym._parameters import scene
from explorer import build

LARGEST = 950_000


def test_the_page_is_built_from_the_sources_as_they_are():
    assert build.stale() == ""


def test_a_changed_source_makes_the_page_stale(monkeypatch, tmp_path):
    changed = tmp_path / "run.c"
    changed.write_text(build.NATIVE.joinpath("run.c").read_text() + "\n")
    paths = [*build.sources()]
    monkeypatch.setattr(build, "ROOT", tmp_path)
    monkeypatch.setattr(build, "sources", lambda: [changed])
    assert "built from other sources" in build.stale()
    monkeypatch.setattr(build, "PAGE", tmp_path / "none.html")
    assert "cannot be read" in build.stale()
    names = {path.name for path in paths}
    assert {"orbit.c", "main.ts", "page.html", "capsule_kernels.c", "step.h"} <= names


def test_the_page_is_small():
    assert len(page().encode()) <= LARGEST


def test_the_page_loads_nothing_and_evaluates_no_text():
    text = page()
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)[1]
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["default-src"] == "'none'"
    assert not re.search(r"https?:|\*|unsafe-inline|'unsafe-eval'", policy)
    for tag, rule in (("script", "script-src"), ("style", "style-src")):
        (content,) = re.findall(rf"<{tag}>(.*?)</{tag}>", text, re.DOTALL)
        known = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        assert f"'sha256-{known}'" in rules[rule]
        assert not re.search(
            r"\beval\(|new Function|importScripts|XMLHttpRequest|\bfetch\(", content
        )
    body = re.sub(r"<(script|style)>.*?</\1>", "", text, flags=re.DOTALL)
    assert not re.search(r"""(src|href)=["'](?!#|data:)""", body)
    # Handlers and styles in attributes would be refused by the policy, and silently so.
    assert not re.search(r'\s(on\w+|style)="', body)


def test_fields_have_the_colours_of_the_figures():
    prototype = scene("prototype")
    colours = ",".join(f'"{field_colour(field, scene=prototype)}"' for field in range(1, 10))
    assert f"fields:[{colours}]" in page()


def test_explore_writes_the_page(tmp_path):
    path = tmp_path / "deep" / "page.html"
    done = CliRunner().invoke(group, ["explore", "--out", str(path)])
    assert (done.exit_code, done.output) == (0, f"{path}\n")
    assert path.read_text(encoding="utf-8") == page()


@pytest.mark.parametrize(
    ("given", "named"),
    [(["--serve", "0", "--out", "x.html"], "--serve"), (["--out", "/dev/null/x"], "--out")],
)
def test_explore_refuses(given, named):
    done = subprocess.run(
        [sys.executable, "-m", "capsule_sym", "explore", *given], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert named in done.stderr
    assert "Traceback" not in done.stderr


def test_explore_serves_the_page_and_nothing_else():
    command = [sys.executable, "-m", "capsule_sym", "explore", "--serve", "0", "--no-open"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, **pipes, text=True) as server:
        try:
            address = server.stdout.readline().strip()
            # A client that leaves early: its connection is reset within its request.
            with socket.create_connection(("127.0.0.1", urlsplit(address).port)) as client:
                client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                client.sendall(b"GET /")
            assert urlopen(address).read().decode() == page()
            with urlopen(Request(address, method="HEAD")) as head:
                assert (head.status, head.read()) == (200, b"")
                assert int(head.headers["Content-Length"]) == len(page().encode())
            with pytest.raises(OSError, match="404"):
                urlopen(f"{address}pyproject.toml")
            server.send_signal(signal.SIGINT)
            assert server.wait(10) == 130
            assert server.stderr.read() == "error: interrupted\n"
        finally:
            server.kill()
