"""Coexisting attractors: what starts lead to, how safe a motion is, how to switch between two."""
