"""`python -m capsule_sym` and `capsule-sym`: the command line.

Until Ctrl-C has its handlers, only modules compiled into Python are imported: `signal` alone
imports enum, functools and more, which takes longer than all else.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]
import _thread
import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
    from types import FrameType
    from typing import NoReturn


def exit_at_once(number: int, frame: FrameType | None) -> NoReturn:
    """Exit in one line: before `main` no handler of exceptions would print it."""
    print("error: interrupted", file=sys.stderr, flush=True)
    sys.exit(130)


if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
    _signal.signal(_signal.SIGINT, exit_at_once)


def main() -> NoReturn:
    """Run the command line and exit. Ctrl-C ends it in one line from the first import on."""
    try:
        if _signal.getsignal(_signal.SIGINT) is exit_at_once:
            _signal.signal(_signal.SIGINT, interrupt)
        try:
            from capsule_sym import _cli as cli

            cli.main()
        finally:
            # Output is complete: from here a signal would kill Python instead of letting it exit.
            _signal.signal(_signal.SIGINT, _signal.SIG_IGN)
    except (KeyboardInterrupt, SystemExit, Exception) as error:
        # A library interrupted in its middle may raise any error, or none and continue.
        if getattr(error, "code", 0) or not (isinstance(error, KeyboardInterrupt) or _came):
            raise
        print("error: interrupted", file=sys.stderr, flush=True)
        exec("")  # as in `_cli.main`
        sys.exit(130)


_came = False


def interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, but after an import that is in progress.

    The first lines of a module compiled by Cython drop exceptions raised in them.
    """
    global _came
    _came = True
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            _thread.start_new_thread(_again, (_thread.get_ident(), number))
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _again(thread: int, number: int) -> None:
    time.sleep(0.01)
    if sys.platform == "win32":
        _thread.interrupt_main(number)
    else:
        _signal.pthread_kill(thread, number)


if __name__ == "__main__":
    main()
