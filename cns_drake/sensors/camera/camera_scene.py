"""The scene that cameras see: the LiDARs' geometry, as meshes for rendering.

Drake's renderer needs normals, which the meshes of a world may lack, and is
slow with thousands of geometries. All geometry that never moves is therefore
merged into a few meshes: one per surface texture (look) for colour images, and
one per class for depth and label images. The meshes per class have no vertex
colours, which would falsify label images.
"""

from collections.abc import Callable, Collection
import functools
import json
import subprocess
import sys
from typing import Any

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
    Rgba,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem
from pydrake.systems.sensors import CameraInfo, ImageRgba8U

from cns_drake.base.errors import InputError
from cns_drake.scene.drake_releases import takes_screen_colours
from cns_drake.scene.perception_geometry import read_perception_geometry
from cns_drake.scene.structure_table import StructureTable
from cns_drake.scene.surfaces import (
    TriangleSurface,
    merge_triangles,
    tessellate,
)
from cns_drake.sensors.camera.looks import (
    GAMMA,
    HORIZON_RGB,
    LOOKS,
    SUN_W,
    face_places,
    texture,
    texture_places,
)

RENDERER = "cameras"
# Sides of a circle: true to 0.1 % of its radius.
_SIDES = 64
_GREY = (0.5, 0.5, 0.5)
# Pixels of a side of the map of the sun's shadows, over the whole scene.
_SHADOW_PIXELS = 4096
# The sun, and far lamps without shadows in place of the sky: direction that the
# light comes from, strength and colour.
_LIGHTS = [
    LightParameter(
        type="directional",
        frame="world",
        direction=-SUN_W,
        intensity=4.0,
        color=Rgba(1.0, 0.94, 0.84),
    ),
    *(
        LightParameter(
            type="point",
            frame="world",
            position=1e5 * np.array(place),
            intensity=strength,
            color=Rgba(*rgb),
        )
        for place, strength, rgb in (
            ((0.1, -0.2, 1.0), 1.3, (0.75, 0.87, 1.0)),
            ((0.9, 0.3, -0.3), 0.75, (0.9, 0.95, 1.0)),
            ((-0.2, -0.9, -0.3), 0.75, (0.9, 0.95, 1.0)),
            ((-0.7, 0.7, -0.3), 0.65, (1.0, 0.95, 0.9)),
        )
    ),
]
# Component types of glTF 2.0.
_FLOAT = 5126
_UINT = 5125
# Targets of buffer views in glTF 2.0.
_VERTICES = 34962
_CORNERS = 34963
# Pose, colour and surface of a geometry.
_Member = tuple[RigidTransform, tuple[float, float, float], TriangleSurface]


