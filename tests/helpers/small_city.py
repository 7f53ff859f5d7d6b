"""A small city: a ring of roads with a cross street, three districts."""

ROADS = """
defaults: {lanes: [1, 1], lane_width: 3.5, sidewalk: 3.0, kerb_height: 0.12,
           speed_limit: 10.0}
junctions:
  west: {position: [0, 0], kerb_radius: 6}
  east: {position: [100, 10], kerb_radius: 6}
roads:
  north: {start: west, end: east, via: [[0, 70, 20], [100, 70, 20]]}
  south: {start: east, end: west, via: [[100, -50, 20], [0, -50, 20]]}
  middle: {start: west, end: east, parking: 2.2}
"""
PLAN = """
seed: 3
bounds: [-60, -110, 160, 130]
cars: {saloon: 1}
street: {lamp: lantern, trees: {lime_tree: 1}, furniture: {bench: 1}}
districts:
  - name: north_block
    block: [50, 40]
    ground: paved
    rows:
      - {archetypes: {brick_block: 1, office: 1}, width: [14, 18],
         depth: [12, 14], height: [14, 20]}
  - name: south_block
    block: [50, -25]
    relief: 1.5
    patches: [{ground: gravel, line: [[6, -38], [94, -36]], width: 4}]
    buildings:
      - {archetype: office, at: [30, -21], size: [16, 14], height: 20,
         yaw_deg: 40}
    objects: [{object: statue, at: [70, -28]}]
    scatter: [{objects: {lime_tree: 1}, spacing: 8}]
  - name: outside
    ground: lawn
"""
STAGES = """
stages:
  "01":
    story: without its houses and two of its trees
    absent:
      houses: [brick_block_001, office_001]
      trees: [tree_001, tree_002]
  "02":
    story: all of it
"""


def write_small_city(world):
    """Writes the inputs of the small city into a folder."""
    world.mkdir(parents=True)
    (world / "roads.yaml").write_text(ROADS)
    (world / "city.yaml").write_text(PLAN)
    (world / "stages.yaml").write_text(STAGES)
    return world
