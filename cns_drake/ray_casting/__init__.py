"""Ray casting on SceneGraph's geometry."""
