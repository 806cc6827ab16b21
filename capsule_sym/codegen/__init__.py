"""The generator: derivations in, source code of the kernels out."""
