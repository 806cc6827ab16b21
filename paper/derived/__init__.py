"""Derived statements about the paper's scene alone, from Eq. (16) to Appendix B."""
