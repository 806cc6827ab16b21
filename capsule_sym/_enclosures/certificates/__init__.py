"""Certificates of what was proved, their checker, and the digest of the code that proves."""
