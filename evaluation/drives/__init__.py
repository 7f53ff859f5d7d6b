"""Readers of recorded drives, one for each format, and views of drives."""
