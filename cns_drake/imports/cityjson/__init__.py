"""CityJSON: a file's objects as structures of a city."""
