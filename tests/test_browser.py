"""The report in real browsers, from disk and offline: scripts draw charts, nothing complains, nothing is fetched."""

from __future__ import annotations

from pathlib import Path

import pytest
from browsers import Chrome, Firefox
from impactbench.reports import page
from test_page import HOSTILE, Maker, case, document, small

DRAWN = """(() => {  // scrolls to what is not drawn yet
  const left = document.querySelector('.chart:has(.spec):not([data-drawn])');
  left?.scrollIntoView();
  return !left;
})()"""


@pytest.fixture(scope="module")
def small_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Report of the small made-up document."""
    path = tmp_path_factory.mktemp("page") / "report.html"
    page.write_page(small(), path)
    return path


@pytest.mark.parametrize("name", ["chrome", "firefox"])
def test_the_recorders_see_what_the_other_tests_rely_on(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    browser: Chrome | Firefox = request.getfixturevalue(name)
    path = tmp_path / "chatty.html"
    path.write_text("<script>console.error('a known complaint')</script><img src='http://elsewhere.test/x.png'>")
    browser.open(path)
    browser.until("document.images[0].complete")
    assert "a known complaint" in "".join(browser.console())
    assert "://elsewhere.test/x.png" in "".join(browser.requests())


def test_chromium_draws_the_charts_by_script_and_stays_quiet(chrome: Chrome, small_page: Path) -> None:
    chrome.open(small_page)
    chrome.until(DRAWN)
    assert chrome.js("return document.querySelectorAll('.chart .live svg .mark-symbol path').length") > 20
    assert chrome.js("return document.querySelectorAll('.chart:has(.spec) .static').length") == 0
    assert chrome.console() == []
    assert chrome.requests() == [small_page.as_uri()]


def test_firefox_draws_the_charts_by_script_and_stays_quiet(firefox: Firefox, small_page: Path) -> None:
    firefox.open(small_page)
    firefox.until(DRAWN)
    assert firefox.js("document.querySelectorAll('.chart .live svg .mark-symbol path').length") > 20
    assert firefox.console() == []
    assert [url for url in firefox.requests() if url != small_page.as_uri()] == []


def test_hostile_names_stay_text_after_the_script_has_drawn_them(chrome: Chrome, tmp_path: Path) -> None:
    maker = Maker()
    maker.ladder("a", f"{HOSTILE}/default", 0.1, 1e-4)
    maker.cell("a", HOSTILE, 60, {}, state="crashed", reason=HOSTILE)
    path = tmp_path / "report.html"
    page.write_page(document(maker, [case("a", HOSTILE, question=HOSTILE)]), path)
    chrome.open(path)
    chrome.until(DRAWN)
    assert chrome.js("return document.images.length") == 0
    assert HOSTILE[:12] in chrome.js("return document.querySelector('.live').textContent")
    assert chrome.console() == []
