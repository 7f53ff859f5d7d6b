"""Road networks, and the ways along their lanes."""
