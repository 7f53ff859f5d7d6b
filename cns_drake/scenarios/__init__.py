"""What a drive is made of: scenario files, and families of them."""
