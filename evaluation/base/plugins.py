"""Plug-ins and families, a public noun: members by name, ours and others.

A plug-in is an installed package with an entry point of the group
`cns_drake.plugins`, which names a module. The module registers members when it
is imported, with the functions with which this project registers its own.
"""

from collections.abc import Callable, Iterator, Mapping
import contextlib
from contextvars import ContextVar
import functools
import importlib
import pkgutil
import sys
import traceback
from types import ModuleType
from typing import TypeVar

from evaluation.base.errors import one_line
from evaluation.base.terminal import note

_Member = TypeVar("_Member")
# Name of the plug-in whose module is imported.
_LOADING: ContextVar[str] = ContextVar("_LOADING", default="")


class Family(Mapping[str, _Member]):
    """The members of a family, in the order in which they were added.

    The project's own members are loaded, and after them the plug-ins, when an
    unknown name is looked up, or when all names are needed.
    """

    def __init__(
        self, kind: str, load_own: Callable[[], object] | None = None
    ) -> None:
        """Initialises a family without members.

        Args:
            kind: what a member is, for error messages.
            load_own: function that adds the project's own members.
        """
        self._kind = kind
        self._load_own = load_own
        self._members: dict[str, tuple[_Member, object]] = {}
        self._own: list[str] = []
        # Name -> plug-in that added the member.
        self._plugins: dict[str, str] = {}

    def __getitem__(self, name: str) -> _Member:
        if name not in self._members:
            self._load()
        return self._members[name][0]

    def __iter__(self) -> Iterator[str]:
        self._load()
        return iter(self._members)

    def __len__(self) -> int:
        self._load()
        return len(self._members)

    def add(self, name: str, member: _Member, source: object) -> None:
        """Adds a member.

        Args:
            name: its name.
            member: the member.
            source: where it is defined. From there, a member may be added again
                under its name.

        Raises:
            ValueError: a member from elsewhere has this name.
        """
        _, known = self._members.get(name, (None, source))
        if known != source:
            raise ValueError(f"there is another {self._kind} {name!r}")
        self._members[name] = member, source
        if plugin := _LOADING.get():
            self._plugins[name] = plugin

    def described(self, name: str) -> str:
        """Returns a member with the plug-in that added it, for messages."""
        told = f"{self._kind} {name!r}"
        plugin = self._plugins.get(name)
        return f"plug-in {plugin}: {told}" if plugin else told

    def load_own(self) -> None:
        """Loads the project's own members, unless this was done before."""
        load, self._load_own = self._load_own, None
        if load is not None:
            others = set(self._members)
            load()
            self._own = [name for name in self._members if name not in others]

    def own(self) -> list[_Member]:
        """Returns the project's own members."""
        self.load_own()
        return [self._members[name][0] for name in self._own]

    def _load(self) -> None:
        self.load_own()
        _load_plugins()


def import_modules(
    package: str, *, only_packages: bool = False
) -> dict[str, ModuleType]:
    """Imports the modules of a package; returns them by their names in it.

    Args:
        package: full name of the package.
        only_packages: whether to import only its packages, such as those that
            import their modules later.
    """
    path = importlib.import_module(package).__path__
    return {
        one.name: importlib.import_module(f"{package}.{one.name}")
        for one in pkgutil.iter_modules(path)
        if one.ispkg or not only_packages
    }


def plugin_fault(error: BaseException) -> str | None:
    """Returns one line about an error in a plug-in; None about any other."""
    if not _load_plugins.cache_info().currsize:
        return None
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        for name, place in _load_plugins().items():
            if frame.filename.startswith(place):
                where = f"{frame.filename}: line {frame.lineno}"
                fault = f"{where}: {type(error).__name__}: {error}"
                return one_line(f"plug-in {name}: {fault}")
    return None


@functools.cache
def _load_plugins() -> dict[str, str]:
    """Imports all plug-ins; a note names one that fails, and why.

    Returns:
        Name of each plug-in -> its file, or the folder of its package.
    """
    # Slow to import.
    from importlib.metadata import entry_points
    import multiprocessing

    places = {}
    for plugin in sorted(entry_points(group="cns_drake.plugins")):
        loading = _LOADING.set(plugin.name)
        try:
            with contextlib.redirect_stdout(sys.stderr):
                plugin.load()
            file = str(sys.modules[plugin.module].__file__)
            places[plugin.name] = file.removesuffix("__init__.py")
        # A SystemExit would end the program.
        except (Exception, SystemExit) as error:
            # The process that started this one has said it.
            if multiprocessing.parent_process() is None:
                fault = f"{type(error).__name__}: {error}"
                note(
                    one_line(f"plug-in {plugin.name} ({plugin.value}): {fault}")
                )
        finally:
            _LOADING.reset(loading)
    return places
