"""The scripts that make the pages of evidence, as modules."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

FOLDER = Path(__file__).parents[1] / "docs" / "evidence"


def script(name: str) -> ModuleType:
    """A script by its name; what it imports from beside it is found as when it is run."""
    if str(FOLDER) not in sys.path:
        sys.path.append(str(FOLDER))
    return importlib.import_module(name)
