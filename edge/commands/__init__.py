"""The subcommands of edge-classify, one module each.

They share `options` (command-line options and their checks), `source` (opens the skin
and the joint angles that the options name), `output` (text or JSON lines) and, for
text, `terminal` and `summary`.
"""
