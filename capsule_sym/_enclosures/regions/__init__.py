"""Sets of parameters and of starts, proved patch by patch and part by part."""
