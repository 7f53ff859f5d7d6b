"""Pictures of more than 8 bits keep their contrast as JPEG."""

import io

import numpy as np
from PIL import Image
import pytest

from evaluation.base import to_jpeg


def seen(values, kind="PNG"):
    """Returns the grey values of a picture that was saved and shown."""
    stream = io.BytesIO()
    Image.fromarray(values).save(stream, kind)
    with Image.open(stream) as picture:
        jpeg = to_jpeg(picture, quality=95)
    with Image.open(io.BytesIO(jpeg)) as shown:
        return np.asarray(shown.convert("L")).astype(int)


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        (np.linspace(7000, 9000, 64).astype(np.uint16), "PNG"),
        (np.linspace(300, 310, 64).astype(np.float32), "TIFF"),
        (np.linspace(-5e6, 5e6, 64).astype(np.int32), "TIFF"),
    ],
)
def test_a_ramp_goes_from_black_to_white(values, kind):
    ramp = seen(np.tile(values, (48, 1)), kind)[20]
    assert ramp[0] < 8
    assert ramp[-1] > 247
    assert (np.diff(ramp) >= -2).all()
    assert ramp[32] == pytest.approx(128, abs=12)


def test_depth_without_a_return_and_one_level():
    depth = np.tile(np.linspace(2.0, 40.0, 64, dtype=np.float32), (48, 1))
    depth[:, :8] = np.inf
    shown = seen(depth, "TIFF")
    assert shown[20, 2] < 8
    assert shown[20, 40] > shown[20, 20] + 40
    # A number that is none, as a cast of it would be, differs by processor.
    with np.errstate(all="raise"):
        flat = seen(np.full((8, 8), 40000, np.uint16))
    assert not flat.any()


def test_pictures_of_8_bits_stay():
    values = np.tile(np.linspace(90, 110, 64).astype(np.uint8), (48, 1))
    assert np.abs(seen(values) - values).max() <= 2
