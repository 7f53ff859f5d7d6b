"""Camera images beside the scans of queries and places."""

import base64
from dataclasses import replace
import io

from helpers.small_page import make_content
import numpy as np
from PIL import Image
import pytest

from evaluation.results import browser_section, nearest_images

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


def with_images(counts, draw=lambda k: picture(8, 8, 10 * k)):
    """Returns a page whose drives have images a second apart."""
    content = make_content()
    for name, count in zip(NAMES, counts, strict=True):
        drive = content.drives[name]
        stamps_ns = np.arange(len(drive.frames)) * 500_000_000
        times_ns = np.arange(count) * 1_000_000_000 + 10_000_000
        camera = Camera(times_ns, [draw(k) for k in range(count)])
        images = nearest_images(camera, stamps_ns, pytest.fail)
        content.drives[name] = replace(drive, images=images)
    return content


def shown(content):
    section = browser_section(content.outcomes, content.drives, {})
    return [section.data["drives"][name]["images"] for name in NAMES]


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
    levels = [
        Image.open(io.BytesIO(base64.b64decode(one))).getpixel((4, 4))[0]
        for one in first["files"]
    ]
    assert levels == pytest.approx([0, 10], abs=3)
    assert first["nearest"] == [0, 0, *[1] * 8]
    assert first["later"][:4] == [0.01, -0.49, 0.01, -0.49]


def test_many_images_are_thinned_and_the_page_says_so(tmp_path):
    """A page has 6 MB of images."""
    noise = np.random.default_rng(1).integers(
        256, size=(320, 320, 3), dtype="u1"
    )
    stream = io.BytesIO()
    Image.fromarray(noise).save(stream, "JPEG", quality=100)
    content = with_images((5, 3), lambda k: stream.getvalue())
    (size,) = {
        len(base64.b64decode(file))
        for one in shown(content)
        for file in one["files"]
    }
    for number, step in ((6_000_000 // size, 1), (12_000_000 // size, 2)):
        images = replace(
            content.drives[NAMES[0]].images,
            files=content.drives[NAMES[0]].images.files[:1] * (number - 3),
            times_ns=np.arange(number - 3) * 100_000_000,
        )
        content.drives[NAMES[0]] = replace(
            content.drives[NAMES[0]], images=images
        )
        lengths = [len(one["files"]) for one in shown(content)]
        assert lengths == [-(-(number - 3) // step), -(-3 // step)]
        text = content.write(tmp_path).read_text()
        assert (SAID.format(step) in text) == (step > 1)
