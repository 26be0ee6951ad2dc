"""The command line: functions of questions come from `_questions`, the others are one file each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

from tolstat.cli._app import LISTED, Listed, app, main
from tolstat.cli._command import check_memory
from tolstat.questions import QUESTIONS, Question

__all__ = ["LISTED", "PLAIN", "app", "main"]

PLAIN = {
    "Plan": {
        "new": "Write a study with comments that runs as it stands.",
        "spectrum": "Write a study of the duty cycle in a measured signal.",
        "schema": "Print the JSON schema of a file, for editors.",
        "show": "Draw a joint, its errors, or one joint of a campaign.",
        "simulate": "Simulate one joint, with and without its errors.",
        "plan": "Predict time, memory and precision of a campaign.",
    },
    "Run": {
        "run": "Simulate the joints of a study and print a report.",
        "extend": "Add joints to a campaign and simulate them.",
        "merge": "Merge the slices of a campaign into one result file.",
        "status": "Print the number of joints by status.",
        "verify": "Estimate the numerical error on some joints.",
        "replay": "Simulate one joint again and compare with the file.",
        "evaluate": "Simulate joints whose errors another program gives.",
    },
    "Read": {"report": "Report the share of joints above each load."},
    "Decide": {},
    "Share": {
        "export": "Export joints, load cycles or statistics to files.",
        "docs": "Print a page of the documents, or open their site.",
        "cache": "Show where compiled kernels are kept, or remove them.",
    },
}
"""Commands that are no question, by heading of the help: functions of this package, and their first lines."""
FILES = {"schema": "new", "plan": "run", "extend": "run", "merge": "run", "replay": "simulate"}
"""Files of commands that have none of their own name."""


def _function(name: str, question: Question | None = None) -> Callable[..., None]:
    if name in ("run", "extend"):
        check_memory()  # before libraries are loaded
    file: Any = import_module(f"tolstat.cli.{FILES.get(name, name) if question is None else '_questions'}")
    function: Callable[..., None] = getattr(file, name) if question is None else file.function_of(question)
    return function


for heading, commands in PLAIN.items():
    for name, summary in commands.items():
        LISTED[name] = Listed(heading, summary, partial(_function, name))
    for question in QUESTIONS:
        if question.heading == heading:
            name = question.name.replace("_", "-")
            LISTED[name] = Listed(heading, question.summary, partial(_function, name, question))
