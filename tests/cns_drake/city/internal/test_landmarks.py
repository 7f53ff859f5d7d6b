from helpers.building_checks import placed_triangles
import numpy as np
import pytest
from shapely.geometry import box
import yaml

from cns_drake.city import ARCHETYPES, sample
from cns_drake.city.buildings.landmarks import LANDMARKS

MODELS = [
    (name, number, folder)
    for name, folders in LANDMARKS.items()
    for number, folder in enumerate(folders)
]
every_model = pytest.mark.parametrize(
    ("name", "number", "folder"), MODELS, ids=lambda value: str(value)[-20:]
)


class Loaded:
    """A generator that always draws the same model."""

    def __init__(self, number):
        self._number = number

    def integers(self, count):
        assert count > self._number
        return self._number


def build(name, number, width, depth, height, at=(0.0, 0.0)):
    lot = box(-width / 2, -depth / 2, width / 2, depth / 2)
    lot = box(*np.add(lot.bounds, (*at, *at)))
    return sample(name, lot, height, Loaded(number), "b")


def described(folder):
    return yaml.safe_load((folder / "model.yaml").read_text())


@every_model
def test_on_its_own_lot_a_model_is_as_its_files_say(name, number, folder):
    model = described(folder)
    built = build(name, number, *model["size"], model["height"])
    assert [p.name for p in built.parts] == [p["name"] for p in model["parts"]]
    own = {key.removeprefix("b_"): mesh for key, mesh in built.meshes.items()
           if key.startswith("b_")}  # fmt: skip
    files = {path.stem: path.read_text() for path in folder.glob("*.obj")}
    assert {key: mesh.to_obj() for key, mesh in own.items()} == files
    for part, entry in zip(built.parts, model["parts"], strict=True):
        assert part.xyz == tuple(entry.get("xyz", (0, 0, 0)))
        assert part.rpy == (0, 0, entry.get("yaw", 0))
        assert part.shape.scale == tuple(entry.get("scale", (1, 1, 1)))
        assert part.rgb == tuple(entry["rgb"])


@every_model
def test_a_model_is_stretched_about_the_middle_of_its_lot(name, number, folder):
    model = described(folder)
    (width, depth), height = model["size"], model["height"]
    widest, tallest = (ARCHETYPES[name].widths[1], ARCHETYPES[name].heights[1])
    wide, high = min(1.25 * width, widest), min(1.2 * height, tallest)
    before = placed_triangles(build(name, number, width, depth, height))
    after = placed_triangles(
        build(name, number, wide, depth, high, at=(3.0, -7.0))
    )
    reach = 2 * model["overhang"][0]
    across = (wide + reach) / (width + reach)
    expected = before[:, :, :2] * (across, 1.0) + np.array((3.0, -7.0))
    # Positions are rounded to 1 mm, scales to 0.0001.
    np.testing.assert_allclose(after[:, :, :2], expected, atol=0.01, rtol=2e-4)
    z = after[:, :, 2]
    z_before = before[:, :, 2]
    assert z.max() == pytest.approx(z_before.max() * high / height, abs=0.01)
    assert z.min() == pytest.approx(z_before.min(), abs=0.002)
