"""What the window and its child processes say to one another: one JSON line an event, one line a command.

A failure: StudioError -> cli/_output.run_command (ErrorEvent) -> ui/child_process -> ui/tasks (failed) -> the
card's presenter. Of a queue, failed entries come in FilesDone.failed, and an error where none was made.

commands  What a running command reads on its standard input, one line each: built by the window
events/   Every event a command prints with --json, as a frozen type, and its line
"""
