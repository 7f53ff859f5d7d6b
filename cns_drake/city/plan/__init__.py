"""What a user states about a city: its districts and its stages."""
