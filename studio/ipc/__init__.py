"""What the window and its child processes say to one another: one JSON line an event, one line a command.

A failure: StudioError -> cli/_output.run_command (ErrorEvent) -> ui/tasks (failed) -> the card's presenter; a
queue's failed entries come in FilesDone.failed.

commands  What a running command reads on its standard input, one line each: built by the window
events/   Every event a command prints with --json, as a frozen type, and its line
"""
