"""What is added to the bare shapes of an imported city, by tags and by lot."""
