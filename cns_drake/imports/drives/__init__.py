"""The search for drives through imported cities."""
