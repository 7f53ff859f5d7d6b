"""The scene that cameras see: the LiDARs' geometry, as meshes for rendering.

Drake's renderer wants normals, which meshes of worlds need not have, and is
slow with thousands of geometries. All that stays is merged, by colour and
class.
"""

from collections.abc import Callable, Collection
import functools
import json
import subprocess
import sys

import numpy as np
from pydrake.common import MemoryFile
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    InMemoryMesh,
    LightParameter,
    MakeRenderEngineVtk,
    Mesh,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem
from pydrake.systems.sensors import CameraInfo, ImageRgba8U

from cns_drake.base.errors import InputError
from cns_drake.scene.perception_geometry import (
    PerceptionGeometry,
    read_perception_geometry,
)
from cns_drake.scene.structure_table import StructureTable
from cns_drake.scene.surfaces import merge_triangles, tessellate

RENDERER = "cameras"
# Sides of a circle: true to 0.1 % of its radius.
_SIDES = 64
_GREY = (0.5, 0.5, 0.5)
# A sun, and others in place of a sky: directions of light, and strengths.
_LIGHTS = [
    LightParameter(
        type="directional", frame="world", direction=way, intensity=strength
    )
    for way, strength in (
        ((0.5, -0.4, -0.8), 2.5),
        ((-0.7, 0.6, -0.4), 0.9),
        ((0.3, 0.7, -0.5), 0.6),
        ((-0.2, -0.5, 0.6), 0.4),
    )
]
# Numbers of glTF 2.0: float, unsigned int; what buffers are for.
_FLOAT, _UINT, _VERTICES, _CORNERS = 5126, 5125, 34962, 34963


class CameraScene(LeafSystem):
    """Gives a SceneGraph of its own the poses of the frames that move.

    .. pydrake_system::

        name: CameraScene
        input_ports:
        - frame_poses
        output_ports:
        - geometry_pose

    `frame_poses` is abstract, `KnownPoses`.

    Attributes:
        scene_graph: what cameras see.
        frames: frame in the scene that was copied -> frame in this one.
    """

    def __init__(
        self,
        scene_graph: SceneGraph,
        structures: StructureTable,
        calc_X_WF: Callable[[FrameId], RigidTransform],
        *,
        anchored: Collection[FrameId],
        vehicle: Collection[FrameId],
        base: FrameId,
    ):
        """Copies a scene.

        Args:
            scene_graph: has the geometry, of the perception role.
            structures: gives classes to it.
            calc_X_WF: gives the poses of anchored frames.
            anchored: frames that never move, the world's included.
            vehicle: frames with what cameras do not see.
            base: the frame that carries cameras.

        Raises:
            InputError: Drake cannot render here.
        """
        super().__init__()
        self.scene_graph = SceneGraph()
        check_renderer()
        self.scene_graph.AddRenderer(
            RENDERER, MakeRenderEngineVtk(RenderEngineVtkParams(lights=_LIGHTS))
        )
        self._source = self.scene_graph.RegisterSource("cameras")
        geometries = read_perception_geometry(
            scene_graph.model_inspector(), lambda frame: frame not in vehicle
        )
        table = structures.completed(one.structure for one in geometries)
        parts: dict[tuple, list[tuple[int, RigidTransform, PerceptionGeometry]]]
        parts = {}
        for one in geometries:
            frame, X_FG = one.frame_id, one.X_FG
            is_anchored = frame in anchored
            if is_anchored:
                X_FG = calc_X_WF(frame) @ X_FG
            label = table[one.structure].label
            key = None if is_anchored else frame, label, one.rgb or _GREY
            parts.setdefault(key, []).append((label, X_FG, one))
        moving = dict.fromkeys([base, *(key[0] for key in parts if key[0])])
        self.frames = {
            frame: self.scene_graph.RegisterFrame(
                self._source, GeometryFrame(f"frame_{k}")
            )
            for k, frame in enumerate(moving)
        }
        for k, ((frame, label, rgb), members) in enumerate(parts.items()):
            self._register(f"mesh_{k}", frame, label, rgb, members)
        self._poses = self.DeclareAbstractInputPort(
            "frame_poses", Value(object())
        )
        self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            self._calc_geometry_pose,
            {self.all_input_ports_ticket()},
        )

    def _register(
        self,
        name: str,
        frame: FrameId | None,
        label: int,
        rgb: tuple[float, float, float],
        members: list[tuple[int, RigidTransform, PerceptionGeometry]],
    ) -> None:
        """Registers one mesh; without a frame it stays."""
        merged, _ = merge_triangles(
            [(k, X, tessellate(g.surface, _SIDES)) for k, X, g in members]
        )
        corners = merged.p_GVset[merged.triangles]
        middle = np.round(corners.mean(axis=(0, 1)))
        made = GeometryInstance(
            RigidTransform(middle), _as_mesh(corners - middle, rgb), name
        )
        properties = PerceptionProperties()
        properties.AddProperty("label", "id", RenderLabel(label))
        made.set_perception_properties(properties)
        scene_graph, source = self.scene_graph, self._source
        if frame is None:
            scene_graph.RegisterAnchoredGeometry(source, made)
        else:
            scene_graph.RegisterGeometry(source, self.frames[frame], made)

    def connect(self, builder: DiagramBuilder, poses: object) -> None:
        """Adds the system and its scene to a diagram."""
        builder.AddNamedSystem("camera_scene_graph", self.scene_graph)
        builder.AddNamedSystem("camera_scene", self)
        builder.Connect(poses, self.GetInputPort("frame_poses"))
        builder.Connect(
            self.GetOutputPort("geometry_pose"),
            self.scene_graph.get_source_pose_port(self._source),
        )

    def _calc_geometry_pose(
        self, context: Context, output: AbstractValue
    ) -> None:
        known, poses = self._poses.Eval(context), FramePoseVector()
        for frame, own in self.frames.items():
            poses.set_value(own, RigidTransform(known.X_WFs[known.rows[frame]]))
        output.set_value(poses)


