"""Guo and Liu (2019), reproduced with capsule-sym."""
