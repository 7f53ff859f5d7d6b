from .paper_values import paper as paper
from .section import paper_section as paper_section
