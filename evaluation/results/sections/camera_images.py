"""Camera images that a report's page shows beside LiDAR frames."""

from __future__ import annotations

import base64
from collections.abc import Callable
from dataclasses import dataclass
import io
from typing import TYPE_CHECKING
import warnings

import numpy as np

from evaluation.base import to_jpeg
from evaluation.drives import Drive

if TYPE_CHECKING:
    from PIL.Image import Image

# Longer side of a shown image [pixels].
_IMAGE_SIDE = 320
# Formats of recorded images. Pillow reads many others, some by other programs.
_FORMATS = ("JPEG", "PNG", "TIFF", "WEBP")


@dataclass(frozen=True)
class CameraImages:
    """M camera images that are nearest in time to K LiDAR frames of a drive.

    Attributes:
        stamps_ns: (K,) time stamps of the LiDAR frames [ns].
        times_ns: (M,) times of the images, increasing [ns]. An image can be the
            nearest image for several frames.
        files: the M images as JPEG.
    """

    stamps_ns: np.ndarray
    times_ns: np.ndarray
    files: list[bytes]

    def to_data(self, step: int) -> dict:
        """Returns every `step`-th image, and which image each frame shows.

        Returns:
            A mapping for JSON. `files` contains the images as base64 text. Two
            lists have an entry for each of the K frames: `nearest` is the index
            in `files` of the image that is nearest in time, and `later` is the
            time of this image minus the time of the frame [s].
        """
        times_ns = self.times_ns[::step]
        nearest = _nearest_index(times_ns, self.stamps_ns)
        later = 1e-9 * (times_ns[nearest] - self.stamps_ns)
        return {
            "files": [
                base64.b64encode(content).decode("ascii")
                for content in self.files[::step]
            ],
            "nearest": nearest.tolist(),
            "later": np.round(later, 2).tolist(),
        }


def nearest_images(
    drive: Drive, stamps_ns: np.ndarray, on_note: Callable[[str], None]
) -> CameraImages | None:
    """Returns the camera images that are nearest in time to given frames.

    The result is None if the drive has no camera, or no image can be decoded.

    Args:
        drive: the drive.
        stamps_ns: (K,) time stamps of the frames [ns].
        on_note: is called with a note if images could not be decoded.

    Raises:
        InputError: if the drive cannot be read.
    """
    times_ns = drive.image_stamps_ns
    shown = {}
    faults = 0
    if len(times_ns) == 0:
        return None
    for number in np.unique(_nearest_index(times_ns, stamps_ns)):
        data = drive.image(number)
        try:
            with open_image(data) as picture:
                shown[number] = to_jpeg(picture, longest=_IMAGE_SIDE)
        except Exception:  # Decoders of damaged files raise any.
            faults += 1
    if faults:
        on_note(f"{drive.name}: {faults} camera images cannot be decoded")
    if not shown:
        return None
    return CameraImages(stamps_ns, times_ns[list(shown)], [*shown.values()])


def open_image(data: bytes) -> Image:
    """Opens an untrusted image, whose pixels are decoded when they are used.

    Returns:
        The image, which is a context manager.

    Raises:
        ValueError: the image has too many pixels.
        OSError, SyntaxError: it cannot be read, or is no such image.
    """
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        try:
            return Image.open(io.BytesIO(data), formats=_FORMATS)
        except (
            Image.DecompressionBombError,
            Image.DecompressionBombWarning,
        ) as error:
            raise ValueError(str(error)) from error


def _nearest_index(times_ns: np.ndarray, wanted_ns: np.ndarray) -> np.ndarray:
    """Returns, for each wanted time, the index of the nearest of `times_ns`."""
    return np.searchsorted((times_ns[1:] + times_ns[:-1]) // 2, wanted_ns)
