"""The scene that cameras see: the LiDARs' geometry, as meshes for rendering.

Drake's renderer needs normals, which the meshes of a world may lack, and is
slow with thousands of geometries. All geometry that never moves is therefore
merged into a few meshes: one per surface texture (look) for colour images, and
one per class for depth and label images. The meshes per class have no vertex
colours, which would falsify label images.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
import json
from typing import Any

import numpy as np
from pydrake.common import MemoryFile
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    InMemoryMesh,
    Mesh,
    PerceptionProperties,
    RenderLabel,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem

from cns_drake.scene import (
    GREY,
    PerceptionGeometry,
    TriangleSurface,
    merge_triangles,
    read_perception_geometry,
    reads_vertex_colours_as_srgb,
    tessellate,
)
from cns_drake.sensors.camera.looks import GAMMA, LOOKS, texture
from cns_drake.sensors.camera.renderer import (
    RENDERER,
    check_renderer,
    class_renderer,
    colour_renderer,
)
from worlds.shapes import StructureTable

# Sides of the polygon in place of a circle: true to 0.1 % of the radius.
_SIDES = 64
# Pose, colour and surface of a geometry.
_Member = tuple[RigidTransform, tuple[float, float, float], TriangleSurface]
# What the geometries of one mesh share: kind of the copy; frame (None for
# geometry that never moves); and group, which is the name of a look in the copy
# for colours, and the number of a class in the copy for classes.
_MeshKey = tuple[str, FrameId | None, str | int]


class CameraScene(LeafSystem):
    """A copy, for rendering, of a SceneGraph's geometry; frames can move.

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
        renderers = {"colours": colour_renderer()}
        if classes:
            renderers["classes"] = class_renderer()
        self.scene_graphs = {kind: SceneGraph() for kind in renderers}
        self._sources = {}
        for kind, scene in self.scene_graphs.items():
            scene.AddRenderer(RENDERER, renderers[kind])
            self._sources[kind] = scene.RegisterSource("cameras")
        geometries = read_perception_geometry(
            scene_graph.model_inspector(), lambda frame: frame not in vehicle
        )
        parts = _group_geometries(geometries, structures, calc_X_WF, anchored)
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
                made = _make_instance(f"mesh_{k}", group, members)
                self._register(kind, frame, made)
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
        self, kind: str, frame: FrameId | None, made: GeometryInstance
    ) -> None:
        """Registers a geometry with one of the copies.

        Args:
            kind: kind of the copy, a key of `scene_graphs`.
            frame: the moving frame in the original that carries the geometry;
                None for geometry that never moves.
        """
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


def _group_geometries(
    geometries: Sequence[PerceptionGeometry],
    structures: StructureTable,
    calc_X_WF: Callable[[FrameId], RigidTransform],
    anchored: Collection[FrameId],
) -> dict[_MeshKey, list[_Member]]:
    """Returns the geometries that form each mesh, for both kinds of copy.

    For the arguments, see `CameraScene`.
    """
    table = structures.completed(shape.structure for shape in geometries)
    parts: dict[_MeshKey, list[_Member]] = {}
    for shape in geometries:
        frame, X_FG = shape.frame_id, shape.X_FG
        is_anchored = frame in anchored
        if is_anchored:
            X_FG = calc_X_WF(frame) @ X_FG
        entry = table[shape.structure]
        rgb = shape.rgb or GREY
        surface = tessellate(shape.surface, _SIDES)
        look = entry.material(shape.part).look
        for kind, group in (("colours", look), ("classes", entry.label)):
            key = kind, None if is_anchored else frame, group
            parts.setdefault(key, []).append((X_FG, rgb, surface))
    return parts


def _make_instance(
    name: str, group: str | int, members: Sequence[_Member]
) -> GeometryInstance:
    """Returns geometries merged into one mesh, ready to be registered.

    Args:
        name: name of the mesh, unique in its copy.
        group: name of the look that the geometries share, or number of their
            class, which is then also their render label.
        members: pose in the mesh's frame (or in the world if it never moves),
            colour and surface of each geometry.
    """
    merged, owners = merge_triangles(
        [(k, X, surface) for k, (X, _, surface) in enumerate(members)]
    )
    rgb = np.array([rgb for _, rgb, _ in members])[owners]
    corners = merged.p_GVset[merged.triangles]
    # A mesh has coordinates in single precision, which are too coarse far from
    # its origin. Whole metres are exact in single precision, too.
    middle = np.round(corners.mean(axis=(0, 1)))
    fronts = np.stack([X.rotation().matrix()[:, 1] for X, *_ in members])
    mesh = make_mesh(corners, middle, rgb, group, owners, fronts)
    made = GeometryInstance(RigidTransform(middle), mesh, name)
    properties = PerceptionProperties()
    is_look = isinstance(group, str)
    label = RenderLabel.kDontCare if is_look else RenderLabel(group)
    properties.AddProperty("label", "id", label)
    made.set_perception_properties(properties)
    return made


