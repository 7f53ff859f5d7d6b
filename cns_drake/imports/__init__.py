"""Cities of others as maps: what their files hold, and drives through them."""
