"""Meshes that Open3D reads, and meshes that crash it."""

from helpers.small_map import world_text
import numpy as np
import pytest

from cns_drake.scene import load_world, read_perception_geometry
from cns_drake.scene.foreign_meshes import ForeignMeshes
from evaluation.base import InputError

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
        # Open3D itself returns the faces before the end.
        fault = r"cannot read it: unable to read file: torn\.ply"
        with pytest.raises(ValueError, match=fault):
            meshes.read(tmp_path / "torn.ply")
        vertices, triangles = meshes.read(tmp_path / "good.ply")
    np.testing.assert_array_equal(vertices, VERTICES)
    np.testing.assert_array_equal(triangles, TRIANGLES)
    assert capfd.readouterr() == ("", "")


OFF = "OFF\n4 4 0\n" + PLY.partition("end_header\n")[2]
MODEL = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"
version="1.4.1"><library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array>
<technique_common><accessor source="#a" count="3" stride="3"/>
</technique_common></source><vertices id="v"><input semantic="POSITION"
source="#p"/></vertices><triangles count="2"><input semantic="VERTEX"
source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries></COLLADA>"""


@pytest.mark.slow
def test_what_is_read_in_part_is_refused_in_every_format(tmp_path):
    cut = OFF.rsplit("\n", 2)[0] + "\n"
    with ForeignMeshes() as meshes:
        for name, text, fault in (
            ("rock.off", cut, "could not read all vertex indices"),
            ("rock.dae", MODEL, "Expected different index count"),
            ("rock.gltf", '{"asset": {"version": "2.0"}}', "GLTF: No scene"),
        ):
            (tmp_path / name).write_text(text)
            with pytest.raises(ValueError, match=f"cannot read it: {fault}"):
                meshes.read(tmp_path / name)
        # No message of an earlier file is left.
        (tmp_path / "rock.off").write_text(OFF)
        assert len(meshes.read(tmp_path / "rock.off")[1]) == 4


@pytest.mark.night
@pytest.mark.slow
def test_a_world_with_a_damaged_mesh(tmp_path):
    (tmp_path / "rock.ply").write_text(PLY[:-20])
    mesh = "<geometry><mesh><uri>rock.ply</uri></mesh></geometry>"
    path = tmp_path / "world.sdf"
    path.write_text(world_text([f'<visual name="rock">{mesh}</visual>']))
    world = load_world(path)
    with pytest.raises(InputError, match=r"rock\.ply: geometry .*cannot read"):
        read_perception_geometry(world.scene_graph.model_inspector())
