"""Ray casting on the geometry of a SceneGraph."""
