"""Draws pictures of stages, and web pages of drives."""
