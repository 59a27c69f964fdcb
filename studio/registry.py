"""One file = one entry: the modules of a package, listed without importing any of them."""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

from studio.errors import RequestError, say


def names(package: ModuleType) -> tuple[str, ...]:
    """Names of the public modules in a package, sorted, none of them imported."""
    found = (module.name for module in pkgutil.iter_modules(package.__path__))
    return tuple(sorted(name for name in found if not name.startswith("_")))


def load(package: ModuleType, name: str, kind: str) -> ModuleType:
    """Import one entry by name.

    Args:
        package: the package that holds the entries.
        name: the module's name inside it.
        kind: what an entry is called in a sentence ("format", "model").

    Raises:
        RequestError: no entry has that name.
    """
    if name not in names(package):
        known = ", ".join(names(package))
        raise RequestError(
            say("There is no {kind} called {name}.", kind=kind, name=name),
            say("Choose one of: {known}.", known=known),
        )
    return importlib.import_module(f"{package.__name__}.{name}")
