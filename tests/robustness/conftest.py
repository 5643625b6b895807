"""Fixture of the hard cases."""

import pytest
from hard import Findings


@pytest.fixture
def found(request):
    """Takes what a hard case measures, and fails it where a limit is not kept."""
    return Findings(request.node)
