"""What stands on streets, squares and sites, besides plants."""
