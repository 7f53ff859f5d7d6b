"""Objects on streets, squares and building sites: a family, a file each."""
