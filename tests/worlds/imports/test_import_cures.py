"""What a refused import asks for is enough."""

from dataclasses import replace
import re

from helpers.small_cityjson import CityWriter
from helpers.small_osm import OsmWriter
import pytest

from evaluation.base import InputError
from worlds.imports import ImportOptions, import_city

PLAIN = ImportOptions(dressed=False)


def houses(folder, *places):
    osm = OsmWriter()
    for x in places:
        osm.box(x, 0, 10, 10, building="yes")
    return osm.write(folder / f"houses_{len(places)}.osm")


@pytest.mark.parametrize(
    ("said", "options", "cure"),
    [
        ("give one with --along", {"within": 60.0}, {"along": "way.csv"}),
        ("leave the option out", {"lod": 1.0}, {"lod": None}),
        ("give one of them", {"grow": 0.3, "years": (1990,)}, {"grow": None}),
    ],
)
def test_an_option_that_a_refusal_names_helps(tmp_path, said, options, cure):
    source = houses(tmp_path, 0, 30, 200)
    asked = replace(PLAIN, **options)
    with pytest.raises(InputError, match=said):
        import_city(source, tmp_path / "map", asked)
    if "along" in cure:
        cure = {"along": tmp_path / cure["along"]}
        cure["along"].write_text("x,y\n-100,-20\n-40,-20\n")
    report = import_city(source, tmp_path / "map", replace(asked, **cure))
    assert report.kinds["Building"] == (2 if "along" in cure else 3)
    with pytest.raises(InputError, match="give another one"):
        import_city(source, tmp_path / "map", PLAIN)
    import_city(source, tmp_path / "another", PLAIN)


def test_a_piece_of_a_file_that_is_too_wide_is_read(tmp_path):
    said = "25 km across; cut out a piece of at most 20 km"
    with pytest.raises(InputError, match=said):
        import_city(houses(tmp_path, 0, 25_000), tmp_path / "map", PLAIN)
    import_city(houses(tmp_path, 0), tmp_path / "map", PLAIN)


@pytest.mark.parametrize("scale", [1, 1e-3, 0.01, 100, 1 / 0.0254])
def test_the_factor_that_is_named_cures_the_city(tmp_path, scale):
    def try_out(name, scale):
        city = CityWriter()
        for k, size in enumerate([(12, 9, 8), (10, 10, 15), (20, 8, 6)]):
            size = [scale * side for side in size]
            city.box(f"house_{k}", 40 * scale * k, 0, size)
        path = city.write(tmp_path / f"{name}.city.json")
        import_city(path, tmp_path / name, PLAIN)

    if scale != 1:
        with pytest.raises(InputError, match="multiply coordinates by") as told:
            try_out("as_given", scale)
        (factor,) = re.findall(r"by (\S+)\?", str(told.value))
        assert float(factor) == pytest.approx(1 / scale)
        scale *= float(factor)
    try_out("cured", scale)


@pytest.mark.parametrize(
    ("tag", "is_refused"),
    [
        ("height", True),
        ("building__levels", True),
        ("roof__direction", False),
        ("start_date", False),
    ],
)
def test_only_sizes_that_most_things_lack_ruin_a_city(
    tmp_path, tag, is_refused
):
    osm = OsmWriter()
    for k in range(5):
        osm.box(30 * k, 0, 9, 9, building="yes", **{tag: "some"})
    path = osm.write(tmp_path / "a.osm")
    if not is_refused:
        import_city(path, tmp_path / "map", PLAIN)
        return
    with pytest.raises(InputError, match=rf"read: {tag.replace('__', ':')} "):
        import_city(path, tmp_path / "map", PLAIN)
