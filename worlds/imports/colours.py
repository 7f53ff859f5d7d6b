"""Colours and finishes of imported structures."""

from worlds.shapes import Finish

Rgb = tuple[float, float, float]
# A roof of clay tiles.
RED_ROOF = Finish((0.55, 0.30, 0.24), "brick")
# White paint of road marks.
WHITE: Rgb = (0.86, 0.86, 0.84)
# Lane marks and zebra crossings.
WHITE_PAINT = Finish(WHITE, "markings")
WATER: Rgb = (0.16, 0.34, 0.45)
LAWN: Rgb = (0.42, 0.55, 0.30)
