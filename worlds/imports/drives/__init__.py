"""Finds drives through imported cities."""
