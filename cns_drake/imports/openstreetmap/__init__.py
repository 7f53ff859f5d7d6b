"""OpenStreetMap: a file's buildings, streets and land as a city."""