# Component types of glTF 2.0.
_FLOAT = 5126
_UINT = 5125
# Targets of buffer views in glTF 2.0.
_VERTICES = 34962
_CORNERS = 34963
# Filters of textures in glTF 2.0: linear, with linear mipmaps where small.
_LINEAR = 9729
_LINEAR_MIPMAP_LINEAR = 9987


def make_mesh(
    corners: np.ndarray,
    middle: np.ndarray,
    rgb: np.ndarray,
    look: str | int,
    owners: np.ndarray,
    fronts: np.ndarray,
) -> Mesh:
    """Returns a glTF mesh of N flat-shaded triangles.

    Args:
        corners: (N, 3, 3) corners of the triangles.
        middle: (3,) origin of the mesh.
        rgb: (N, 3) sRGB colours; not used for a class.
        look: name of a look, or the number of a class.
        owners: (N,) index of the geometry that a triangle belongs to.
        fronts: (M, 3) direction in which each geometry faces.
    """
    normals = _unit_normals(corners)
    arrays = {
        "POSITION": _along_gltf_axes((corners - middle).reshape(-1, 3)),
        "NORMAL": _along_gltf_axes(np.repeat(normals, 3, axis=0)),
    }
    material: dict[str, Any] = {"doubleSided": True}
    files: dict[str, bytes] = {}
    textures: dict[str, Any] = {}
    if isinstance(look, str):
        png, white = texture(look)
        files["look.png"] = png
        tiles = _texture_coordinates(look, corners, normals, owners, fronts)
        arrays["TEXCOORD_0"] = tiles.reshape(-1, 2)
        if LOOKS[look].is_face:
            rgb = np.ones_like(rgb)
        arrays["COLOR_0"] = np.repeat(_vertex_colours(rgb, white), 3, axis=0)
        material |= _textured_material(look)
        textures = {
            "images": [{"uri": "look.png"}],
            "samplers": [
                {"minFilter": _LINEAR_MIPMAP_LINEAR, "magFilter": _LINEAR}
            ],
            "textures": [{"source": 0, "sampler": 0}],
        }
    document, files["mesh.bin"] = _encode_gltf(arrays, material, textures)
    return Mesh(
        InMemoryMesh(
            mesh_file=MemoryFile(document, ".gltf", "mesh.gltf"),
            supporting_files={
                name: MemoryFile(data, name[-4:], name)
                for name, data in files.items()
            },
        )
    )


def _unit_normals(corners: np.ndarray) -> np.ndarray:
    """Returns unit normals (N, 3); (0, 0, 1) for triangles without an area."""
    first, second, third = np.moveaxis(corners, 1, 0)
    normals = np.cross(second - first, third - first)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0.0, length, 1.0)
    normals[length[:, 0] == 0.0] = (0.0, 0.0, 1.0)
    return normals


def _along_gltf_axes(vectors: np.ndarray) -> np.ndarray:
    """Returns vectors (K, 3) along glTF's axes: right, up and backwards."""
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)


def _texture_coordinates(
    look: str,
    corners: np.ndarray,
    normals: np.ndarray,
    owners: np.ndarray,
    fronts: np.ndarray,
) -> np.ndarray:
    """Returns the texture coordinates (N, 3, 2) of triangles with a look.

    Traffic signals show red in one street, and green in the crossing street.
    Their sides and backs show the dark corner of the texture.
    """
    if not LOOKS[look].is_face:
        tiles = repeated_coordinates(corners, normals) / LOOKS[look].size
        tiles -= np.floor(tiles.min(axis=1, keepdims=True))
        return tiles
    tiles = face_coordinates(corners, normals, owners)
    if look == "signals":
        front = fronts[owners]
        tiles = tiles * (0.5, 1.0)
        tiles[abs(front[:, 0]) > abs(front[:, 1]), :, 0] += 0.5
        tiles[(front * normals).sum(axis=1) < 0.9] = 0.01
    return tiles


