"""What can be done in the program, each declared once: its name, its keys, where it works, what it needs.

Menus, buttons, their tips and the list of keys read this table, and so can whatever triggers actions from
outside. A new key goes here and nowhere else: tests find keys, names and tips that are written elsewhere, and
keys that clash.
"""

from __future__ import annotations

from dataclasses import dataclass

TABS = ("record", "curate", "train", "review", "live")
FIGURE, MESSAGE, LIST = "figure", "message", "list"
"""Parts of the window with keys of their own while they have the keyboard, so that they may share a tab's."""
NEEDS = ("project", "take", "run", "training", "live")
"""What an action may need: an open project, a chosen take or run, a training or a performance under way."""
GROUPS = ("", *TABS[:1], "curate review", *TABS[1:], FIGURE)
"""Of the list of keys, in the order shown: places as `Action.places` has them, "" for the whole window."""
WITH = "+"
"""Stands for `Action.listed` of an action that is told of in the line of the one above it."""
CONTEXT = "Actions"
"""Where translations of this file's texts are looked up."""


@dataclass(frozen=True)
class Action:
    """One thing that can be done.

    Args:
        id: names it in code, settings and remote triggers; it never changes.
        name: what a menu or a button says.
        keys: as text such as "Ctrl+N"; the first is the one that is shown.
        places: of TABS, or FIGURE, MESSAGE or LIST; empty for the whole window.
        needs: of NEEDS.
        help: one sentence, "" where the name says it all.
        listed: what the list of keys says; "" for the name, WITH for the line of the action above.
        group: of GROUPS, where the list of keys has it elsewhere than its places say.
        gesture: what the mouse or a key held down does instead.
    """

    id: str
    name: str
    keys: tuple[str, ...] = ()
    places: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    help: str = ""
    listed: str = ""
    group: str = ""
    gesture: str = ""


def _tr(text: str) -> str:
    """Mark a text to be translated where it is shown; no Qt is imported here, so it stays as it is."""
    return text


def _action(id: str, name: str, *keys: str, at: str = "", needs: str = "", **texts: str) -> Action:
    """One line of the table; `at` and `needs` are words with blanks between them."""
    return Action(id, name, keys, tuple(at.split()), tuple(needs.split()), **texts)


