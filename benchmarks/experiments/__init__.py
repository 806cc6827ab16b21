"""Experiments: results beside brute force and judges that share no code with them."""
