"""Houses for one family or a few, and barns."""
