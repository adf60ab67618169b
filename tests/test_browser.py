"""The report in real browsers, from disk and offline: scripts draw charts, nothing complains, nothing is fetched."""

from __future__ import annotations

from pathlib import Path

import pytest
from browsers import Chrome, Firefox, busy, serious
from impactbench.reports import diff, diff_page, page, page_scores
from impactbench.reports.page_data import TARGETS, percent
from impactbench.reports.page_view import View
from test_charts import SPECIAL
from test_page import HOSTILE, Maker, case, document, sixty, small

DRAWN = """(() => {  // scrolls to what is not drawn yet
  const left = [...document.querySelectorAll('.chart:has(.spec):not([data-drawn])')].find(one => one.offsetParent);
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
    assert chrome.js("return document.querySelectorAll('.chart:has(.spec):not(.narrow) .static').length") == 0
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


@pytest.mark.parametrize("name", SPECIAL)
def test_hostile_names_stay_text_in_a_tooltip(name: str, chrome: Chrome, tmp_path: Path) -> None:
    maker = Maker()
    maker.ladder("a", f"{name}/default", 0.1, 1e-4)
    path = tmp_path / "report.html"
    page.write_page(document(maker, [case("a", "a")]), path)
    chrome.open(path)
    chrome.until(DRAWN)
    chrome.js("""const mark = document.querySelector('.live .mark-symbol path'), box = mark.getBoundingClientRect();
      const at = {clientX: box.x + box.width / 2, clientY: box.y + box.height / 2, bubbles: true};
      mark.dispatchEvent(new PointerEvent('pointermove', at));""")
    chrome.until("document.querySelector('#vg-tooltip-element.visible')")
    tooltip = chrome.js("return document.querySelector('#vg-tooltip-element').textContent")
    assert name[:60] in tooltip
    assert chrome.js("return document.images.length") == 0
    assert chrome.console() == []


def test_a_large_page_can_be_used_within_a_second_of_the_main_threads_own_time(chrome: Chrome, tmp_path: Path) -> None:
    path, blank = tmp_path / "report.html", tmp_path / "blank.html"
    page.write_page(sixty(families=24), path)  # as many charts as a page draws
    assert path.stat().st_size > 1_500_000
    blank.write_text("<title>nothing</title>")
    chrome.open(blank)
    # Processor time: `make measure` tells time by the clock, which other work on the machine stretches.
    chrome.driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
    before = busy(chrome)
    chrome.driver.get(path.as_uri())
    loaded = busy(chrome)
    chrome.until("document.querySelector('.first [data-drawn]')")
    drawn = busy(chrome)
    chrome.driver.execute_cdp_cmd("Performance.disable", {})
    print(f"{loaded - before:.2f} s until loaded, {drawn - before:.2f} s until the first chart is drawn by script")
    assert 0 < drawn - before < 1


@pytest.mark.parametrize("size", [(390, 844), (320, 700)])
def test_a_phone_shows_a_chart_of_its_width_and_nothing_sideways(
    size: tuple[int, int], chrome: Chrome, small_page: Path
) -> None:
    chrome.open(small_page, size=size)
    chrome.until(DRAWN)
    assert chrome.js("return document.documentElement.scrollWidth") == size[0]
    shown = chrome.js("return [...document.querySelectorAll('.first .chart')].map(one => one.offsetParent !== null)")
    assert shown == [False, True]
    edges = "const box = document.querySelector('.first .narrow .live svg').getBoundingClientRect();"
    left, right = chrome.js(f"{edges} return [box.left, box.right]")
    assert 0 <= left < right <= size[0]
    assert right - left > 0.8 * size[0]


def test_print_holds_charts_and_whole_tables_and_no_controls(chrome: Chrome, tmp_path: Path) -> None:
    maker = Maker()
    for index in range(10):
        maker.ladder("bounce[bounciness=0.5]", f"engine{index}/default", 0.1, 1e-4)
    path = tmp_path / "report.html"
    page.write_page(document(maker, [case("bounce[bounciness=0.5]", "bounce")]), path)
    sheet = 718  # A4 less 1 cm margins at 96 to the inch
    chrome.open(path, size=(sheet, 1000), printed=True, dark=True)
    assert chrome.js("return [...document.querySelectorAll('table')].filter(one => one.offsetParent).length") > 1
    boxes = "[...document.querySelectorAll('table, svg, .card')].filter(one => one.getClientRects().length)"
    assert chrome.js(f"return {boxes}.map(one => one.getBoundingClientRect().right).every(x => x <= {sheet})")
    assert chrome.js("return [...document.querySelectorAll('.chart svg')].some(one => one.getClientRects().length)")
    shown = "[...document.querySelectorAll('.control, nav, button')].filter(one => one.getClientRects().length).length"
    assert chrome.js(f"return {shown}") == 0
    assert chrome.js("return getComputedStyle(document.body).color") == "rgb(0, 0, 0)"  # whatever the scheme


def choose(chrome: Chrome, selector: str, field: str, value: float, event: str) -> None:
    """Set a control as a user would, with its event."""
    script = "const one = document.querySelector(arguments[0]); one[arguments[1]] = arguments[2];"
    chrome.js(script + "one.dispatchEvent(new Event(arguments[3], {bubbles: true}));", selector, field, value, event)


def test_the_slider_changes_grid_sentence_and_line_as_the_report_would(chrome: Chrome, small_page: Path) -> None:
    chrome.open(small_page)
    chrome.until(DRAWN)
    view = View(small())
    seen = set()
    for index, target in enumerate(TARGETS):
        choose(chrome, "input.target", "value", index, "input")
        sentences = "[...document.querySelectorAll('.reach')].map(one => [one.dataset.case, one.textContent])"
        assert dict(chrome.js(f"return {sentences}")) == {n: page_scores.reach(view, n, target) for n in view.cases}
        seen.add(chrome.js("return document.querySelector('#scores').textContent"))
        words = "[...document.querySelectorAll('output.target-text')].map(one => one.value)"
        assert set(chrome.js(f"return {words}")) == {percent(target)}
    assert len(seen) > 5
    choose(chrome, "input.target", "value", TARGETS.index(0.1), "input")
    assert "10 %" in chrome.js("return document.querySelector('.live svg').textContent")


def test_the_filter_keeps_the_cases_whose_name_holds_it(chrome: Chrome, small_page: Path) -> None:
    chrome.open(small_page)
    shown = "[...document.querySelectorAll('#scores tbody tr')].filter(r => r.offsetParent).map(r => r.dataset.case)"
    chrome.until("!document.querySelector('.control').hidden")
    assert set(chrome.js(f"return {shown}")) == {"bounce", "stacked_drop_3"}
    choose(chrome, "#filter", "value", "DROP", "input")
    assert chrome.js(f"return {shown}") == ["stacked_drop_3"]
    choose(chrome, "#filter", "value", "", "input")
    assert len(chrome.js(f"return {shown}")) == 2


def test_another_error_measure_is_drawn_and_tabulated(chrome: Chrome, small_page: Path) -> None:
    chrome.open(small_page)
    chrome.until(DRAWN)
    choose(chrome, "select.measure", "selectedIndex", 1, "change")
    chrome.until("document.querySelector('[data-measure]')")
    box = chrome.js("return document.querySelector('[data-measure]').textContent")
    assert "energy drift (1 = the scene's own scale)" in box
    assert chrome.js("return document.querySelectorAll('[data-measure] .live').length") == 1
    # mujoco/tuned's finest drift: 0.5 * 0.08 * 30 / 960
    rows = "[...document.querySelector('section[data-case=stacked_drop_3] .points table').tBodies[0].rows]"
    cells = chrome.js(f"return {rows}.map(row => [row.cells[0].textContent, row.cells[2].textContent])")
    assert ["mujoco/tuned", "0.00125"] in cells
    assert chrome.console() == []


def test_a_deep_link_scrolls_to_its_case(chrome: Chrome, small_page: Path) -> None:
    chrome.open(small_page, "#scenario=stacked_drop_3")
    top = "document.querySelector('section[data-case=stacked_drop_3]').getBoundingClientRect().top"
    chrome.until(f"Math.abs({top}) < 300")
    assert chrome.js("return scrollY") > 0


def test_without_scripts_verdict_tables_and_drawings_are_there(chrome: Chrome, small_page: Path) -> None:
    chrome.open(small_page, scripts=False)
    text = chrome.driver.find_element("tag name", "main").text
    assert "Fails mujoco/tuned gains 86 % of the energy in bounce" in text
    assert "✓ 0.8 ms" in text
    assert "To stay below 1 % error" in text
    drawn = [one for one in chrome.driver.find_elements("css selector", ".chart .static svg") if one.is_displayed()]
    assert len(drawn) == 2  # error against step is folded away
    assert not [one for one in chrome.driver.find_elements("css selector", ".control") if one.is_displayed()]


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("kind", ["report", "diff"])
def test_axe_finds_nothing_serious(kind: str, dark: bool, chrome: Chrome, small_page: Path, tmp_path: Path) -> None:
    path = small_page
    if kind == "diff":
        other = small()
        other["rows"][0]["value"] *= 2
        path = tmp_path / "diff.html"
        diff_page.write_page(diff.compare(small(), other), path)
    chrome.open(path, dark=dark)
    chrome.js("document.querySelectorAll('details').forEach(one => one.open = true)")
    if kind == "report":
        chrome.until(DRAWN)
    assert serious(chrome) == []
