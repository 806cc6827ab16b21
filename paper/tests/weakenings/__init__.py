"""Weakenings of the proofs: each takes one term or condition away, and one test has to fail.

`prover.toml` and `checker.toml` list them; `python -m paper.tests.weakenings` applies each alone.
"""
