"""The case that is proved: the parameters of Section 4 as decimals, and the ranges of two."""

EXACT = {"omega": "0.8", "delta": "0.02", "zeta": "0.05", "beta": "1.5", "f_b": "1"}
GAMMAS = ("3.3", "3.0")
ALPHA, GAMMA = (0.001, 2.0), (1.5, 5.0)
