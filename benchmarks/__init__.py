"""Tools for developers that no wheel holds: `make` lists them."""
