"""Recorded drives: what each offers, and the reader of MCAP files."""
