"""Objects other than plants on streets, squares and building sites."""
