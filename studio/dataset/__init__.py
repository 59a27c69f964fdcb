"""Takes chosen and marked for training: choices apart from recordings."""

from studio.dataset.dataset import Dataset, Label, Selection

__all__ = ["Dataset", "Label", "Selection"]
