"""Certificates of proofs, their checker, and the digest of the code that proves."""
