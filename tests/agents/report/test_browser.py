"""The report in a real browser, where there is one: what the controls do, without an error and without a request."""

import csv
import re

import numpy as np
import pytest

from agents.paper.figures import write_series
from tests.support.browser import chromium, emulate, keep_picture

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def browser():
    with chromium() as driver:
        yield driver


@pytest.fixture
def opened(browser, document, tmp_path_factory):
    """The page in the browser, all of its parts ready."""
    path = tmp_path_factory.getbasetemp() / "report.html"
    if not path.exists():
        path.write_text(document, encoding="utf-8")
    emulate(browser)
    browser.get(path.as_uri())
    wait(browser, "return document.documentElement.dataset.ready === 'true'")
    return browser


def wait(browser, condition):
    from selenium.webdriver.support.wait import WebDriverWait

    WebDriverWait(browser, 20, poll_frequency=0.05).until(lambda driver: driver.execute_script(condition))


def text(browser, selector):
    return browser.execute_script("return document.querySelector(arguments[0]).textContent", selector)


def number(browser, quantity, slot="a"):
    written = text(browser, f'#numbers [data-quantity="{quantity}"][data-slot={slot}]')
    return float(written.replace("\N{MINUS SIGN}", "-"))


def press(browser, selector, *keys):
    browser.find_element("css selector", selector).send_keys(*keys)


def test_it_opens_without_errors_and_without_requests(opened):
    assert [entry for entry in opened.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")] == []
    assert opened.execute_script("return performance.getEntriesByType('resource').map(e => e.name)") == []


@pytest.fixture(scope="module")
def rows(runs, tmp_path_factory):
    """The series of the paper's cases as `python -m agents reproduce` writes them, by elbows and time."""
    cases = {int(run.bearing): run.series for run in runs if run.controller == "pd_paper" and run.start == "paper"}
    path = write_series(tmp_path_factory.mktemp("series") / "series.csv", cases)
    with path.open(newline="", encoding="utf-8") as handle:
        return {(int(row["elbows"]), round(float(row["time [s]"]), 2)): row for row in csv.DictReader(handle)}


def test_the_slider_shows_the_series_values(opened, rows):
    from selenium.webdriver.common.keys import Keys

    press(opened, "#time", Keys.HOME, *[Keys.ARROW_RIGHT] * 7)
    assert text(opened, "#clock") == "0.07 s"
    seen = []
    for keys, time in (((), 0.07), ((Keys.END,), 5.0), ((Keys.ARROW_LEFT,), 4.99)):
        press(opened, "#time", *keys)
        for slot, elbows in (("a", 2), ("b", 0)):
            row = {name: float(value or "nan") for name, value in rows[elbows, time].items()}
            energy = sum(row[f"electrical_energy_{joint} [J]"] for joint in range(1, 11))
            away = [row[f"hand_{axis} [m]"] - row[f"target_{axis} [m]"] for axis in "xyz"]
            assert number(opened, "energy", slot) == pytest.approx(energy, rel=1e-4, abs=6e-4)
            assert number(opened, "error", slot) == pytest.approx(1e3 * np.linalg.norm(away), rel=1e-3)
            assert number(opened, "height", slot) == pytest.approx(1e3 * away[2], rel=1e-3)
        row = rows[2, time]
        assert number(opened, "force-4") == pytest.approx(float(row["elbow_force_4 [N]"]), abs=6e-4)
        assert number(opened, "force-7") == pytest.approx(float(row["elbow_force_7 [N]"]), abs=6e-4)
        seen.append(number(opened, "energy"))
    assert len(set(seen)) == 3
    wait(opened, "return document.getElementById('announcement').textContent.startsWith('At 4.99 s')")


def test_counting_from_two_seconds_takes_off_what_was_spent_before(opened, rows):
    opened.execute_script("document.querySelector('input[name=since][value=\"2\"]').click()")
    press(opened, "#time", "\ue010")  # End
    spent = [sum(float(rows[2, t][f"electrical_energy_{joint} [J]"]) for joint in range(1, 11)) for t in (2.0, 5.0)]
    assert number(opened, "energy") == pytest.approx(spent[1] - spent[0], rel=1e-4)
    press(opened, "#time", "\ue011")  # Home
    assert text(opened, "#clock") == "2.00 s"


def test_a_point_of_the_front_puts_its_run_into_the_replay(opened):
    before = opened.execute_script("return document.getElementById('scene').toDataURL()")
    opened.execute_script("document.getElementById('runs').scrollIntoView()")
    wait(opened, "return document.querySelector('.point[data-run=\"ppo-2-paper\"]') !== null")
    press(opened, '.point[data-run="ppo-2-paper"]', "\ue007")  # Enter
    wait(opened, "return document.getElementById('name-a').textContent === 'A: PPO, 24 V, two elbows'")
    pressed = "return [...document.querySelectorAll('.point[aria-pressed=true]')].map(p => p.dataset.run)"
    assert opened.execute_script(pressed) == ["ppo-2-paper"]
    assert opened.execute_script("return document.getElementById('scene').toDataURL()") != before
    # The arrow keys go on to the next point, which takes over the place in the order of Tab.
    press(opened, '.point[data-run="ppo-2-paper"]', "\ue014", "\ue00d")  # right, Space
    wait(opened, "return document.getElementById('name-a').textContent.startsWith('A: PD')")


def test_the_arrow_keys_turn_the_view(opened):
    picture = "return document.getElementById('scene').toDataURL()"
    before = opened.execute_script(picture)
    press(opened, "#scene", "\ue012", "\ue012")  # left
    assert opened.execute_script(picture) != before
    press(opened, "#scene", "\ue014", "\ue014")  # right, back again
    assert opened.execute_script(picture) == before


def test_playing_moves_the_time_until_it_is_stopped(opened):
    # At full speed a busy machine has reached the end, where Space starts it again, before the second press.
    opened.execute_script("document.getElementById('speed').value = '0.1'")
    press(opened, "#play", "\ue00d")  # Space
    assert text(opened, "#play") == "Pause"
    wait(opened, "return Number(document.getElementById('time').value) > 2.02")
    press(opened, "#play", "\ue00d")
    assert text(opened, "#play") == "Play"
    stopped = "return document.getElementById('time').value"
    before = opened.execute_script(stopped)
    opened.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert opened.execute_script(stopped) == before


def test_with_reduced_motion_playing_goes_in_steps(opened):
    emulate(opened, prefers_reduced_motion="reduce")
    opened.execute_script(
        "window.seen = [2];"
        "const keep = () => window.seen.push(Number(document.getElementById('time').value));"
        "new MutationObserver(keep).observe(document.getElementById('clock'), {childList: true});"
    )
    press(opened, "#play", "\ue00d")
    wait(opened, "return window.seen.length > 3")
    press(opened, "#play", "\ue00d")
    steps = np.diff(list(dict.fromkeys(opened.execute_script("return window.seen"))))
    # Of half a second; the first frame only starts the clock.
    assert steps.size > 1
    assert (steps[1:] > 0.4).all()


def test_every_control_has_a_name_for_a_screen_reader(opened):
    opened.execute_cdp_cmd("Accessibility.enable", {})
    nodes = opened.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    roles = ("button", "slider", "combobox", "radio", "checkbox", "image", "img", "region", "link")
    controls = [node for node in nodes if node.get("role", {}).get("value") in roles and not node.get("ignored")]
    assert len(controls) > 60
    assert [node for node in controls if not node.get("name", {}).get("value")] == []


def test_all_figures_of_the_paper_are_drawn_and_follow_the_slider(opened):
    assert opened.execute_script("return document.querySelectorAll('#panels > figure').length") == 25
    opened.execute_script("document.getElementById('figure-25').scrollIntoView()")
    wait(opened, "return document.querySelectorAll('#figure-25 .curve').length === 3")
    place = "return document.querySelector('#figure-25 .cursor').getAttribute('x1')"
    before = opened.execute_script(place)
    press(opened, "#time", "\ue010")
    assert opened.execute_script(place) != before
    opened.execute_script("document.querySelector('input[name=case][value=\"0\"]').click()")
    wait(opened, "return document.querySelectorAll('#figure-25 .curve').length === 2")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 375])
