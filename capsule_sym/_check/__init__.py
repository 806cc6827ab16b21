"""Speed against error: this map and its peers, side by side in one run."""
