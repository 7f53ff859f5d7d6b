"""What houses are put together of: walls, porches, dormers, shop fronts."""
