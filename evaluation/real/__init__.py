"""Public real scans, measured as a study measures simulated ones.

`data_sets` opens the scans, `measuring` measures methods on them, and `judge`
trains a classifier that tells them from simulated scans.
"""
