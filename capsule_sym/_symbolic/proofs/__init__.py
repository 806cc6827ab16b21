"""Proofs about the model, each an item that `capsule-sym verify` checks."""
