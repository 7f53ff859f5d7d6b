"""Exports recorded drives to the layouts of existing data sets."""
