"""Encoding of pictures as JPEG."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image


def to_jpeg(
    picture: Image, quality: int = 75, longest: int | None = None
) -> bytes:
    """Returns a picture as JPEG.

    Args:
        picture: the picture.
        quality: quality of the JPEG, as Pillow defines it.
        longest: greatest width and height [pixels]. A larger picture is reduced
            to this size, in place. None for no limit.
    """
    if longest is not None:
        picture.thumbnail((longest, longest))
    stream = io.BytesIO()
    picture.convert("RGB").save(stream, "JPEG", quality=quality)
    return stream.getvalue()
