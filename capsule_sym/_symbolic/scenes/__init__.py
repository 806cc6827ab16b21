"""Declarations of the scenes that ship: one file each, read like Section 2 of the paper."""
