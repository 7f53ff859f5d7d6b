"""A check that `import evaluation` imports this project's package.

Many projects have a folder `evaluation`. The simulator needs its own package
`evaluation` only for studies, and refuses any other package named `evaluation`.
"""

from importlib.util import find_spec
import os

from cns_drake.base.errors import InputError

# The folder that holds `cns_drake` and `evaluation`.
_ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "../.."))


def check_evaluation() -> None:
    """Raises an error if `import evaluation` finds another package.

    Raises:
        InputError: another package was found; the message names it and says
            what to do.
    """
    spec = find_spec("evaluation")
    ours = os.path.join(_ROOT, "evaluation", "__init__.py")
    if spec is not None and spec.origin is not None:
        found = os.path.realpath(spec.origin)
        if found == ours:
            return
        raise InputError(
            f"{found}: this 'evaluation' hides the package of that name which"
            " cns-drake evaluates with; rename it, or take its folder out of"
            " PYTHONPATH"
        )
    raise InputError(
        f"{ours}: the package 'evaluation' is not installed; install "
        "cns-drake anew"
    )
