"""The pytest plugin: a fixture and a marker with which any project asserts conservation of its own runs.

pytest loads this file in every run of everyone who has impactbench installed: it imports nothing but pytest.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from impactbench.reports.asserted import Conservation

MARKER = "conservation(measure=budget, ...): budgets of the `conservation` fixture, such as momentum_drift=1e-12"


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", MARKER)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A marker on a test that never asks for the fixture would check nothing and look as if it did."""
    for item in items:
        if item.get_closest_marker("conservation") and "conservation" not in getattr(item, "fixturenames", ()):
            raise pytest.UsageError(f"{item.nodeid}: marked conservation(...) but takes no `conservation` fixture")


@pytest.fixture
def conservation(request: pytest.FixtureRequest) -> Iterator[Conservation]:
    """Measures runs and fails the test where a budget is exceeded: see `Conservation.run` and `Conservation.engine`."""
    from impactbench.reports.asserted import Conservation

    budgets: dict[str, float] = {}
    for marker in request.node.iter_markers("conservation"):  # the closest first
        budgets = {**marker.kwargs, **budgets}
    # As record_property does, without its warning: reporters of either JUnit family write these.
    checked = Conservation(budgets, request.node.user_properties)
    yield checked
    if not checked.asked:
        pytest.fail("the `conservation` fixture was asked for, but no run was given to it", pytrace=False)
