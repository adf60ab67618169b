"""The replay in real browsers: deep links, keys, jumps, points that open their run, speed without a GPU."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from browsers import Chrome, Firefox, busy, serious
from impactbench.reports import page
from replay_pages import BALL, boxes, real
from test_charts import SPECIAL
from test_page import small

READY = "document.querySelector('#replay-panels canvas') && document.querySelector('#replay-plots svg')"
FRAME = 1 / 60
Report = tuple[Path, dict[str, Any]]


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    """Report of real runs, and its document."""
    path = tmp_path_factory.mktemp("replay") / "report.html"
    return path, real(path)


def address(case: str, engine: str, time: float) -> str:
    return f"#scenario={quote(case, safe='')}&engine={quote(engine, safe='')}&t={time}"


def value(chrome: Chrome, part: str) -> str:
    return str(chrome.js(f"return document.getElementById('replay-{part}').value"))


def text(chrome: Chrome, part: str) -> str:
    return str(chrome.js(f"return document.getElementById('replay-{part}').textContent"))


def press(chrome: Chrome, key: str) -> None:
    chrome.driver.switch_to.active_element.send_keys(key)


def recorded(report: Report, case: str, contestant: str) -> dict[str, Any]:
    (found,) = [c for c in report[1]["replays"]["cases"] if c["case"] == case]
    (run,) = [r for r in found["runs"] if r["contestant"] == contestant]
    return dict(run)


def test_a_deep_link_lands_on_scene_engine_and_time_and_stays_quiet(chrome: Chrome, report: Report) -> None:
    path, _ = report
    chrome.open(path, address(BALL, "pymunk/tuned", 0.5))
    chrome.until(READY)
    chrome.until("document.getElementById('replay-clock').textContent === '0.500 s'")
    assert (value(chrome, "scene"), value(chrome, "focus")) == (BALL, "pymunk/tuned")
    assert chrome.js("return document.getElementById('replay-section').getBoundingClientRect().top") < 200
    chrome.js("location.hash = arguments[0]", address("static_wall[bounciness=1]", "mujoco/default", 0.25))
    chrome.until("document.getElementById('replay-scene').value.startsWith('static_wall')")
    chrome.until("document.getElementById('replay-clock').textContent === '0.250 s'")
    assert chrome.console() == []
    assert [url.partition("#")[0] for url in chrome.requests()] == [path.as_uri()]


def test_keys_step_jump_and_play_and_the_address_follows(chrome: Chrome, report: Report) -> None:
    chrome.open(report[0], address(BALL, "pymunk/tuned", 0))
    chrome.until(READY)
    chrome.until("document.activeElement.id === 'replay-player'")
    press(chrome, "\ue014")  # arrow right
    press(chrome, ".")
    assert float(value(chrome, "time")) == pytest.approx(2 * FRAME)
    press(chrome, "\ue012")  # arrow left
    assert float(value(chrome, "time")) == pytest.approx(FRAME)
    press(chrome, "\ue010")  # end
    assert float(value(chrome, "time")) == pytest.approx(3.0)
    press(chrome, "\ue011")  # home
    assert float(value(chrome, "time")) == 0
    still = chrome.js("return document.querySelector('#replay-panels canvas').toDataURL()")
    # Slowly, so that it cannot reach its end before the second press, however busy the machine.
    chrome.js(
        "const s = document.getElementById('replay-speed'); s.value = '0.1'; s.dispatchEvent(new Event('change'))"
    )
    press(chrome, " ")
    chrome.until("Number(document.getElementById('replay-time').value) > 0.03")
    press(chrome, " ")
    assert chrome.js("return document.querySelector('#replay-panels canvas').toDataURL()") != still
    assert chrome.js("return document.createElement('canvas').getContext('webgl')") is None  # it moves without
    stopped = text(chrome, "clock")
    time = "Number(new URLSearchParams(location.hash.slice(1)).get('t'))"
    chrome.until(f"{time}.toFixed(3) + ' s' === '{stopped}'")
    assert text(chrome, "clock") == stopped  # it stands


def test_a_close_up_fills_the_panels_with_the_bodies_and_is_part_of_the_address(chrome: Chrome, report: Report) -> None:
    # How much of the first panel bodies cover: everything that is neither clear nor the ground's grey.
    covered = """const canvas = document.querySelector('#replay-panels canvas');
      const ground = getComputedStyle(document.documentElement).getPropertyValue('--panel').trim();
      const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      const grey = [1, 3, 5].map(k => parseInt(ground.slice(k, k + 2), 16));
      let count = 0;
      for (let i = 0; i < data.length; i += 4)
        if (data[i + 3] > 200 && grey.some((c, k) => Math.abs(c - data[i + k]) > 8)) count++;
      return count / (canvas.width * canvas.height)"""
    chrome.open(report[0], address(BALL, "pymunk/tuned", 0.1))
    chrome.until(READY)
    far = chrome.js(f"return (() => {{ {covered} }})()")
    chrome.js("document.getElementById('replay-close').click()")
    chrome.until("location.hash.endsWith('&close=1')")
    near = chrome.js(f"return (() => {{ {covered} }})()")
    assert near > 5 * far > 0
    chrome.open(report[0], address(BALL, "pymunk/tuned", 0.1) + "&close=1")
    chrome.until(READY)
    assert chrome.js("return document.getElementById('replay-close').checked")
    assert chrome.js(f"return (() => {{ {covered} }})()") == near
    assert chrome.js("return document.querySelector('.poster a').hash").endswith("&close=1")


def test_buttons_jump_to_what_the_harness_found(chrome: Chrome, report: Report) -> None:
    chrome.open(report[0], address(BALL, "mujoco/default", 0))
    chrome.until(READY)
    events = recorded(report, BALL, "mujoco/default")["events"]
    assert events["first_violation"]
    for name in ("first_contact", "first_violation", "largest_error"):
        chrome.js("document.querySelector(arguments[0]).click()", f"[data-event={name}]")
        chrome.until(f"document.getElementById('replay-status').textContent.includes('{name.replace('_', ' ')}')")
        assert float(text(chrome, "clock").removesuffix(" s")) == pytest.approx(events[name]["time"], abs=6e-4)
    # What the panel reads out of the packed series is what was measured, to two digits.
    caption = chrome.js("return [...document.querySelectorAll('#replay-panels figure')].map(f => f.textContent)")
    (shown,) = [line for line in caption if line.startswith("mujoco/default")]
    assert f"error {100 * events['largest_error']['value']:.2g} %" in shown


def test_a_click_on_a_point_opens_its_replay_and_says_which_step(chrome: Chrome, report: Report) -> None:
    chrome.open(report[0])
    chrome.until(READY)
    point = """
      const figure = [...document.querySelectorAll('figure[data-case]')].find(f => f.dataset.case === arguments[0]);
      figure.scrollIntoView({block: 'center'});
      const marks = [...figure.querySelectorAll('.live .mark-symbol path')];
      return marks.find(m => m.__data__.datum.policy === arguments[1] && m.__data__.datum.step_text === arguments[2])"""
    name = f"(() => {{ {point} }})".replace("arguments", "wanted")
    chrome.until(f"(wanted => {name}())({[BALL, 'mujoco/default', '1/30']!r})")
    chrome.js(point, BALL, "mujoco/default", "1/30").click()
    chrome.until("document.getElementById('replay-status').textContent.includes('1/30 was not recorded')")
    assert (value(chrome, "scene"), value(chrome, "focus")) == (BALL, "mujoco/default")
    chrome.until("document.getElementById('replay-plots-title').textContent.includes('mujoco/default')")
    violation = recorded(report, BALL, "mujoco/default")["events"]["first_violation"]
    assert text(chrome, "clock") == f"{violation['time']:.3f} s"


@pytest.mark.parametrize("size", [(1366, 768), (390, 844)])
@pytest.mark.parametrize("dark", [False, True])
def test_axe_finds_nothing_serious_beside_a_replay(
    dark: bool, size: tuple[int, int], chrome: Chrome, report: Report
) -> None:
    chrome.open(report[0], address(BALL, "mujoco/default", 0.9), dark=dark, size=size)
    chrome.until(READY)
    assert chrome.js("return document.querySelectorAll('.poster svg').length") > 1
    assert serious(chrome) == []


def test_firefox_draws_the_replay_and_stays_quiet(firefox: Firefox, report: Report) -> None:
    firefox.open(report[0], address(BALL, "mujoco/default", 0.9))
    firefox.until(READY)
    firefox.until("document.getElementById('replay-clock').textContent === '0.900 s'")
    colours = """(() => { const c = document.querySelector('#replay-panels canvas');
      return new Set(new Uint32Array(c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer)).size })()"""
    assert firefox.js(colours) > 5
    assert firefox.console() == []


def test_without_scripts_poster_and_numbers_stand_and_no_dead_controls(chrome: Chrome, report: Report) -> None:
    chrome.open(report[0], scripts=False)
    seen = """return [document.querySelectorAll('.poster svg circle.ghost').length,
      document.querySelectorAll('#replay-section tbody tr').length,
      document.getElementById('replay-player').hidden]"""
    chrome.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    ghosts, rows, hidden = chrome.js(seen)
    assert ghosts >= 2
    assert rows == 6
    assert hidden


@pytest.mark.parametrize("name", [*SPECIAL, "\u202eright to left \u05d0\u05d1"])
def test_names_stay_text_in_the_replay(name: str, chrome: Chrome, tmp_path: Path) -> None:
    path = tmp_path / "hostile.html"
    own = f"{name}/default"
    boxes(path, 4, (own, "b/two"))
    chrome.open(path, address("crowd", own, 0.5))
    chrome.until(READY)
    assert value(chrome, "focus") == own
    # Panels, boxes to choose them, the title of the plots, the poster: the name and nothing made of it.
    for place in ("#replay-panels", "#replay-runs", "#replay-plots-title", ".poster"):
        assert own in chrome.js(f"return document.querySelector('{place}').textContent")
    assert own in chrome.js("return document.querySelector('#replay-panels canvas').getAttribute('aria-label')")
    assert chrome.js("return document.querySelectorAll('img').length") == 0
    assert chrome.js("return document.documentElement.scrollWidth") == 1366
    assert chrome.console() == []


def test_reduced_motion_moves_in_steps_and_only_when_asked(chrome: Chrome, report: Report) -> None:
    chrome.open(report[0], address(BALL, "pymunk/tuned", 0), calm=True)
    chrome.until(READY)
    assert (text(chrome, "play"), value(chrome, "time")) == ("Play", "0")
    count = """const done = arguments[0], seen = new Set(), clock = document.getElementById('replay-clock');
      new MutationObserver(() => seen.add(clock.textContent)).observe(clock, {childList: true});
      document.getElementById('replay-play').click();
      setTimeout(() => { document.getElementById('replay-play').click(); done(seen.size) }, 1000)"""
    assert 1 <= chrome.driver.execute_async_script(count) <= 5  # four a second


def test_300_boxes_in_four_panels_and_the_overlay_can_be_drawn_30_times_a_second(
    chrome: Chrome, tmp_path: Path
) -> None:
    path = tmp_path / "crowd.html"
    boxes(path)
    chrome.open(path, address("crowd", "a/one", 0), size=(1366, 900))
    chrome.until(READY)
    measure = """const done = arguments[0], clock = document.getElementById('replay-clock'); let frames = 0;
      new MutationObserver(() => frames++).observe(clock, {childList: true});
      document.getElementById('replay-play').click();
      setTimeout(() => done(frames), 1500)"""
    # The main thread's own processor time: it draws the canvases, and other work on the machine does not count.
    chrome.driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
    before = busy(chrome)
    frames = chrome.driver.execute_async_script(measure)
    each = (busy(chrome) - before) / frames
    chrome.driver.execute_cdp_cmd("Performance.disable", {})
    print(f"{frames} frames in 1.5 s; {1000 * each:.1f} ms of the main thread each")
    assert frames
    assert each <= 1 / 30


def test_results_without_replays_still_make_a_page() -> None:
    html = page.render(small())
    assert 'id="replay' not in html
    assert 'class="poster"' not in html
