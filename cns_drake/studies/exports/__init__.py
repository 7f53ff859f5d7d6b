"""Writes data sets of simulated drives, from which networks can learn."""
