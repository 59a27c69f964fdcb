"""Every event a command prints with --json, as a frozen type (no Qt, no torch, no numpy).

NAME is the line's `event`; VERBS are the commands that mean this by it, () for all that use the name.

common    Events that many commands print: notes, problems, progress, and the last line
live      Events of a live performance, the practice performer, the doctor and the tour
takes     Events of commands that record, import, change and export takes
training  Events of commands that train, measure and describe: train, evaluate, compare, suggest, card,
          encoder
"""

from studio.ipc.events.common import *  # noqa: F403
from studio.ipc.events.live import *  # noqa: F403
from studio.ipc.events.takes import *  # noqa: F403
from studio.ipc.events.training import *  # noqa: F403
