"""What all buildings are put together of: masses, facades, roofs."""
