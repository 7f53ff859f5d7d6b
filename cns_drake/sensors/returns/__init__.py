"""What a real unit makes of the light that comes back."""