def test_it_fits_the_screen_in_both_schemes(opened, width, scheme):
    emulate(opened, width, 800, prefers_color_scheme=scheme)
    wait(opened, f"return innerWidth === {width} && document.documentElement.scrollWidth <= {width}")
    ground = opened.execute_script("return getComputedStyle(document.documentElement).backgroundColor")
    brightness = np.mean([int(channel) for channel in re.findall(r"\d+", ground)[:3]])
    assert (brightness > 128) == (scheme == "light")
    keep_picture(opened, f"report_{width}_{scheme}.png")


def test_the_benchmarks_table_fits_1280_pixels_with_every_row_and_its_lines_run_through(opened):
    opened.execute_script(
        "for (const filter of document.querySelectorAll('#filters select')) {"
        "  if (filter.name !== 'set') filter.value = '';"
        "  filter.dispatchEvent(new Event('change'));"
        "}"
    )
    frame, table, rows = opened.execute_script(
        "const frame = document.querySelector('#benchmark .scroll');"
        "const rows = [...frame.querySelectorAll('tbody tr:not([hidden])')];"
        "const edge = cell => [getComputedStyle(cell).borderTopWidth, cell.getBoundingClientRect().top];"
        "return [frame.clientWidth, frame.scrollWidth, rows.map(row => [edge(row.cells[0]), edge(row.cells[1])])];"
    )
    assert table <= frame
    assert len(rows) > 50
    for first, second in rows:
        assert first == second
        assert first[0] == "1px"
