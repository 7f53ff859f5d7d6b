"""Dressing: details for an imported city's bare shapes, by tags and by lot."""
