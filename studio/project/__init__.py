"""The open folder: its takes, the choices made about them with undo, and its training runs.

project     the folder itself, opened to look or to change
run         training runs in it
trash       takes that were removed
files       what makes a folder a project
"""

from studio.project.files import DATASET_FILE, FORMAT_VERSION, HISTORY_FILE, PROJECT_FILE, is_project
from studio.project.project import Project
from studio.project.run import Run

__all__ = ["DATASET_FILE", "FORMAT_VERSION", "HISTORY_FILE", "PROJECT_FILE", "Project", "Run", "is_project"]
