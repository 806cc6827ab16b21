"""Commands of `python -m paper`."""
