"""Adds details to an imported city's bare shapes, by tags and at random."""
