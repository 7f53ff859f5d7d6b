"""One grammar of walls, windows, doors, shop fronts, balconies and roofs."""
