"""Marks of tests that need what not all systems have."""

import os
import sys

import pytest

needs_posix = pytest.mark.skipif(not hasattr(os, "killpg"), reason="Windows has no such signals, pipes and modes")
needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such limits of a process")
