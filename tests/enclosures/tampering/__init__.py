"""Kinds of tampering with certificates and their files; `kinds` has them all."""
