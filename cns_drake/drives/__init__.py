"""Recorded drives: their common interface, and the reader of MCAP files."""
