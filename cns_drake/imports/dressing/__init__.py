"""Dressing: details added to an imported city's bare shapes, from tags and by
lot."""
