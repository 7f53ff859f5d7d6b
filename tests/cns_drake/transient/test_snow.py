"""Snow on surfaces, and banks along kerbs."""

from helpers.transient_town import DRIVE, in_town
import numpy as np
import pytest


@pytest.mark.parametrize("depth", [0.1, 0.4])
def test_snow_lies_on_all_but_roads_and_plants(sdf, changed, depth):
    world, after = changed(snow=depth)
    _, before = changed()
    assert before.keys() | {"snow_banks"} == after.keys()
    tops = {n: t.p_WPs[:, 2].max() for n, t in before.items()}
    for name, thing in after.items():
        kind = thing.semantic_class
        rise = thing.p_WPs[:, 2].max() - tops.get(name, 0)
        if name == "snow_banks":
            continue
        covered = kind in ("car", "building") or name == "lawn"
        assert rise == pytest.approx(depth if covered else 0.0, abs=2e-3), name
        causes = world.structures[name].causes
        assert causes == (("snow",) if covered else ())
    # The lawn is raised as a whole, and white; a roof has a slab on it.
    lawn = after["lawn"].parts[0].geometry
    assert lawn.rgb[0] > 0.9
    assert lawn.reflectivity == 0.9
    roof = next(p for p in after["house_000"].parts if p.name.endswith("snow"))
    p_TPs = in_town(roof.p_WPs)
    assert np.ptp(p_TPs[:, 0]) == pytest.approx(15, abs=0.01)
    assert np.ptp(p_TPs[:, 1]) == pytest.approx(8, abs=0.01)
    assert p_TPs[:, 2].min() == pytest.approx(8.5, abs=1e-3)


def test_banks_lie_along_kerbs_and_nowhere_else(changed):
    _, after = changed(snow=0.2)
    banks = after["snow_banks"]
    assert banks.semantic_class == "terrain"
    p_TPs = in_town(banks.p_WPs)
    along = abs(p_TPs[:, 0]) < 98
    y = abs(p_TPs[along, 1])
    assert y.min() == pytest.approx(2.7, abs=0.01)
    assert y.max() == pytest.approx(4.1, abs=0.01)
    z = p_TPs[along, 2]
    # Snow banks rise from the road, above the snow beside them.
    assert z.min() == pytest.approx(0.0, abs=1e-3)
    assert 0.35 < z.max() < 0.6
    assert DRIVE.distances(banks.p_WPs[:, :2]).min() > 1.3
