"""Pictures of stages, and web pages of drives."""
