"""Parts of houses: walls, porches, dormers, shop fronts."""
