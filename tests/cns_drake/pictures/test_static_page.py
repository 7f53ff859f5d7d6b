import base64
import re
from types import SimpleNamespace

from helpers.meshcat_pages import read_messages
import numpy as np
from pydrake.geometry import Box, Meshcat, MeshcatParams, Rgba, Sphere
import pytest

from cns_drake.pictures import save_meshcat_page


@pytest.fixture(scope="module")
def meshcat():
    meshcat = Meshcat(MeshcatParams(host="localhost", port=0))
    meshcat.SetObject("/box", Box(1, 2, 3), Rgba(1, 0, 0))
    meshcat.SetObject("/sphere", Sphere(2), Rgba(0, 1, 0))
    vertices = np.zeros((3, 30_000))
    faces = np.arange(30_000, dtype=np.int32).reshape(3, -1, order="F")
    meshcat.SetTriangleMesh("/mesh", vertices, faces)
    meshcat.SetProperty("/box", "visible", False)
    return meshcat


@pytest.fixture
def page(meshcat, tmp_path):
    save_meshcat_page(meshcat, tmp_path / "page.html")
    return (tmp_path / "page.html").read_text()


def test_page_holds_the_same_commands_in_the_same_order(meshcat, page):
    original = [
        base64.b64decode(data)
        for data in re.findall(
            r'octet-binary;base64,([^"]*)"', meshcat.StaticHtml()
        )
    ]
    assert len(original) == 4  # Three objects and a property.
    assert read_messages(page) == original


def test_page_is_smaller_than_the_one_of_drake(meshcat, page):
    original = meshcat.StaticHtml()
    # 30,000 equal vertices and 10,000 faces, 480 kB raw.
    assert len(page) < len(original) - 600_000


def test_unknown_form_of_page_is_refused(tmp_path):
    other = SimpleNamespace(StaticHtml=lambda: "<html></html>")
    with pytest.raises(RuntimeError, match="another form"):
        save_meshcat_page(other, tmp_path / "page.html")
