"""How the vehicle moves: from a path of lanes to poses over time."""
