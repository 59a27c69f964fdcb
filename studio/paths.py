"""Where the studio's own files lie: recipes, icons, bundled speech, the guide; and what it rescued."""

from pathlib import Path

_HERE = Path(__file__).resolve().parent


def resource(*parts: str) -> Path:
    """A file or folder of `resources/`, whether run from a checkout, a wheel or a bundle."""
    installed = _HERE / "resources"
    root = installed if installed.is_dir() else _HERE.parent / "resources"
    return root.joinpath(*parts)


def rescue_folder() -> Path:
    """Where recordings go whose own folder vanished; it need not exist yet."""
    from platformdirs import user_data_path

    return user_data_path("saia-studio", appauthor=False) / "rescued"
