"""Tests of the package, and what they share."""

import os

# Matrices here are small: threads of BLAS would only wait for each other where cores are busy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
