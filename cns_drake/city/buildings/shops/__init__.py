"""Shops, markets and filling stations."""
