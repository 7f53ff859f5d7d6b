"""Methods that a test registers, and no later test finds."""

from evaluation.methods import registry


def forget_later(patch):
    """Has the methods that are registered from now on forgotten again."""
    patch.setattr(registry, "_METHODS", dict(registry._METHODS))
