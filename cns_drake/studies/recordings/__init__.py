"""Records the drives of maps as jobs, and reports on the recordings."""
