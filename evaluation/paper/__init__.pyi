from evaluation.paper.section import paper_section as paper_section
