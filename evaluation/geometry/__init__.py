"""Arrays of poses and points."""
