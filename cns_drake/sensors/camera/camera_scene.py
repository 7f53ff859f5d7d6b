"""The scene that cameras see: the LiDARs' geometry, as meshes for rendering.

Drake's renderer needs normals, which the meshes of a world may lack, and is
slow with thousands of geometries. All geometry that never moves is therefore
merged into a few meshes: one per surface texture (look) for colour images, and
one per class for depth and label images. The meshes per class have no vertex
colours, which would falsify label images.
"""

from collections.abc import Callable, Collection, Sequence

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    PerceptionProperties,
    RenderLabel,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem

from cns_drake.scene import (
    GREY,
    PerceptionGeometry,
    StructureTable,
    TriangleSurface,
    merge_triangles,
    read_perception_geometry,
    tessellate,
)
from cns_drake.sensors.camera.gltf_mesh import make_mesh
from cns_drake.sensors.camera.renderer import (
    RENDERER,
    check_renderer,
    class_renderer,
    colour_renderer,
)

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
            made: the geometry.
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
