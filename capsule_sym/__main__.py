"""`python -m capsule_sym` and `capsule-sym`: the command line."""

import os
import sys
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line and exit. Ctrl-C ends it in one line from the first import on."""
    try:
        from capsule_sym import _cli as cli

        cli.main()
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr, flush=True)
        os._exit(130)  # an import that was cut off may end the interpreter by the signal


if __name__ == "__main__":
    main()
