"""The subcommands of edge-classify that a robot needs, one module each.

They share `options` (command-line options and their checks), `source` (opens the skin
and the joint angles that the options name), `output` (text or JSON lines) and `texts`
(the text of each event).
"""
