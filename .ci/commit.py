"""Build hook: a wheel made from a checkout knows its commit, and with it every result file that it writes."""

import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CommitHook(BuildHookInterface):
    """Puts ``tolstat/_commit.txt`` into the wheel when the sources are a git checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Ask git for the commit; no file where there is none, or in an editable install."""
        if version != "standard" or not (Path(self.root) / ".git").exists():
            return
        command = ["git", "-C", self.root, "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        try:
            commit = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout
        except (OSError, subprocess.SubprocessError):
            return
        self._folder = tempfile.TemporaryDirectory()  # removed with this hook, when the wheel is made
        path = Path(self._folder.name) / "_commit.txt"
        path.write_text(commit, encoding="ascii")
        build_data["force_include"][str(path)] = "tolstat/_commit.txt"
