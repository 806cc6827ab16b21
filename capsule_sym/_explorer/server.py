"""Serves the explorer's page to this machine."""

from __future__ import annotations

import json
import sys
import webbrowser
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import click

from capsule_sym._errors import InvalidInput


class _Handler(BaseHTTPRequestHandler):
    """Answers with the page and nothing else."""

    def __init__(self, body: bytes, *args: object) -> None:
        self.body = body
        super().__init__(*args)  # type: ignore[arg-type]

    def do_GET(self) -> None:
        """Answer a request for the page, or for its headers alone."""
        found = self.path.split("?")[0] == "/"
        self.send_response(200 if found else 404)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(self.body) if found else 0))
        self.end_headers()
        if found and self.command == "GET":
            self.wfile.write(self.body)

    do_HEAD = do_GET

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

    Raises InvalidInput for a port that is not free.
    """
    try:
        server = _Server(("127.0.0.1", port), partial(_Handler, page.encode()))
    except OSError as error:
        raise InvalidInput("--serve", port, f"a free port ({error.strerror})") from error
    with server:
        address = f"http://127.0.0.1:{server.server_address[1]}/"
        click.echo(json.dumps({"address": address}) if as_json else address)
        if opens:
            webbrowser.open(address)
        server.serve_forever()
