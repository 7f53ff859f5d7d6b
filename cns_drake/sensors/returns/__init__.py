"""Calibrated returns: a model of how real units measure returning light."""