_ALL = (
    # -- the whole window
    _action("new_project", _tr("New project…"), "Ctrl+N", listed=_tr("New project, open a project")),
    _action("open_project", _tr("Open a project…"), "Ctrl+O", listed=WITH),
    _action("open_sample", _tr("Open the sample project")),
    _action("import_files", _tr("Import files…"), "Ctrl+I", needs="project",
            listed=_tr("Import sound and motion")),
    _action("import_folder", _tr("Import a folder…"), needs="project"),
    _action("pack_project", _tr("Export project as .zip…"), needs="project"),
    _action("unpack_project", _tr("Open project .zip…")),
    _action("show_project_folder", _tr("Open project folder"), needs="project"),
    _action("settings", _tr("Settings…"), "Ctrl+,", listed=_tr("Settings")),
    _action("close_project", _tr("Close the project"), "Ctrl+W", needs="project",
            listed=_tr("Close the project, quit")),
    _action("quit", _tr("Quit"), "Ctrl+Q", listed=WITH),
    _action("undo", _tr("Undo"), "Ctrl+Z", needs="project", listed=_tr("Undo, redo (or Ctrl+Y) in this tab")),
    # Both are usual, on different systems; the menu shows the first.
    _action("redo", _tr("Redo"), "Ctrl+Shift+Z", "Ctrl+Y", needs="project", listed=WITH),
    _action("show_record", _tr("Record"), "Ctrl+1", needs="project",
            listed=_tr("Record, Curate, Train, Review, Live")),
    _action("show_curate", _tr("Curate"), "Ctrl+2", needs="project", listed=WITH),
    _action("show_train", _tr("Train"), "Ctrl+3", needs="project", listed=WITH),
    _action("show_review", _tr("Review"), "Ctrl+4", needs="project", listed=WITH),
    _action("show_live", _tr("Live"), "Ctrl+5", needs="project", listed=WITH),
    _action("next_steps", _tr("Next steps")),
    _action("light_colours", _tr("Light theme")),
    _action("full_screen", _tr("Full screen"), "F11"),
    _action("open_menu", _tr("Menu"), "F10"),
    _action("open_palette", _tr("Find anything…"), "Ctrl+K",
            help=_tr("Every action, setting, take and run, by typing a part of its name")),
    _action("list_keys", _tr("Keyboard shortcuts"), "Ctrl+/", listed=_tr("This list")),
    _action("copy_diagnostics", _tr("Copy diagnostics")),
    _action("about", _tr("About Saia Studio")),
    _action("go_to_message", _tr("Focus the notification"), "F6",
            listed=_tr("Focus the notification, dismiss it")),
    _action("dismiss_message", _tr("Dismiss the notification"), "Esc", at=MESSAGE, listed=WITH),
    # -- Record
    # F1 works from every tab: whoever wears a suit must not look for the tab first.
    _action("record", _tr("Start and stop recording"), "F1", needs="project", group="record"),
    _action("record_here", _tr("Start and stop recording"), "Space", at="record", needs="project",
            listed=WITH),
    _action("cancel_countdown", _tr("Cancel the countdown"), "Esc", at="record", needs="project"),
    # Pedals are keyboards: these are the keys that most of them send.
    _action("prompt_next", _tr("Next"), "PgDown", at="record", needs="project",
            help=_tr("Said well: show the next prompt"), listed=_tr("Teleprompter: next, again")),
    _action("prompt_again", _tr("Again"), "PgUp", at="record", needs="project",
            help=_tr("Say it once more; the attempt so far is left out of training"), listed=WITH),
    # -- Curate and Review
    _action("play", _tr("Play and pause"), "Space", at="curate review", needs="take"),
    _action("step_back", _tr("One frame back"), "Left", at="curate review", needs="take",
            listed=_tr("One frame; with Ctrl 4, with Ctrl+Alt 100")),
    _action("step_forward", _tr("One frame on"), "Right", at="curate review", needs="take", listed=WITH),
    _action("first_frame", _tr("First frame"), "Home", at="curate review", needs="take",
            help=_tr("Go to the start"), listed=_tr("First and last frame")),
    _action("last_frame", _tr("Last frame"), "End", at="curate review", needs="take",
            help=_tr("Go to the end"), listed=WITH),
    _action("loop", _tr("Loop"), "L", at="curate review", needs="take",
            help=_tr("Repeat the selected span, or everything")),
    _action("go_back", _tr("Go back"), "Esc", at="curate review", needs="project",
            help=_tr("Leave what is open: a question, the list to fix, a search, a blind vote")),
    # -- Curate
    _action("in_point", _tr("In point"), "I", at="curate", needs="take", listed=_tr("In point, out point")),
    _action("out_point", _tr("Out point"), "O", at="curate", needs="take", listed=WITH),
    _action("select_span", _tr("with ← → Home End: select a span"), at="curate", gesture=_tr("Shift")),
    # Tens of takes are labelled in a sitting: a word of the vocabulary is one key.
    *(_action(f"label_{n}", _tr("Label {0}"), str(n), at="curate", needs="take",
              listed=WITH if n > 1 else _tr("Label; hold while playing to label a span"))
      for n in range(1, 10)),
    _action("exclude", _tr("Exclude"), "X", at="curate", needs="take",
            help=_tr("Leave the selected span out of training, or use it again"),
            listed=_tr("Exclude the span, remove the label")),
    _action("remove_marked", _tr("Remove the label"), "Del", "Backspace", at="curate", needs="take",
            listed=WITH),
    # Without Shift the plus of most keyboards is an equals sign.
    _action("zoom_in", _tr("Closer"), "+", "=", at="curate", needs="take",
            help=_tr("Zoom in, also with the wheel"), listed=_tr("Zoom in, zoom out, fit")),
    _action("zoom_out", _tr("Wider"), "-", at="curate", needs="take",
            help=_tr("Zoom out, also with the wheel"), listed=WITH),
    _action("zoom_fit", _tr("Whole take"), "F", at="curate", needs="take", help=_tr("Fit the whole take"),
            listed=WITH),
    _action("sound_picture", _tr("Waveform or spectrogram"), "P", at="curate", needs="take",
            help=_tr("Show which pitches sound in place of the waveform")),
    _action("compare_cleaning", _tr("Before and after cleaning the sound"), "B", at="curate", needs="take"),
    _action("select_all", _tr("All takes"), "Ctrl+A", at="curate", needs="project",
            listed=_tr("Select all takes; edit the selected row")),
    _action("edit_cell", _tr("Edit the selected row"), "F2", at="curate", needs="take",
            listed=WITH),
    _action("split_takes", _tr("Split automatically"), at="curate", needs="project",
            help=_tr("Split the takes into train, val and test, balanced by length, performer and label")),
    _action("align", _tr("Align"), at="curate", needs="take",
            help=_tr("Measure how far the motion is off from the sound")),
    # -- Train
    _action("start_training", _tr("Start training"), at="train", needs="project",
            help=_tr("Train a network on the takes marked train")),
    _action("stop_training", _tr("Stop, keep best"), at="train", needs="training"),
    _action("cancel_training", _tr("Cancel"), at="train", needs="training",
            help=_tr("Stop and delete this run")),
    _action("training_details", _tr("Details"), at="train", needs="run",
            help=_tr("What the network itself makes small, and the training's own messages")),
    _action("watch_run", _tr("Watch"), at="train", needs="run",
            help=_tr("Play in Review what this run makes of a take")),
    _action("review_run", _tr("Review"), at="train", needs="run"),
    _action("compare_runs", _tr("Compare"), at="train", needs="run",
            help=_tr("Compare the selected runs on takes they have never heard; select several with Ctrl or "
                     "Shift")),
    _action("measure_curve", _tr("What would more takes bring?"), at="train", needs="project",
            help=_tr("Trains quickly on a quarter, a half and all of your takes, and says what more would "
                     "bring and when it is enough; takes a few minutes")),
    _action("run_details", _tr("Details"), at="train", needs="run",
            help=_tr("The figures behind the words, and what each was measured on")),
    _action("card_of_run", _tr("Model card"), at="train", needs="run"),
    _action("resume_run", _tr("Resume"), at="train", needs="run"),
    _action("show_run_folder", _tr("Folder"), at="train", needs="run"),
    _action("export_run", _tr("Export run"), at="train", needs="run",
            help=_tr("Save the run as one file, for another project or computer; a run with a body "
                     "carries body motion from your takes")),
    _action("import_run", _tr("Import a run"), at="train", needs="project",
            help=_tr("Works without the takes it was trained on")),
    _action("delete_run", _tr("Delete"), at="train", needs="run"),
    _action("close_opened", _tr("Go back"), "Esc", at="train", needs="project",
            help=_tr("Close what is open: the figures, the training's messages, the advanced settings"),
            listed=_tr("Close what is open")),
    # -- Review
    _action("ghost", _tr("Ghost"), "G", at="review", needs="run",
            help=_tr("Lay the captured figure over the predicted one"),
            listed=_tr("Captured figure over the predicted one")),
    _action("other_run", _tr("Switch between A and B"), "B", at="review", needs="run",
            help=_tr("Switch at once, while it plays"), listed=_tr("Switch between A and B")),
    _action("move_like_this", _tr("Move like this"), at="review", needs="take run",
            help=_tr("Move like this: shows the run how to move by the stretch of this take that is selected "
                     "or ten seconds around the playhead; from then on that is one of its styles")),
    _action("remove_sound", _tr("Remove a dropped sound from the list"), "Del", at=LIST, needs="project",
            group="review"),
    _action("export", _tr("Export"), at="review", needs="take"),
    _action("send", _tr("Send"), at="review", needs="take"),
    # -- Live
    _action("start_live", _tr("Go live"), at="live", needs="run",
            help=_tr("Move the avatar with your voice")),
    _action("stop_live", _tr("Stop Live"), at="live", needs="live", help=_tr("End the performance")),
    _action("keep_live", _tr("Keep the last 10 minutes"), at="live", needs="live",
            help=_tr("Makes a take of your voice and the motion that was sent; it is not used for training")),
    _action("avatar_window", _tr("Avatar window"), at="live",
            help=_tr("Your avatar alone, transparent or on green, for OBS to capture: no other program "
                     "needed")),
    _action("mute", _tr("Mute"), "M", at="live", needs="live", help=_tr("Mute your microphone")),
    _action("freeze", _tr("Freeze"), "F", at="live", needs="live",
            help=_tr("Hold the avatar in its current pose"), listed=_tr("Freeze the avatar")),
    _action("neutral", _tr("Neutral"), "N", at="live", needs="live",
            help=_tr("Panic key: put the avatar in its neutral pose and keep it there"),
            listed=_tr("Neutral pose, the panic key")),
    _action("mood_0", _tr("No mood"), "0", at="live", needs="live",
            help=_tr("Move as without any label"), listed=_tr("No mood, or one that the run has learnt")),
    *(_action(f"mood_{n}", _tr("Mood {0}"), str(n), at="live", needs="live", listed=WITH)
      for n in range(1, 10)),
    _action("let_go", _tr("Go back"), "Esc", at="live", needs="live",
            help=_tr("Leave a mood, Freeze or Neutral; a muted microphone stays muted"),
            listed=_tr("Leave a mood, Freeze or Neutral")),
    # -- the figure
    _action("turn_left", _tr("Turn left"), "Left", at=FIGURE, listed=_tr("Turn around the figure"),
            gesture=_tr("Drag")),
    _action("turn_right", _tr("Turn right"), "Right", at=FIGURE, listed=WITH),
    _action("turn_up", _tr("Turn up"), "Up", at=FIGURE, listed=WITH),
    _action("turn_down", _tr("Turn down"), "Down", at=FIGURE, listed=WITH),
    _action("figure_closer", _tr("Closer"), "+", "=", at=FIGURE, listed=_tr("Zoom in, zoom out"),
            gesture=_tr("Wheel")),
    _action("figure_further", _tr("Zoom out"), "-", at=FIGURE, listed=WITH),
    _action("first_view", _tr("Reset the view"), at=FIGURE, gesture=_tr("Double-click")),
)  # fmt: skip

