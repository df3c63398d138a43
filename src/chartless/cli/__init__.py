"""The command line: one file per command. Commands parse, call the library and print.

Results go to standard output, progress and remarks to standard error. Exit status: 0 done;
2 bad usage or bad input, with one line on standard error; 3 done, but ``--strict`` was given
and the result is doubtful.
"""

from chartless.cli._main import main

__all__ = ["main"]
