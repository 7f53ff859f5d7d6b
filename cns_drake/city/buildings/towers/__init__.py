"""Towers and other tall buildings."""
