"""Paths of the repository, whose fixtures the tests read."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the repository."""
    return Path(os.environ.get("KANAGATA_ROOT", Path(__file__).parents[2]))


@pytest.fixture(scope="session")
def strip(root: Path) -> Path:
    """A scene that takes about a second."""
    return root / "examples/strip/strip.scene.json"
