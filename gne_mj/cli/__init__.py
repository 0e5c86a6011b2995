"""The command line. Heavy modules are imported where they are needed, so that --help is quick."""

from gne_mj.cli import analyses, batches, comparing, new, precompiling, runs, views
from gne_mj.cli.application import app, main

__all__ = [
    "analyses",
    "app",
    "batches",
    "comparing",
    "main",
    "new",
    "precompiling",
    "runs",
    "views",
]
