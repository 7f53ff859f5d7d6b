"""Real scans that anyone can get, measured as a study measures simulated ones.

`data_sets` knows them, `measuring` measures, and `judge` tells them from
simulated scans.
"""
