"""Scenarios, which describe drives; their files, and plans of drives."""