class CameraScene(LeafSystem):
    """A copy of a SceneGraph's geometry for rendering, whose frames can move.

    .. pydrake_system::

        name: CameraScene
        input_ports:
        - frame_poses
        output_ports:
        - geometry_pose

    The input `frame_poses` is abstract, of type `KnownPoses`: the poses of the
    frames that move. The output supplies these poses to the copy.

    Attributes:
        scene_graphs: the copies, as kind -> SceneGraph. The kind `colours` is
            for colour images; the kind `classes` exists if depth or label
            images are recorded.
        frames: id of a moving frame in the original -> id of its copy, which is
            the same in all `scene_graphs`.
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
        classes: bool,
    ):
        """Copies a scene.

        Args:
            scene_graph: SceneGraph with geometry of the perception role.
            structures: table of the structures' classes.
            calc_X_WF: function that returns the pose of an anchored frame.
            anchored: frames that never move, the world's included.
            vehicle: frames whose geometry the cameras do not see.
            base: the frame that carries the cameras.
            classes: whether any camera records depths or classes.

        Raises:
            InputError: Drake cannot render here.
        """
        super().__init__()
        check_renderer()
        engines = {
            "colours": RenderEngineVtkParams(
                default_clear_color=HORIZON_RGB,
                lights=_LIGHTS,
                cast_shadows=True,
                shadow_map_size=_SHADOW_PIXELS,
            )
        }
        if classes:
            engines["classes"] = RenderEngineVtkParams()
        self.scene_graphs = {kind: SceneGraph() for kind in engines}
        self._sources = {}
        for kind, scene in self.scene_graphs.items():
            scene.AddRenderer(RENDERER, MakeRenderEngineVtk(engines[kind]))
            self._sources[kind] = scene.RegisterSource("cameras")
        geometries = read_perception_geometry(
            scene_graph.model_inspector(), lambda frame: frame not in vehicle
        )
        table = structures.completed(one.structure for one in geometries)
        parts: dict[tuple, list[_Member]] = {}
        for one in geometries:
            frame, X_FG = one.frame_id, one.X_FG
            is_anchored = frame in anchored
            if is_anchored:
                X_FG = calc_X_WF(frame) @ X_FG
            entry = table[one.structure]
            rgb = one.rgb or _GREY
            surface = tessellate(one.surface, _SIDES)
            look = entry.material(one.part).look
            for kind, group in (("colours", look), ("classes", entry.label)):
                key = kind, None if is_anchored else frame, group
                parts.setdefault(key, []).append((X_FG, rgb, surface))
        moving = dict.fromkeys([base, *(key[1] for key in parts if key[1])])
        self.frames = {
            frame: GeometryFrame(f"frame_{k}") for k, frame in enumerate(moving)
        }
        for kind, scene in self.scene_graphs.items():
            for frame in self.frames.values():
                scene.RegisterFrame(self._sources[kind], frame)
        self.frames = {f: own.id() for f, own in self.frames.items()}
        for k, ((kind, frame, group), members) in enumerate(parts.items()):
            if kind in self.scene_graphs:
                self._register(f"mesh_{k}", kind, frame, group, members)
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
        kind: str,
        frame: FrameId | None,
        group: str | int,
        members: list[_Member],
    ) -> None:
        """Registers merged geometry; it is anchored if `frame` is None."""
        merged, owners = merge_triangles(
            [(k, X, surface) for k, (X, _, surface) in enumerate(members)]
        )
        rgb = np.array([rgb for _, rgb, _ in members])[owners]
        corners = merged.p_GVset[merged.triangles]
        middle = np.round(corners.mean(axis=(0, 1)))
        fronts = np.stack([X.rotation().matrix()[:, 1] for X, *_ in members])
        mesh = _as_mesh(corners, middle, rgb, group, owners, fronts)
        made = GeometryInstance(RigidTransform(middle), mesh, name)
        properties = PerceptionProperties()
        is_class = kind == "classes"
        label = RenderLabel(group) if is_class else RenderLabel.kDontCare
        properties.AddProperty("label", "id", label)
        made.set_perception_properties(properties)
        scene_graph, source = self.scene_graphs[kind], self._sources[kind]
        if frame is None:
            scene_graph.RegisterAnchoredGeometry(source, made)
        else:
            scene_graph.RegisterGeometry(source, self.frames[frame], made)

    def connect(self, builder: DiagramBuilder, poses: object) -> None:
        """Adds this system and its SceneGraphs to a diagram.

        Args:
            builder: builder of the diagram.
            poses: output port that supplies the input `frame_poses`.
        """
        builder.AddNamedSystem("camera_scene", self)
        builder.Connect(poses, self.GetInputPort("frame_poses"))
        for kind, scene in self.scene_graphs.items():
            builder.AddNamedSystem(f"camera_{kind}", scene)
            builder.Connect(
                self.GetOutputPort("geometry_pose"),
                scene.get_source_pose_port(self._sources[kind]),
            )

    def _calc_geometry_pose(
        self, context: Context, output: AbstractValue
    ) -> None:
        known = self._poses.Eval(context)
        poses = FramePoseVector()
        for frame, own in self.frames.items():
            poses.set_value(own, RigidTransform(known.X_WFs[known.rows[frame]]))
        output.set_value(poses)


@functools.cache
def check_renderer() -> None:
    """Checks that Drake can render images on this machine.

    The check renders in a second process, because rendering without EGL kills
    the process.

    Raises:
        InputError: Drake cannot render here.
    """
    words = [sys.executable, "-m", __name__]
    done = subprocess.run(words, capture_output=True, check=False)
    if done.returncode:
        raise InputError(
            "cameras: no renderer: Drake cannot draw here, for lack of EGL "
            "(Debian: apt install libegl1)"
        )


def _as_mesh(
    corners: np.ndarray,
    middle: np.ndarray,
    rgb: np.ndarray,
    look: str | int,
    owners: np.ndarray,
    fronts: np.ndarray,
) -> Mesh:
    """Returns a glTF mesh of N flat-shaded triangles.

    glTF's axes are right, up and backwards.

    Args:
        corners: (N, 3, 3) corners of the triangles.
        middle: (3,) origin of the mesh.
        rgb: (N, 3) sRGB colours; not used for a class.
        look: name of a look, or the number of a class.
        owners: (N,) index of the geometry that a triangle belongs to.
        fronts: (M, 3) direction in which each geometry faces.
    """
    first, second, third = np.moveaxis(corners, 1, 0)
    normals = np.cross(second - first, third - first)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0.0, length, 1.0)
    normals[length[:, 0] == 0.0] = (0.0, 0.0, 1.0)
    places = (corners - middle).reshape(-1, 3)
    arrays = [
        np.stack([a[:, 0], a[:, 2], -a[:, 1]], axis=1)
        for a in (places, np.repeat(normals, 3, axis=0))
    ]
    kinds = ["VEC3", "VEC3"]
    attributes = {"POSITION": 0, "NORMAL": 1}
    material: dict[str, Any] = {"doubleSided": True}
    files: dict[str, bytes] = {}
    extra: dict[str, Any] = {}
    if isinstance(look, str):
        files["look.png"], white = texture(look)
        if LOOKS[look].is_face:
            tiles = face_places(corners, normals, owners)
            rgb = np.ones_like(rgb)
            if look == "signals":
                front = fronts[owners]
                tiles = tiles * (0.5, 1.0)
                tiles[abs(front[:, 0]) > abs(front[:, 1]), :, 0] += 0.5
                tiles[(front * normals).sum(axis=1) < 0.9] = 0.01
                material["emissiveFactor"] = [1.0] * 3
                material["emissiveTexture"] = {"index": 0}
        else:
            tiles = texture_places(corners, normals) / LOOKS[look].size
            tiles -= np.floor(tiles.min(axis=1, keepdims=True))
        light = np.minimum(rgb**GAMMA * white, 1.0)
        if takes_screen_colours():
            light = light ** (1.0 / GAMMA)
        arrays += [tiles.reshape(-1, 2), np.repeat(light, 3, axis=0)]
        kinds += ["VEC2", "VEC3"]
        attributes |= {"TEXCOORD_0": 2, "COLOR_0": 3}
        material |= {
            "alphaMode": "MASK" if look == "leaves" else "OPAQUE",
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0},
                "metallicFactor": 0.0,
                "roughnessFactor": LOOKS[look].roughness,
            },
        }
        extra = {
            "images": [{"uri": "look.png"}],
            "samplers": [{"minFilter": 9987, "magFilter": 9729}],
            "textures": [{"source": 0, "sampler": 0}],
        }
    kinds.append("SCALAR")
    number = len(places)
    parts = [a.astype("<f4") for a in arrays]
    parts.append(np.arange(number, dtype="<u4"))
    ends = np.cumsum([0, *(part.nbytes for part in parts)]).tolist()
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": attributes,
                        "indices": len(attributes),
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [material],
        **extra,
        "buffers": [{"uri": "mesh.bin", "byteLength": ends[-1]}],
        "bufferViews": [
            {
                "buffer": 0,
                "byteOffset": start,
                "byteLength": part.nbytes,
                "target": _CORNERS if kind == "SCALAR" else _VERTICES,
            }
            for start, part, kind in zip(ends, parts, kinds, strict=False)
        ],
        "accessors": [
            {
                "bufferView": k,
                "componentType": _UINT if kind == "SCALAR" else _FLOAT,
                "count": number,
                "type": kind,
            }
            for k, kind in enumerate(kinds)
        ],
    }
    document["accessors"][0] |= {
        "min": parts[0].min(axis=0).tolist(),
        "max": parts[0].max(axis=0).tolist(),
    }
    files["mesh.bin"] = b"".join(part.tobytes() for part in parts)
    text = json.dumps(document).encode()
    return Mesh(
        InMemoryMesh(
            mesh_file=MemoryFile(text, ".gltf", "mesh.gltf"),
            supporting_files={
                name: MemoryFile(data, name[-4:], name)
                for name, data in files.items()
            },
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
