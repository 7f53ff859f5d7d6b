"""Simulation of a scenario with a Drake Diagram."""
