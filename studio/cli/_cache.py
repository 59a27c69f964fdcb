"""After commands that cache: the project's cache is kept to the size in the settings."""

from __future__ import annotations

from studio import settings
from studio.project import Project
from studio.take import cache


def keep_small(project: Project) -> None:
    """Remove what was used longest ago; where nothing can be removed, nothing happens."""
    cache.trim(project.folder / cache.FOLDER, 1e9 * settings.load().cache_gb)
