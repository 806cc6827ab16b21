"""Serves the explorer's page to this machine."""

from __future__ import annotations

import json
import sys
import webbrowser
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from capsule_sym._errors import InvalidInput


class _Quiet(SimpleHTTPRequestHandler):
    """Answers with files of a folder."""

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing of requests."""


class _Server(ThreadingHTTPServer):
    """Server that takes a client's early leave for what it is, no error."""

    def handle_error(self, request: object, client_address: object) -> None:
        """Print the traceback of an exception other than a lost connection."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


def serve(port: int, page: str, opens: bool, as_json: bool) -> None:
    """Serve the page at a port (0 for any free one) until Ctrl-C, and print the address.

    The address is JSON with `as_json`, and a browser opens it with `opens`. Raises InvalidInput for
    a port that is not free.
    """
    with TemporaryDirectory() as folder:
        Path(folder, "index.html").write_bytes(page.encode())
        try:
            server = _Server(("127.0.0.1", port), partial(_Quiet, directory=folder))
        except OSError as error:
            raise InvalidInput("--serve", port, f"a free port ({error.strerror})") from error
        with server:
            address = f"http://127.0.0.1:{server.server_address[1]}/"
            click.echo(json.dumps({"address": address}) if as_json else address)
            if opens:
                webbrowser.open(address)
            server.serve_forever()
