"""Traffic in a diagram, and where its limbs are as Drake says."""

from pydrake.geometry import SceneGraph
from pydrake.systems.framework import DiagramBuilder

from cns_drake.traffic import add_traffic


class TrafficDiagram:
    """A plan's traffic, alone in a diagram."""

    def __init__(self, plan, **options):
        builder = DiagramBuilder()
        self._scene_graph = builder.AddSystem(SceneGraph())
        self.traffic = add_traffic(builder, self._scene_graph, plan, **options)
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self.inspector = self._scene_graph.model_inspector()

    def output(self, name, t):
        """What a port of the traffic says at a time."""
        self._context.SetTime(t)
        context = self.traffic.GetMyContextFromRoot(self._context)
        return self.traffic.GetOutputPort(name).Eval(context)

    def limb_poses(self, t):
        """Frame of each limb -> X_WL, from the SceneGraph."""
        self._context.SetTime(t)
        port = self._scene_graph.get_query_output_port()
        found = port.Eval(self._scene_graph.GetMyContextFromRoot(self._context))
        return {
            frame: found.GetPoseInWorld(frame)
            for frame in self.traffic.moving_frames
        }
