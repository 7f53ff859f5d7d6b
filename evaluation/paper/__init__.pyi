from evaluation.paper.paper_values import paper as paper
from evaluation.paper.section import paper_section as paper_section
