"""Geometry that changes between two scans, against fresh LiDARs.

After a change a LiDAR measures, bit for bit, the same as a fresh LiDAR.
SceneGraph's own signed distances agree with it.
"""

from helpers.drake_distances import marched_range
from helpers.lidar_stage import FORWARD, Stage, ahead
import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import (
    Box,
    Ellipsoid,
    GeometryInstance,
    IllustrationProperties,
    Mesh,
    PerceptionProperties,
    ProximityProperties,
    Role,
    RoleAssign,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import BusValue
import pytest

from cns_drake.scene import geometry_port, listed_geometry
from cns_drake.sensors import Lidar, make_beam_pattern

PATTERN = make_beam_pattern("vlp-16", 0.05, num_columns=60, min_range=0.0)


def instance(name, shape, X_FG=None, roles=("perception", "proximity")):
    made = GeometryInstance(X_FG or RigidTransform(), shape, name)
    for role, properties in (
        ("perception", PerceptionProperties()),
        ("proximity", ProximityProperties()),
        ("illustration", IllustrationProperties()),
    ):
        if role in roles:
            getattr(made, f"set_{role}_properties")(properties)
    return made


class Site:
    """A stage with a crate that can be changed, in its model or its Context.

    Roles beside perception make SceneGraph's own version notice more, so
    that perception alone is the hard case.
    """

    def __init__(self, connected, roles=("perception",)):
        self.roles = roles
        self.stage = Stage()
        graph = self.stage.scene_graph
        self.frame = self.stage.add_frame("site", 5, RigidTransform([10, 0, 0]))
        self.crate = graph.RegisterGeometry(
            self.stage.source, self.frame, self.make("crate", Box(2, 2, 2))
        )
        self.stage.add("wall", Box(1.0, 9.0, 9.0), RigidTransform([20.5, 0, 0]))
        pose = RigidTransform()
        if connected:
            self.stage.finish(X_PS=pose, pattern=FORWARD)
        else:
            self.stage.lidar = self.stage.builder.AddNamedSystem(
                "lidar", Lidar(graph.world_frame_id(), pose, FORWARD)
            )
            self.stage.builder.Connect(
                graph.get_query_output_port(),
                self.stage.lidar.GetInputPort("geometry_query"),
            )
            self.stage.diagram = self.stage.builder.Build()
            self.stage.context = self.stage.diagram.CreateDefaultContext()
            self.stage.set_poses()

    def make(self, name, shape):
        return instance(name, shape, roles=self.roles)

    @property
    def context(self):
        return self.stage.scene_graph.GetMyMutableContextFromRoot(
            self.stage.context
        )

    def ahead(self):
        return ahead(self.stage.eval())


def replace(site):
    graph, source = site.stage.scene_graph, site.stage.source
    graph.RemoveGeometry(site.context, source, site.crate)
    graph.RegisterGeometry(
        site.context, source, site.frame, site.make("crate", Box(4, 2, 2))
    )


def add(site):
    site.stage.scene_graph.RegisterGeometry(
        site.context,
        site.stage.source,
        site.frame,
        site.make("second", Box(4, 2, 2)),
    )


def reshape(site):
    site.stage.scene_graph.ChangeShape(
        site.context, site.stage.source, site.crate, Box(4, 2, 2)
    )


def move_on_its_frame(site):
    site.stage.scene_graph.ChangeShape(
        site.context,
        site.stage.source,
        site.crate,
        Box(2, 2, 2),
        RigidTransform([-1.0, 0, 0]),
    )


def exchange_roles(site):
    """The number of geometries with the role stays the same."""
    graph, source = site.stage.scene_graph, site.stage.source
    twin = graph.RegisterGeometry(
        site.context,
        source,
        site.frame,
        instance("twin", Box(4, 2, 2), roles=()),
    )
    site.ahead()
    graph.RemoveRole(site.context, source, site.crate, Role.kPerception)
    graph.AssignRole(
        site.context, source, twin, PerceptionProperties(), RoleAssign.kNew
    )


@pytest.mark.parametrize("connected", [True, False])
@pytest.mark.parametrize(
    "roles", [("perception",), ("perception", "illustration")]
)
@pytest.mark.parametrize(
    "change", [replace, add, reshape, move_on_its_frame, exchange_roles]
)
def test_a_change_is_seen(change, connected, roles):
    site = Site(connected, roles)
    assert site.ahead() == pytest.approx(9.0, abs=1e-5)
    original = site.stage.context.Clone()
    change(site)
    assert site.ahead() == pytest.approx(8.0, abs=1e-5)
    site.stage.context = original
    assert site.ahead() == pytest.approx(9.0, abs=1e-5)


@pytest.mark.parametrize("how", ["removed", "without its role"])
def test_removed_geometry_is_not_seen(how):
    site = Site(True)
    assert site.ahead() == pytest.approx(9.0, abs=1e-5)
    graph, source = site.stage.scene_graph, site.stage.source
    if how == "removed":
        graph.RemoveGeometry(site.context, source, site.crate)
    else:
        graph.RemoveRole(site.context, source, site.crate, Role.kPerception)
    assert site.ahead() == pytest.approx(20.0, abs=1e-5)


def test_a_change_of_the_model_is_seen_by_new_contexts():
    site = Site(True)
    assert site.ahead() == pytest.approx(9.0, abs=1e-5)
    graph, source = site.stage.scene_graph, site.stage.source
    graph.ChangeShape(source, site.crate, Box(4, 2, 2))
    assert site.ahead() == pytest.approx(9.0, abs=1e-5)
    site.stage.context = site.stage.diagram.CreateDefaultContext()
    site.stage.set_poses()
    assert site.ahead() == pytest.approx(8.0, abs=1e-5)


def test_an_anchored_frame_may_move_after_all():
    """A weld's pose is a parameter, so that a Context may change it."""
    stage = Stage()
    shelf = stage.add_frame("shelf", 5, RigidTransform([10.0, 0.0, 0.0]))
    stage.add("board", Box(2, 2, 2), frame=shelf)
    stage.finish(
        X_PS=RigidTransform(), pattern=FORWARD, anchored_frames=[shelf]
    )
    assert ahead(stage.eval()) == pytest.approx(9.0, abs=1e-5)
    stage.poses[shelf] = RigidTransform([13.0, 0.0, 0.0])
    stage.set_poses()
    assert ahead(stage.eval()) == pytest.approx(12.0, abs=1e-5)


def content(listed):
    return [
        (one.geometry_id, one.name, one.frame_id, repr(one.shape), one.rgb)
        for one in listed
    ]


def test_the_port_of_geometry_is_a_function_of_the_context():
    site = Site(True)
    graph = site.stage.scene_graph
    port = geometry_port(graph, Role.kPerception)
    assert graph.num_output_ports() == 2

    def listed(context):
        return listed_geometry(port.Eval(context))

    # A thread without Python can allocate a Context.
    default = port.Allocate()
    assert isinstance(default, Value[BusValue])
    first = listed(site.context)
    assert [one.name for one in first] == ["crate", "wall"]
    # Poses and time do not count: the very same list is kept.
    site.stage.context.SetTime(3.0)
    site.stage.poses[site.frame] = RigidTransform([30, 0, 0])
    site.stage.set_poses()
    site.ahead()
    assert listed(site.context) is first
    clone = site.stage.context.Clone()
    assert listed(graph.GetMyContextFromRoot(clone)) is first
    for _ in range(2):
        fresh = site.stage.diagram.CreateDefaultContext()
        fresh.DisableCaching()
        for _ in range(2):
            again = listed(graph.GetMyContextFromRoot(fresh))
            assert content(again) == content(first)
    reshape(site)
    assert content(listed(site.context)) != content(first)
    site.stage.context.SetTimeStateAndParametersFrom(clone)
    assert content(listed(site.context)) == content(first)


def test_each_role_has_a_port_of_its_geometry():
    stage = Stage()
    for name, roles in (
        ("a", ("perception",)),
        ("b", ("illustration", "proximity")),
    ):
        stage.scene_graph.RegisterAnchoredGeometry(
            stage.source, instance(name, Sphere(1.0), roles=roles)
        )
    ports = {
        role: geometry_port(stage.scene_graph, role)
        for role in (Role.kPerception, Role.kProximity)
    }
    stage.finish()
    context = stage.scene_graph.GetMyContextFromRoot(stage.context)
    names = {
        role: [one.name for one in listed_geometry(port.Eval(context))]
        for role, port in ports.items()
    }
    assert names == {Role.kPerception: ["a"], Role.kProximity: ["b"]}


@pytest.mark.parametrize("caching", [True, False])
def test_a_clone_of_a_context_is_scanned_like_it(caching):
    site = Site(True)
    if not caching:
        site.stage.context.DisableCaching()
    scan = site.stage.eval()
    for _ in range(2):
        site.stage.context = site.stage.context.Clone()
        own = site.stage.lidar.GetMyContextFromRoot(site.stage.context)
        hits = site.stage.lidar.CastRays(own, np.zeros(3), np.eye(3)[:1])
        assert hits.ranges == pytest.approx([9.0], abs=1e-5)
        np.testing.assert_array_equal(site.stage.eval(), scan)


class Storm:
    """Many random changes, one after the other."""

    def __init__(self, seed, folder):
        self.rng = np.random.default_rng(seed)
        self.stage = Stage()
        self.frames = [
            self.stage.add_frame(f"f{k}", k, self.pose()) for k in range(4)
        ]
        self.known = []
        self.count = 0
        self.mesh = folder / "tetrahedron.obj"
        self.mesh.write_text(
            "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\n"
            "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
        )
        self.stage.finish(X_PS=RigidTransform(), pattern=PATTERN)

    def pose(self):
        return RigidTransform(
            RollPitchYaw(self.rng.uniform(-3, 3, 3)),
            self.rng.uniform(-8, 8, 3),
        )

    def shape(self):
        sizes = self.rng.uniform(1.0, 5.0, 3)
        kind = self.rng.integers(4)
        if kind == 0:
            return Mesh(self.mesh, sizes)
        return (Box(*sizes), Sphere(sizes[0]), Ellipsoid(*sizes))[kind - 1]

    def change(self):
        graph, source = self.stage.scene_graph, self.stage.source
        context = graph.GetMyMutableContextFromRoot(self.stage.context)
        kind = self.rng.integers(3) if len(self.known) > 9 else 0
        if kind == 0:
            self.count += 1
            frame = self.frames[self.rng.integers(4)]
            if self.rng.random() < 0.5:
                frame = graph.world_frame_id()
            made = instance(f"g{self.count}", self.shape(), self.pose())
            self.known.append(
                graph.RegisterGeometry(context, source, frame, made)
            )
        elif kind == 1:
            victim = self.known[self.rng.integers(len(self.known))]
            graph.ChangeShape(context, source, victim, self.shape())
        else:
            victim = self.known.pop(self.rng.integers(len(self.known)))
            graph.RemoveGeometry(context, source, victim)
        if self.rng.random() < 0.5:
            frame = self.frames[self.rng.integers(4)]
            self.stage.poses[frame] = self.pose()
            self.stage.set_poses()


@pytest.mark.parametrize("seed", range(3))
def test_many_changes_leave_nothing_behind(seed, tmp_path):
    storm = Storm(seed, tmp_path)
    stage = storm.stage
    storm.stage.eval()
    checked = 0
    for step in range(40):
        storm.change()
        scan = stage.eval()
        fresh = stage.context.Clone()
        used = stage.context
        stage.context = fresh
        np.testing.assert_array_equal(scan, stage.eval())
        stage.context = used
        if step % 8 == 7:
            checked += compare_with_distances(stage, scan, storm.rng)
    assert checked > 5


def compare_with_distances(stage, scan, rng):
    """Returns how many beams met something."""
    query_object = stage.scene_graph.get_query_output_port().Eval(
        stage.scene_graph.GetMyContextFromRoot(stage.context)
    )
    pattern = stage.lidar.pattern
    measured = np.full(pattern.num_beams, np.inf)
    beams = (scan["t"] / (pattern.period * 1e9 / 60)).round().astype(int)
    beams = beams * pattern.num_rings + scan["ring"]
    measured[beams] = np.linalg.norm(
        np.stack([scan["x"], scan["y"], scan["z"]], axis=1), axis=1
    )
    some = rng.choice(pattern.num_beams, 30)
    expected = [
        marched_range(query_object, np.zeros(3), pattern.d_Sset[k], 100.0)
        for k in some
    ]
    # Within a shape distances are negative, and rays do not advance.
    outside = np.array(expected) > 0.0
    close = np.isclose(expected, measured[some], atol=2e-3)
    assert (close | ~outside).mean() > 0.9
    return int(np.isfinite(measured[some]).sum())
