"""Earlier stages: lower buildings, and lots with another use."""
