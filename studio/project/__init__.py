"""The open folder: its takes, the choices made about them with undo, and its training runs.

archive    A project as one zip file: everything in it but what can be computed again, opened anywhere else
avatars    Avatars of a project: copies of .vrm files in its folder, and which of them is worn
contents   Which files a project is made of: what comes in a zip from elsewhere beside them is left out
files      What makes a folder a project, and the small files in it
generated  What runs made of sounds: kept in the project's cache, made again where it is gone
project    A project folder, opened to look or to change
run        Training runs on disk: folders `<recipe>_<nnn>` with a recipe, metrics, weights and a report
sounds     Sounds that are no takes: dropped on Review, copied into the project, trashed and brought back
trash      Removed takes and runs: moved aside into the project's trash, and back again
"""

from studio.project.files import DATASET_FILE, FORMAT_VERSION, HISTORY_FILE, PROJECT_FILE, is_project
from studio.project.project import Project
from studio.project.run import Run

__all__ = ["DATASET_FILE", "FORMAT_VERSION", "HISTORY_FILE", "PROJECT_FILE", "Project", "Run", "is_project"]
