"""Earlier stages: lower buildings, sites, and lots with another use."""
