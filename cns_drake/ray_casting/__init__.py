"""Rays on SceneGraph's geometry: hierarchies and the casting on them."""
