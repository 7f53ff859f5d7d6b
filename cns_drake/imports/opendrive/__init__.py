"""Road networks in OpenDRIVE 1.4 to 1.7, and towns built on them."""
