"""Proofs of what the model implies, each an item that `capsule-sym verify` settles."""
