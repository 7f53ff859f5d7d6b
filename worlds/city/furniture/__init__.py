"""Objects on streets, squares and building sites, except plants."""
