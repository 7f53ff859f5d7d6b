"""What one looks at: pictures of stages, and pages of drives."""