def _vertex_colours(rgb: np.ndarray, white: float) -> np.ndarray:
    """Returns colours as Drake's renderer takes them, given sRGB (N, 3).

    `white` is the factor for the brightness of the texture, from `texture`.
    """
    light = np.minimum(rgb**GAMMA * white, 1.0)
    return light ** (1.0 / GAMMA) if reads_vertex_colours_as_srgb() else light


def _textured_material(look: str) -> dict[str, Any]:
    """Returns the properties of a glTF material with the texture of a look."""
    material: dict[str, Any] = {}
    if look == "signals":
        material["emissiveFactor"] = [1.0] * 3
        material["emissiveTexture"] = {"index": 0}
    return material | {
        "alphaMode": "MASK" if look == "leaves" else "OPAQUE",
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "metallicFactor": 0.0,
            "roughnessFactor": LOOKS[look].roughness,
        },
    }


def _encode_gltf(
    arrays: Mapping[str, np.ndarray],
    material: Mapping[str, Any],
    textures: Mapping[str, Any],
) -> tuple[bytes, bytes]:
    """Returns the glTF document of one mesh, and the content of `mesh.bin`.

    Args:
        arrays: name of an attribute -> its values, one row for each vertex;
            three consecutive vertices are a triangle.
        material: properties of the material.
        textures: the entries `images`, `samplers` and `textures`, if any.
    """
    num_vertices = len(arrays["POSITION"])
    kinds = [*(f"VEC{array.shape[1]}" for array in arrays.values()), "SCALAR"]
    parts = [array.astype("<f4") for array in arrays.values()]
    parts.append(np.arange(num_vertices, dtype="<u4"))
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
                        "attributes": {k: n for n, k in enumerate(arrays)},
                        "indices": len(arrays),
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [material],
        **textures,
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
                "count": num_vertices,
                "type": kind,
            }
            for k, kind in enumerate(kinds)
        ],
    }
    document["accessors"][0] |= {
        "min": parts[0].min(axis=0).tolist(),
        "max": parts[0].max(axis=0).tolist(),
    }
    content = b"".join(part.tobytes() for part in parts)
    return json.dumps(document).encode(), content


def repeated_coordinates(
    corners: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """Returns coordinates in metres, for textures that are repeated.

    On walls, the rows of a texture are horizontal. Divided by the size of a
    texture, the results are texture coordinates.

    Args:
        corners: (N, 3, 3) corners of the triangles [m].
        normals: (N, 3) unit normals of the triangles.

    Returns:
        (N, 3, 2) coordinates of the corners: to the right and downwards [m].
    """
    across = np.round(np.stack([-normals[:, 1], normals[:, 0]], axis=1), 3)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    is_flat = length[:, 0] < 0.5
    across = np.where(is_flat[:, None], (1.0, 0.0), across / (length + 1e-9))
    along = np.einsum("nca,na->nc", corners[:, :, :2], across)
    height = np.where(is_flat[:, None], corners[:, :, 1], corners[:, :, 2])
    return np.stack([along, -height], axis=2)


def face_coordinates(
    corners: np.ndarray, normals: np.ndarray, owners: np.ndarray
) -> np.ndarray:
    """Returns texture coordinates with which one texture covers each geometry.

    Args:
        corners: (N, 3, 3) corners of the triangles of all geometries [m].
        normals: (N, 3) unit normals of the triangles.
        owners: (N,) index of each triangle's geometry.

    Returns:
        (N, 3, 2) texture coordinates of the corners, which run from 0 to 1 over
        each geometry.
    """
    low = np.full((owners.max() + 1, 3), np.inf)
    high = -low
    np.minimum.at(low, owners, corners.min(axis=1))
    np.maximum.at(high, owners, corners.max(axis=1))
    middle = (low + high) / 2.0
    tiles = repeated_coordinates(corners - middle[owners][:, None], normals)
    half = np.full((len(middle), 2), 1e-3)
    np.maximum.at(half, owners, np.abs(tiles).max(axis=1))
    return 0.5 + 0.5 * tiles / half[owners][:, None]
