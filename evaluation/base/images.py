"""Images as JPEG."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from PIL.Image import Image

# Levels of a picture of one level are divided by this instead of by zero; 255
# times its reciprocal is finite.
_LEAST_SPREAD = 1e-300


def to_jpeg(
    picture: Image, quality: int = 75, longest: int | None = None
) -> bytes:
    """Returns a picture as JPEG.

    A picture of more than 8 bits, such as a thermal camera's picture, is
    scaled: the darkest 1 % of its pixels become black, and the brightest 1 %
    become white.

    Args:
        picture: the picture.
        quality: quality of the JPEG, as Pillow defines it.
        longest: greatest width and height [pixels]. A larger picture is reduced
            to this size; this changes `picture`. None for no limit.
    """
    if picture.mode in ("I", "F") or picture.mode.startswith("I;16"):
        picture = _to_8_bits(picture)
    if longest is not None:
        picture.thumbnail((longest, longest))
    stream = io.BytesIO()
    picture.convert("RGB").save(stream, "JPEG", quality=quality)
    return stream.getvalue()


def _to_8_bits(picture: Image) -> Image:
    """Returns a picture of large numbers as one of 8 bits."""
    from PIL import Image

    values = np.asarray(picture).astype(np.float64)
    known = np.isfinite(values)
    shown = np.zeros(values.shape, np.uint8)
    if known.any():
        low, high = np.percentile(values[known], (1.0, 99.0))
        scale = 255.0 / max(high - low, _LEAST_SPREAD)
        with np.errstate(over="ignore"):
            levels = np.clip((values[known] - low) * scale, 0.0, 255.0)
        shown[known] = np.rint(levels)
    return Image.fromarray(shown)
