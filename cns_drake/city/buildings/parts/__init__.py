"""Parts of all buildings: masses, facades, roofs."""
