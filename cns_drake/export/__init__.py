"""Exports of recorded sequences to the layouts of existing data sets."""
