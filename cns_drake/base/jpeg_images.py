"""Encoding of pictures as JPEG."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image


def to_jpeg(
    picture: Image, quality: int = 75, longest: int | None = None
) -> bytes:
    """Returns a picture as JPEG, with sides of at most `longest` pixels."""
    if longest is not None:
        picture.thumbnail((longest, longest))
    stream = io.BytesIO()
    picture.convert("RGB").save(stream, "JPEG", quality=quality)
    return stream.getvalue()
