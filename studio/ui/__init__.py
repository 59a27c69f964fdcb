"""The window: the only Qt in the house.

app                Builds everything once and hands it over
avatar_store       The performer's own avatar: one for all tabs, opened on the pool, kept in the project
bone_table         Which joint of an imported skeleton is which bone: what was guessed, put right by a
                   person in a table
curate/            The Curate tab: the library, the timeline, trims, offsets and labels
child_process      One child process of the window: what it says and is told, and how it ends
clear_place        Where a message may lie over a window without covering what people use next, by
                   geometry alone
command_palette    Every action, setting, take and run, found by typing: Ctrl+K
desktop            Word from the desktop while the window is not in front: a notification of what ended
                   meanwhile
focus              Where the keyboard is: with the shown tab, whatever was clicked or taken away
generate_task      The motion a run makes of a sound: from the cache, else from a child process, piece by
                   piece
hello_presenter    What "Say something" does: a phrase, a sound file or a sentence moves the figure, by the
                   base voice and without a project
hello_view         "Say something" on the welcome page: three ways to speak, and the figure that speaks
imports            Files that come in or go out: dropped and chosen ones imported, projects packed and
                   unpacked; by child processes
language           What the core says, in the person's language
live/              The Live tab: the microphone or a file moves the avatar, now
main_window        The frame around the five tabs: tabs, status, menus, keys, drag and drop
menus              The menus and their keys
messages           The only place that shows an error: a sentence and what to do, where it covers nothing
                   that is used
next_steps_presenter  What is done of the way from the first take to going live, read from the project
next_steps_view    The strip under the tabs: the five steps, each with its one button
record/            The Record tab: capture, meters, health, takes of today
review/            The Review tab: predicted and captured motion in time with sound, sending, exporting
session            What the whole window shares: the open project, the settings, and word of what changed
settings_dialog    The Settings dialog: every preference of `studio.settings` that has a label, changed and
                   kept at once
shortcuts          Keys of the actions as Qt knows them, and the dialog that lists every key
status_strip       The facts at the right of the tab bar: motion, sound, room on the disk, work going on
tabs               The five tabs: which there are, and how each is built when it is first needed
taskbar            How far long work is, on the window's button in the taskbar or dock, where the desktop
                   shows that
tasks              Work off the GUI thread: a pool for what takes seconds, child processes for all that
                   takes longer
theme              The one theme: colours, spacing, type, icons and style sheet of the whole window
tour/              The tour: the whole job through the real window, every step verified by its effect
train/             The Train tab: data, presets, curves, runs
undo               Undo by tab: what it would take back there, and the message that always says what it did
view_settings      How a performer is seen, camera and background: kept in the settings
video_import       Before videos are imported: the face model is offered where it is missing, and whose face
                   it is asked
welcome_presenter  What the welcome page does: projects opened and made, the sample built, the machine
                   checked
welcome_view       The welcome page: a new project, one from before, the sample; and whether this machine is
                   ready
widgets/           Pieces that several tabs draw with
window_place       Where the window and its splitters stand: at the first start, and as they were left
"""
