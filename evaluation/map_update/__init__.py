"""What of an old map is gone, what is new, and what was not looked at."""
