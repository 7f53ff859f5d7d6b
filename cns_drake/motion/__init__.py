"""The vehicle's motion: from a path of lanes to poses over time."""
