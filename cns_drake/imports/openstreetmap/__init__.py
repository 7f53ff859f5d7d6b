"""Makes a city of the buildings, streets and land in OpenStreetMap files."""
