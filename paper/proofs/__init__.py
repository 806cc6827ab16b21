"""Proofs of Section 4, and beyond it, in ball arithmetic."""
