"""Paths of cars, and the routes and waypoints that they follow."""
