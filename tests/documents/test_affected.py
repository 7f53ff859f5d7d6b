"""The tests that `pytest --affected` runs."""

from helpers.affected import ROOT, concerns
import pytest


@pytest.mark.parametrize(
    ("test", "file", "expected"),
    [
        # Far away within a package, through a door and three modules.
        ("cns_drake/scene/test_sdf_worlds", "cns_drake/scene/obj_check", True),
        ("worlds/roads/test_route", "cns_drake/scene/obj_check", False),
        # In another package, through its door alone.
        ("cns_drake/sensors/test_lidar", "cns_drake/ray_casting/rays", False),
        (
            "cns_drake/ray_casting/test_ray_casting",
            "cns_drake/scene/surfaces",
            True,
        ),
        # Members of families, which nothing imports.
        ("cns_drake/transient/test_snow", "cns_drake/transient/snow", True),
        ("worlds/roads/test_towns", "cns_drake/transient/snow", False),
        # One in a folder without tests of its own.
        ("worlds/city/test_buildings", "worlds/city/buildings/barn", True),
    ],
)
def test_a_change_concerns_what_imports_it(test, file, expected):
    assert concerns(f"tests/{test}.py", [f"{file}.py"]) is expected


def test_pages_concern_the_tests_of_documents():
    assert concerns("tests/documents/test_links.py", ["docs/city.md"])
    assert not concerns("tests/worlds/roads/test_towns.py", ["docs/city.md"])


@pytest.mark.slow
def test_every_module_concerns_a_test():
    tests = [
        str(path.relative_to(ROOT))
        for path in (ROOT / "tests").rglob("test_*.py")
    ]
    for package in ("cns_drake", "evaluation", "worlds"):
        for path in (ROOT / package).rglob("*.py"):
            if path.name != "__init__.py":
                file = str(path.relative_to(ROOT))
                assert any(concerns(test, [file]) for test in tests), file
