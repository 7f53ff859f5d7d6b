"""The vehicle's motion: from a path along lanes to poses over time."""
