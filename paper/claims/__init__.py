"""Claims of the paper, each checked beside the derivation."""
