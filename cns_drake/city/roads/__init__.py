"""Road networks: centrelines, lanes, junctions, surfaces."""
