"""Small meshes in OBJ and glTF."""

import base64
import json

import numpy as np

# A prism with an L for a base: not convex, and no symmetry in it.
_BASE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
L_VERTICES = np.array(
    [(x, y, z) for z in (0.0, 1.5) for x, y in _BASE], dtype=np.float32
)
_CAP = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]
L_TRIANGLES = np.array(
    [(c, b, a) for a, b, c in _CAP]
    + [(a + 6, b + 6, c + 6) for a, b, c in _CAP]
    + [(k, (k + 1) % 6, (k + 1) % 6 + 6) for k in range(6)]
    + [(k, (k + 1) % 6 + 6, k + 6) for k in range(6)],
    dtype=np.uint16,
)


def obj_text(vertices=L_VERTICES):
    """The prism, without normals."""
    lines = ["v {} {} {}".format(*p) for p in vertices]
    lines += ["f {} {} {}".format(*(t + 1)) for t in L_TRIANGLES]
    return "\n".join(lines) + "\n"


def stl_text(vertices=L_VERTICES):
    """The prism."""
    lines = ["solid prism"]
    for triangle in vertices[L_TRIANGLES]:
        normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        lines.append("facet normal {} {} {}".format(*normal))
        lines.append("outer loop")
        lines += ["vertex {} {} {}".format(*p) for p in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid prism"]) + "\n"


def ply_text(vertices=L_VERTICES, kind="float"):
    """The prism, with coordinates of a type."""
    rows = ["{} {} {}".format(*p) for p in vertices]
    rows += ["3 {} {} {}".format(*t) for t in L_TRIANGLES]
    return (
        f"ply\nformat ascii 1.0\nelement vertex {len(L_VERTICES)}\n"
        f"property {kind} x\nproperty {kind} y\nproperty {kind} z\n"
        f"element face {len(L_TRIANGLES)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    ) + "".join(f"{row}\n" for row in rows)


# A skin that moves its mesh by a matrix, which is left out. Joints and weights
# do not matter, because the mesh is shown as it was modelled.
SKIN = """<library_controllers><controller id="c"><skin source="#g">
<bind_shape_matrix>{}</bind_shape_matrix></skin></controller>
</library_controllers>"""


def collada_text(vertices=L_VERTICES, place="", skin=""):
    """The prism, its z up, at a place: elements of its node."""
    shown = "controller" if skin else "geometry"
    numbers = " ".join(map(str, vertices.ravel()))
    corners = " ".join(map(str, L_TRIANGLES.ravel()))
    return f"""<COLLADA version="1.4.1"
xmlns="http://www.collada.org/2005/11/COLLADASchema">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="{L_VERTICES.size}">{numbers}</float_array>
<technique_common><accessor source="#a" count="{len(L_VERTICES)}" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{len(L_TRIANGLES)}">
<input semantic="VERTEX" source="#v" offset="0"/><p>{corners}</p></triangles>
</mesh></geometry></library_geometries>{skin}
<library_visual_scenes><visual_scene id="s"><node>{place}
<instance_{shown} url="#{shown[0]}"/>
</node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""


def gltf_text(nodes=({"mesh": 0},), uri=None):
    """The prism, its y up, flat shaded."""
    vertices = L_VERTICES[L_TRIANGLES].reshape(-1, 3)
    a, b, c = vertices[0::3], vertices[1::3], vertices[2::3]
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.repeat(normals, 3, axis=0).astype(np.float32)
    data = vertices.tobytes() + normals.tobytes()
    text = base64.b64encode(data).decode()
    inline = f"data:application/octet-stream;base64,{text}"
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": vertices.nbytes}
        for start in (0, vertices.nbytes)
    ]
    accessor = {"componentType": 5126, "count": len(vertices), "type": "VEC3"}
    limits = {
        "min": vertices.min(axis=0).tolist(),
        "max": vertices.max(axis=0).tolist(),
    }
    attributes = {"POSITION": 0, "NORMAL": 1}
    gltf = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": list(nodes),
        "meshes": [{"primitives": [{"attributes": attributes}]}],
        "accessors": [
            {"bufferView": 0, **accessor, **limits},
            {"bufferView": 1, **accessor},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(data), "uri": uri or inline}],
    }
    return json.dumps(gltf), data
