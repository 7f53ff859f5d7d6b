"""Reads road networks in OpenDRIVE 1.4 to 1.7, and builds towns on them."""
