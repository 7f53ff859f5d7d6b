import numpy as np
import pytest

from evaluation.results import OrthographicView, render

RED = (200, 0, 0)
GREEN = (0, 200, 0)


def test_axes_of_the_camera():
    # With the camera above and turned to the north, east is right and north is
    # up.
    above = OrthographicView(azimuth_deg=-90.0, elevation_deg=90.0).axes()
    np.testing.assert_allclose(
        above, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-12
    )
    axes = OrthographicView(azimuth_deg=20.0, elevation_deg=35.0).axes()
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    # Higher points are drawn higher.
    assert axes[1, 2] > 0.0
    assert axes[0, 2] == 0.0


def test_the_nearer_point_hides_the_farther():
    view = OrthographicView(
        azimuth_deg=-90.0, elevation_deg=90.0, pixels_per_metre=1.0
    )
    # Points above each other in both orders, and two more to span an image.
    points = np.array(
        [[2.3, 2.3, 5.0], [2.3, 2.3, 0.0], [0, 0, 0], [4.3, 4.3, 0]]
    )
    colours = np.array([RED, GREEN, GREEN, GREEN], dtype=np.uint8)
    for order in ([0, 1, 2, 3], [1, 0, 3, 2]):
        image = render(points[order], colours[order], view, size_px=1).image
        assert image.shape == (5, 5, 3)
        # Nothing is nearer than the red point, so it is not darkened.
        assert image[2, 2].tolist() == list(RED)
        assert image[4, 0].tolist() == list(GREEN)
        assert image[0, 4].tolist() == list(GREEN)
        assert (image[0, 0] == 255).all()


def test_points_cover_squares_and_steps_darken():
    view = OrthographicView(
        azimuth_deg=-90.0, elevation_deg=90.0, pixels_per_metre=1.0
    )
    points = np.array([[0.0, 0.0, 0.0], [3.3, 0.0, 0.0]])
    colours = np.array([RED, RED], dtype=np.uint8)
    flat = render(points, colours, view, size_px=3).image
    assert flat.shape == (3, 6, 3)
    assert (flat == RED).all()
    points[1, 2] = 2.0
    stepped = render(points, colours, view, size_px=3).image
    # Only the lower square next to the step is darker.
    assert (stepped[:, [0, 1, 3, 4, 5]] == RED).all()
    assert (stepped[:, 2, 0] < 200).all()


def test_pixels_and_coordinates_agree():
    view = OrthographicView(
        azimuth_deg=-50.0, elevation_deg=40.0, pixels_per_metre=2.0
    )
    rng = np.random.default_rng(0)
    points = rng.uniform(-20, 20, (40, 3))
    colours = np.zeros((40, 3), dtype=np.uint8)
    picture = render(points, colours, view, size_px=1)
    left, right, bottom, top = picture.extent
    height, width = picture.image.shape[:2]
    places = picture.project(points)
    columns = np.floor((places[:, 0] - left) / (right - left) * width)
    rows = np.floor((top - places[:, 1]) / (top - bottom) * height)
    # A point on the lower edge of a pixel row may round either way.
    rows = np.minimum(rows, height - 1)
    hit = picture.image[rows.astype(int), columns.astype(int), 0]
    assert np.count_nonzero(hit == 255) <= 1


@pytest.mark.parametrize(
    ("width", "height", "shape"),
    [
        # (20000 s + 3) (10000 s + 3) = 2^15 at s = 0.012575 pixels/m.
        (20e3, 10e3, (128, 254)),
        # The longest side of WebP: 16383 = 1e6 s + 3.
        (1e6, 0.0, (3, 16383)),
        # Within the bounds, at 4 pixels/m.
        (50.0, 25.0, (103, 203)),
    ],
)
def test_a_picture_of_far_drives_is_bounded(width, height, shape):
    view = OrthographicView(
        azimuth_deg=-90.0, elevation_deg=90.0, pixels_per_metre=4.0
    )
    points = np.array([[0.0, 0.0, 0.0], [width, height, 0.0]])
    rgb = np.array([RED, RED], dtype=np.uint8)
    most_px = 2**15 if height else 2**25
    picture = render(points, rgb, view, most_px=most_px)
    assert picture.image.shape[:2] == pytest.approx(shape, abs=1)
    assert picture.image[..., 0].size <= most_px
    # The axes stay in metres.
    left, right, bottom, top = picture.extent
    pixel = 1.0 / picture.view.pixels_per_metre
    assert right - left == pytest.approx(width, abs=4 * pixel)
    assert top - bottom == pytest.approx(height, abs=4 * pixel)
