"""A scenario as a Drake Diagram, and what runs it."""
