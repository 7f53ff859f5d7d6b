"""Details for an imported city's bare shapes, by tags and at random."""
