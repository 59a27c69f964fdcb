"""The open folder: its takes, the choices made about them with undo, and its training runs.

archive   A project as one zip file: everything in it but what can be computed again, opened anywhere else
avatars   Avatars of a project: copies of .vrm files in its folder, and which of them is worn
contents  What makes a folder a project, and which files it is made of: anything else in a zip is left out
new_takes  What is used of takes that a project finds: all but what is of no use, of older ones too
painted_moods  Moods painted over the sounds of a project, kept in its folder as moods.json
project   A project folder, opened to look or to change
run       Training runs on disk: folders `<recipe>_<nnn>` with a recipe, metrics, weights and a report
sounds    Sounds that are no takes: dropped on Review, copied into the project, trashed and brought back
trash     Removed takes and runs: moved into the project's trash, and back again
"""

from studio.project.contents import DATASET_FILE, FORMAT_VERSION, HISTORY_FILE, PROJECT_FILE, is_project
from studio.project.project import Project
from studio.project.run import Run, RunReport

__all__ = [
    "DATASET_FILE",
    "FORMAT_VERSION",
    "HISTORY_FILE",
    "PROJECT_FILE",
    "Project",
    "Run",
    "RunReport",
    "is_project",
]
