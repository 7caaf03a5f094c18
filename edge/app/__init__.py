"""The command line: one module a command, and what commands share.

`options` are command-line options and their checks, `source` opens the skin and the
joint angles that the options name, `output` writes text or JSON lines, `texts` holds the
text of each event, and `sinks` are what frames and events are pushed to.
"""
