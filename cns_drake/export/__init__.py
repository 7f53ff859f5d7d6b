"""Recorded sequences in the layouts of data sets that exist already."""
