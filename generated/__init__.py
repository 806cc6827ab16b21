"""Generated code: a package for each scene that ships, written by `python -m capsule_sym.codegen`."""
