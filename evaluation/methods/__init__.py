"""Place-recognition methods, one module per method."""