ACTIONS = {action.id: action for action in _ALL}
"""All of them by id, in the order of the tabs."""


def keys_of(place: str) -> dict[str, str]:
    """The id of the action that each key of a tab or other place does, without those of the whole window."""
    return {key: one.id for one in ACTIONS.values() if place in one.places for key in one.keys}


# -- the list of keys ------------------------------------------------------------------------------


@dataclass(frozen=True)
class KeyRow:
    """One line of the list of keys: some actions that are told of together."""

    text: str
    actions: tuple[Action, ...]

    @property
    def keys(self) -> str:
        """The first keys of the actions as people read them: "F1, Space", "← →" or "Ctrl+1 … 5"."""
        keys = [one.keys[0] for one in self.actions if one.keys]
        if len(keys) >= _RANGE and all(key[-1].isdigit() for key in keys):
            return f"{keys[0]} … {keys[-1][-1]}"
        symbols = [_SYMBOLS.get(key, key) for key in keys]
        return (", " if symbols == keys else " ").join(symbols)


_SYMBOLS = {"Left": "←", "Right": "→", "Up": "↑", "Down": "↓", "+": "+", "-": "−"}
_RANGE = 5
"""Keys that end in as many digits running are shown as the first and the last."""


def key_rows() -> dict[str, list[KeyRow]]:
    """The lines of the list of keys by their group, both in the order shown."""
    found: dict[str, list[KeyRow]] = {group: [] for group in GROUPS}
    rows = found[""]
    for one in ACTIONS.values():
        if not (one.keys or one.gesture):
            continue
        if one.listed == WITH:
            rows[-1] = KeyRow(rows[-1].text, (*rows[-1].actions, one))
        else:
            rows = found[one.group or " ".join(one.places)]
            rows.append(KeyRow(one.listed or one.name, (one,)))
    return found
