"""`python -m capsule_sym`: the command line."""

from capsule_sym.cli import main

if __name__ == "__main__":
    main()