@functools.cache
def check_renderer() -> None:
    """Checks that Drake can draw an image.

    Another process draws it: without EGL, drawing ends a process.

    Raises:
        InputError: it cannot.
    """
    words = [sys.executable, "-m", __name__]
    done = subprocess.run(words, capture_output=True, check=False)
    if done.returncode:
        raise InputError(
            "cameras: no renderer: Drake cannot draw here, for lack of EGL "
            "(Debian: apt install libegl1)"
        )


def _as_mesh(corners: np.ndarray, rgb: tuple[float, float, float]) -> Mesh:
    """Returns a glTF mesh of (N, 3, 3) corners of triangles, flat, in a colour.

    The axes of glTF are right, up and backwards: y up.
    """
    first, second, third = np.moveaxis(corners, 1, 0)
    normals = np.cross(second - first, third - first)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0.0, length, 1.0)
    normals[length[:, 0] == 0.0] = (0.0, 0.0, 1.0)
    places = corners.reshape(-1, 3)
    arrays = [
        np.stack([a[:, 0], a[:, 2], -a[:, 1]], axis=1).astype("<f4")
        for a in (places, np.repeat(normals, 3, axis=0))
    ]
    order = np.arange(len(places), dtype="<u4")
    data = b"".join(a.tobytes() for a in (*arrays, order))
    size = arrays[0].nbytes
    # Colours of screens are nearly the roots of light (IEC 61966-2-1).
    light = [float(c) ** 2 for c in rgb]
    number = len(places)
    vector = {"componentType": _FLOAT, "count": number, "type": "VEC3"}
    limits = {
        "min": arrays[0].min(axis=0).tolist(),
        "max": arrays[0].max(axis=0).tolist(),
    }
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "NORMAL": 1},
                        "indices": 2,
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [
            {
                "doubleSided": True,
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*light, 1.0],
                    "metallicFactor": 0.0,
                    "roughnessFactor": 1.0,
                },
            }
        ],
        "buffers": [{"uri": "mesh.bin", "byteLength": len(data)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": k * size, "byteLength": n, "target": t}
            for k, n, t in (
                (0, size, _VERTICES),
                (1, size, _VERTICES),
                (2, order.nbytes, _CORNERS),
            )
        ],
        "accessors": [
            {"bufferView": 0, **vector, **limits},
            {"bufferView": 1, **vector},
            {
                "bufferView": 2,
                "componentType": _UINT,
                "count": number,
                "type": "SCALAR",
            },
        ],
    }
    text = json.dumps(document).encode()
    return Mesh(
        InMemoryMesh(
            mesh_file=MemoryFile(text, ".gltf", "mesh.gltf"),
            supporting_files={"mesh.bin": MemoryFile(data, ".bin", "mesh.bin")},
        )
    )


if __name__ == "__main__":
    core = RenderCameraCore(
        RENDERER,
        CameraInfo(4, 4, 1.0),
        ClippingRange(1.0, 2.0),
        RigidTransform(),
    )
    MakeRenderEngineVtk(RenderEngineVtkParams()).RenderColorImage(
        ColorRenderCamera(core), ImageRgba8U(4, 4)
    )
