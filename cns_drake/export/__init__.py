"""Exports of recorded drives to the layouts of existing data sets."""
