"""Road networks, and routes along their lanes."""
