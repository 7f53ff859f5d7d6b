"""Meshes that Open3D reads, and meshes that crash it."""

from helpers.small_map import world_text
import numpy as np
import pytest

from cns_drake.base.errors import InputError
from cns_drake.scene.foreign_meshes import ForeignMeshes
from cns_drake.scene.perception_geometry import read_perception_geometry
from cns_drake.scene.world import load_world

VERTICES = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
TRIANGLES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n"
    "property float y\nproperty float z\nelement face 4\n"
    "property list uchar int vertex_indices\nend_header\n"
    + "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES)
    + "".join(f"3 {a} {b} {c}\n" for a, b, c in TRIANGLES)
)
# Open3D 0.19 ends the program on a word that is longer than its buffer.
DEADLY = PLY.replace("float z", "float " + "9" * 5000)


@pytest.mark.slow
def test_a_crash_is_reported_and_the_next_mesh_read(tmp_path, capfd):
    for name, text in [("good", PLY), ("deadly", DEADLY), ("torn", PLY[:-20])]:
        (tmp_path / f"{name}.ply").write_text(text)
    with ForeignMeshes() as meshes:
        with pytest.raises(ValueError, match="cannot read it"):
            meshes.read(tmp_path / "deadly.ply")
        _, triangles = meshes.read(tmp_path / "torn.ply")
        assert len(triangles) < 4
        vertices, triangles = meshes.read(tmp_path / "good.ply")
    np.testing.assert_array_equal(vertices, VERTICES)
    np.testing.assert_array_equal(triangles, TRIANGLES)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_a_world_with_a_damaged_mesh(tmp_path):
    (tmp_path / "rock.ply").write_text(DEADLY)
    mesh = "<geometry><mesh><uri>rock.ply</uri></mesh></geometry>"
    path = tmp_path / "world.sdf"
    path.write_text(world_text([f'<visual name="rock">{mesh}</visual>']))
    world = load_world(path)
    with pytest.raises(InputError, match=r"rock\.ply: geometry .*cannot read"):
        read_perception_geometry(world.scene_graph.model_inspector())
