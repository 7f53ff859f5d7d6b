"""Methods that a test registers, and no later test finds."""

from evaluation.methods import METHODS


def forget_later(patch):
    """Has the methods that are registered from now on forgotten again."""
    assert "solid" in METHODS  # The project's own are loaded once, and stay.
    patch.setattr(METHODS, "_members", dict(METHODS._members))
