"""Pictures of a map's stages, and web pages of drives."""
