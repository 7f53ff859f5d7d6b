"""Readers of recorded sequences, one module per format."""
