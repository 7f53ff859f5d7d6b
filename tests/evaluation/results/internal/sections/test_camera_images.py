"""Camera images beside the scans of queries and places."""

import base64
from dataclasses import replace
import io

from helpers.small_page import make_content
import numpy as np
from PIL import Image
import pytest

from evaluation.results import nearest_images
from evaluation.results.sections.browser import browser_data
from evaluation.results.sections.camera_images import CameraImages

NAMES = "metropolis_01", "metropolis_04"
SAID = "has room for one of {} camera images"


class Camera:
    """A drive that has images alone."""

    name = "seen"

    def __init__(self, times_ns, files):
        self.image_stamps_ns = np.array(times_ns, np.int64)
        self.image = files.__getitem__


def picture(width, height, level=0, form="JPEG"):
    stream = io.BytesIO()
    Image.new("RGB", (width, height), (level, 100, 0)).save(stream, form)
    return stream.getvalue()


def with_images(counts):
    """Returns a page whose drives have images a second apart."""
    content = make_content()
    for name, count in zip(NAMES, counts, strict=True):
        drive = content.drives[name]
        stamps_ns = np.arange(len(drive.frames)) * 500_000_000
        times_ns = np.arange(count) * 1_000_000_000 + 10_000_000
        files = [bytes([k]) * 100 for k in range(count)]
        images = CameraImages(stamps_ns, times_ns, files)
        content.drives[name] = replace(drive, images=images if count else None)
    return content


def shown(content):
    data = browser_data(content.outcomes, content.drives, {})
    return [data["drives"][name]["images"] for name in NAMES]


def test_nearest_images_are_taken_and_reduced():
    files = [picture(800, 400, 10 * k) for k in range(4)]
    files[3] = picture(60, 90, 30, "PNG")
    found = nearest_images(
        # 149 is nearer to 100, 151 to 200; no frame is near 300.
        Camera([100, 200, 300, 400], files),
        np.array([20, 149, 151, 399, 900]),
        pytest.fail,
    )
    assert found.times_ns.tolist() == [100, 200, 400]
    pictures = [Image.open(io.BytesIO(one)) for one in found.files]
    assert [one.format for one in pictures] == ["JPEG"] * 3
    assert [one.size for one in pictures] == [(320, 160)] * 2 + [(60, 90)]
    levels = [one.getpixel((5, 5))[0] for one in pictures]
    assert levels == pytest.approx([0, 10, 30], abs=3)


@pytest.mark.parametrize(
    "damaged", [b"", b"no image", picture(50, 50)[:400], b"\x89PNG\r\n\x1a\n"]
)
def test_damaged_images_are_left_out_and_told(damaged):
    camera = Camera([1, 2], [damaged, picture(8, 8)])
    notes = []
    found = nearest_images(camera, np.array([1, 2]), notes.append)
    assert found.times_ns.tolist() == [2]
    assert notes == ["seen: 1 camera images cannot be decoded"]
    assert nearest_images(camera, np.array([1]), notes.append) is None


def test_no_camera():
    assert nearest_images(Camera([], []), np.array([1]), pytest.fail) is None


def test_each_scan_shows_the_nearest_image():
    first, second = shown(with_images((2, 0)))
    assert second is None
    files = [base64.b64decode(one) for one in first["files"]]
    assert files == [b"\0" * 100, b"\1" * 100]
    assert first["nearest"] == [0, 0, *[1] * 8]
    assert first["later"][:4] == [0.01, -0.49, 0.01, -0.49]


def test_many_images_are_thinned_and_the_page_says_so(tmp_path, monkeypatch):
    content = with_images((5, 3))
    limit = "evaluation.results.sections.browser._IMAGES_OF_A_PAGE"
    for most, left, step in ((801, (5, 3), 1), (799, (3, 2), 2), (1, None, 0)):
        monkeypatch.setattr(limit, most)
        images = shown(content)
        if left is not None:
            assert tuple(len(one["files"]) for one in images) == left
        text = content.write(tmp_path).read_text()
        assert (SAID.format(step) in text) == (step > 1)
    # One image is left of each drive, however few there is room for.
    assert [len(one["files"]) for one in images] == [1, 1]
    assert images[0]["later"][-1] == pytest.approx(0.01 - 4.5)
