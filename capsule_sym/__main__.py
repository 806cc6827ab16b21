"""`python -m capsule_sym` and `capsule-sym`: the command line."""

import _thread
import signal
import sys
import time
from types import FrameType
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line and exit. Ctrl-C ends it in one line from the first import on."""
    try:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, interrupt)
        from capsule_sym import _cli as cli

        cli.main()
    except (KeyboardInterrupt, Exception) as error:
        # What a library makes of an interrupt in its middle may be any error.
        if not (isinstance(error, KeyboardInterrupt) or _came):
            raise
        print("error: interrupted", file=sys.stderr, flush=True)
        sys.exit(130)


_came: list[int] = []


def interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, but not within an import: as soon as that is over.

    The first lines of a module that Cython compiled drop what is raised in them.
    """
    _came.append(number)
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
        signal.pthread_kill(thread, number)


if __name__ == "__main__":
    main()
