"""Changes the drives of a map as the fields of a condition say."""
