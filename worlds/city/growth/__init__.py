"""Earlier stages: building sites, and lots with another use."""
