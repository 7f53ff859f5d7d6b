"""Scenario files, which describe drives, and families of scenarios."""
