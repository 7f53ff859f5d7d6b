"""Text in figures."""


def escape_dollars(text: str) -> str:
    """Returns text with its dollar signs escaped for matplotlib.

    A dollar sign that is not escaped begins a formula.
    """
    return text.replace("$", r"\$")
