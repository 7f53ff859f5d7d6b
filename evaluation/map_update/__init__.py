"""Labels of old maps: what is gone, what is new, what was not observed."""
