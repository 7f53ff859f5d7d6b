"""Calibrated returns: the measurement of returning light by real units."""
