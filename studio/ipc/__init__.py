"""What the window and its child processes say to one another: one JSON line an event, one line a command.

commands  What a running command is told on its standard input, one line each: built by the window, read by
          it
events/   Every event a command prints with --json, as a frozen type (no Qt, no torch, no numpy)
messages  Reading and writing a line: JSON to a frozen event and back, with a stated failure where it is
          none
"""
