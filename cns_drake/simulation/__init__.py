"""A scenario as a Drake Diagram, and its simulation."""
