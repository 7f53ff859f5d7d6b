"""Objects on streets, squares and building sites, besides plants."""
