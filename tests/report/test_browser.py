"""The page of a report in Chromium: what clicks, keys and the slider do, with an empty console.

It needs Debian's ``chromium`` and ``chromium-driver``, and ``pip install "rodfem[browser]"``; without them it is
skipped, unless ``RODFEM_BROWSER=required`` says, as in ``.ci/run``, that it must run.
"""

import os
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import demo_cases
import numpy as np
import pytest
from output.test_formats import MESH, made
from problem.test_docs import scenes

from rodfem import Parameter, Plan, run
from rodfem.forms.energy import bending_and_twist
from rodfem.output.glyphs import POINT
from rodfem.report.page import page_of, payload_of

REQUIRED = os.environ.get("RODFEM_BROWSER") == "required"
if not REQUIRED:
    pytest.importorskip("selenium", reason='needs pip install "rodfem[browser]"')
from selenium import webdriver  # noqa: E402
from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402
from selenium.webdriver.support.ui import WebDriverWait  # noqa: E402

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
OPTIONS = (
    *("--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    "--disable-dev-shm-usage",  # a container may have little of it
)
SIZES = [(1280, 720), (1920, 1080)]
PROJECTOR = (1024, 768)
PATIENCE = 90.0
"""Seconds that a page may take on a busy machine."""

IN_PLANE = """const plot = document.getElementById("loci"), { xaxis, yaxis } = plot._fullLayout;
    const box = plot.getBoundingClientRect();
    return [box.x + xaxis._offset + xaxis.l2p(arguments[0]), box.y + yaxis._offset + yaxis.l2p(arguments[1])]"""
"""Where the plane of loci has a point."""

HAVE = REQUIRED or (CHROMIUM and DRIVER)
pytestmark = pytest.mark.skipif(not HAVE, reason="needs apt-get install chromium chromium-driver")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    options = webdriver.ChromeOptions()
    options.add_argument(f"--user-data-dir={tmp_path_factory.mktemp('profile')}")
    options.binary_location = CHROMIUM
    for option in OPTIONS:
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the pages show."""
    folder = made(tmp_path_factory.mktemp("browser"), "locus", "follower", "pinned")
    stiff = {"energy": lambda v, k, c: bending_and_twist(k, (c.EI, c.EI, 1.0)), "planar": "e1"}
    column = replace(scenes()["euler"], parameters={"P": Parameter(0.0), "EI": Parameter(1.0)}, **stiff)
    run(column, MESH, Plan(depth=0, sensitivity=True), folder / "column", figures=False, quiet=True)
    beck = demo_cases.scene("follower", span=(19.0, 21.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rodfem.diagram.sweep.LOADS", 26)
        run(beck, MESH, Plan(error_bars=False, locus=("J1", 0.0, 0.004)), folder / "beck", figures=False, quiet=True)
    return folder


@pytest.fixture
def opened(browser: Any, results: Path, tmp_path: Path) -> Iterator[Callable[..., Any]]:
    """Opens the page of a run; at the end the console is empty."""

    def open_page(name: str, size: tuple[int, int] = SIZES[0]) -> Any:
        path = tmp_path / "report.html"
        path.write_text(page_of(payload_of(results / name)))
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        browser.get(path.as_uri())
        until(browser, lambda: browser.execute_script("return document.body.dataset.ready"))
        return browser

    browser.get_log("browser")
    yield open_page
    assert browser.get_log("browser") == []


def until(browser: Any, condition: Callable[[], Any]) -> None:
    WebDriverWait(browser, PATIENCE, poll_frequency=0.05).until(lambda _: condition())


def data(page: Any, path: str) -> Any:
    """An entry of the data that the page has."""
    return page.execute_script(f"return import('report/data').then(({{ data }}) => data.{path})")


def select(page: Any, branch: int, row: int) -> None:
    """Show a row of a branch, the first of which is straight."""
    page.execute_script(f"import('report/store').then((store) => store.select({branch}, {row}))")
    until(page, lambda: shown(page) == (data(page, f"branches[{branch}].name"), row))


def row_of(page: Any, kind: str, branch: int = 0) -> int:
    """Row of the first special point of a kind."""
    return next(int(x["row"]) for x in data(page, f"branches[{branch}].special") if x["kind"] == kind)


def text(page: Any, part: str) -> str:
    return str(page.find_element(By.ID, part).text)


def all_of(page: Any, selector: str) -> list[Any]:
    return list(page.find_elements(By.CSS_SELECTOR, selector))


def curves(page: Any, axis: str = "y") -> np.ndarray:
    """The curves of the profile, (number, places)."""
    script = f"return document.getElementById('profile').data.map((trace) => Array.from(trace.{axis}))"
    return np.array(page.execute_script(script))


def shown(browser: Any) -> tuple[str, int]:
    data = browser.execute_script("return {...document.body.dataset}")
    return data["branch"], int(data["row"])


def picture(browser: Any) -> str:
    """The rod as it is drawn."""
    script = "const done = arguments[0]; import('report/rod').then((rod) => done(rod.picture(1).toDataURL()))"
    return str(browser.execute_async_script(script))


def vector(page: Any) -> str:
    """The rod as SVG."""
    return str(page.execute_async_script("import('report/rod').then((rod) => arguments[0](rod.vector()))"))


def press(browser: Any, key: str) -> None:
    ActionChains(browser).send_keys(key).perform()


def click_at(browser: Any, branch: int, row: int) -> None:
    """Click where the diagram draws a row."""
    script = """const plot = document.getElementById("diagram"), { xaxis, yaxis } = plot._fullLayout;
        const trace = plot.data.find((t) => t.customdata?.some((c) => c[0] === arguments[0] && c[1] === arguments[1]));
        const i = trace.customdata.findIndex((c) => c[0] === arguments[0] && c[1] === arguments[1]);
        const box = plot.getBoundingClientRect();
        return [box.x + xaxis._offset + xaxis.l2p(trace.x[i]), box.y + yaxis._offset + yaxis.l2p(trace.y[i])]"""
    click(browser, *browser.execute_script(script, branch, row))


def click(browser: Any, x: float, y: float) -> None:
    for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
        given = {"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1}
        browser.execute_cdp_cmd("Input.dispatchMouseEvent", given)


@pytest.mark.parametrize(("name", "size"), [("pinned", PROJECTOR), ("locus", SIZES[0]), ("follower", SIZES[1])])
def test_all_parts_fit_into_the_window(opened: Callable[..., Any], name: str, size: tuple[int, int]) -> None:
    page = opened(name, size)
    script = "return [document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
    assert page.execute_script(script) == list(size)
    for box in (card.rect for card in all_of(page, ".card")):
        assert box["x"] >= 0 and box["x"] + box["width"] <= size[0] and box["y"] + box["height"] <= size[1]
        assert box["width"] > 300 and box["height"] > 150
    wide = "return [...document.querySelectorAll('.bar')].filter((bar) => bar.scrollWidth > bar.clientWidth).length"
    assert page.execute_script(wide) == 0
    assert text(page, "badge").startswith(("STABLE", "UNSTABLE"))


@pytest.mark.parametrize("wide", [1400, 800, 390])
def test_no_page_is_wider_than_its_window(opened: Callable[..., Any], wide: int) -> None:
    """A narrow one has its cards one below the other."""
    page = opened("locus", (wide, 844))
    assert page.execute_script("return document.documentElement.scrollWidth") <= wide
    assert all(card.rect["width"] > 300 and card.rect["height"] > 150 for card in all_of(page, ".card"))


def test_an_address_leads_to_what_it_names(opened: Callable[..., Any]) -> None:
    page = opened("pinned")
    page.get(page.current_url.partition("#")[0] + "#branch=branch+1&row=2&ordinate=energy")
    until(page, lambda: page.execute_script("return document.body.dataset.ready") and shown(page) == ("branch 1", 2))
    assert page.execute_script("return document.body.dataset.ordinate") == "energy"
    press(page, Keys.ARROW_RIGHT)
    until(page, lambda: page.current_url.endswith("#branch=branch+1&row=3&ordinate=energy"))


def test_a_hidden_branch_is_nowhere(opened: Callable[..., Any]) -> None:
    page = opened("pinned")
    drawn = "return document.getElementById('diagram').data.filter((t) => t.customdata?.some((c) => c[0] === 1)).length"
    assert page.execute_script(drawn)
    swatch = all_of(page, "#legend .swatch")[1]
    swatch.click()
    until(page, lambda: not page.execute_script(drawn) and shown(page)[0] != "branch 1")
    for _ in data(page, "branches"):
        press(page, Keys.ARROW_DOWN)
        assert shown(page)[0] != "branch 1"
    swatch.click()
    until(page, lambda: page.execute_script(drawn))


def test_a_click_on_a_branch_changes_the_shape(opened: Callable[..., Any]) -> None:
    page = opened("pinned")
    click_at(page, 0, 2)
    until(page, lambda: shown(page) == ("straight", 2))
    straight, row = picture(page), data(page, "branches[1].load.length") // 2
    click_at(page, 1, row)
    until(page, lambda: shown(page)[0] == "branch 1")
    assert abs(shown(page)[1] - row) <= 1 and picture(page) != straight


@pytest.mark.parametrize("name", ["pinned", "locus"])
def test_labels_cover_neither_marks_nor_each_other(opened: Callable[..., Any], name: str) -> None:
    page = opened(name)
    script = """const box = (x) => { const r = x.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; };
        const marks = [...document.querySelectorAll("#diagram .scatterlayer .point")].map(box);
        return [[...document.querySelectorAll("#diagram .annotation-text-g")].map(box), marks]"""
    labels, marks = (np.array(boxes) for boxes in page.execute_script(script))
    centres = (marks[:, :2] + marks[:, 2:]) / 2
    assert len(labels) > len(data(page, "branches"))
    assert not ((centres > labels[:, None, :2]) & (centres < labels[:, None, 2:])).all(axis=2).any()
    apart = (labels[:, None, :2] >= labels[:, 2:]).any(axis=2) | (labels[:, None, 2:] <= labels[:, :2]).any(axis=2)
    assert (apart | np.eye(len(labels), dtype=bool)).all()


def test_the_slider_shows_all_states_of_a_load(opened: Callable[..., Any]) -> None:
    page = opened("pinned")

    def slide(place: int) -> None:
        page.execute_script(
            f"""const slider = document.getElementById("load"); slider.value = {place};
            slider.dispatchEvent(new Event("input"))"""
        )

    def cards() -> list[str]:
        script = "return [...document.querySelectorAll('#states button')].map((x) => x.innerText)"
        return list(page.execute_script(script))

    slide(500)
    until(page, lambda: len(cards()) == 1)
    assert "index 0" in cards()[0] and "straight" in cards()[0]
    slide(920)
    until(page, lambda: len(cards()) > 1)
    assert any("index 1" in card for card in cards())
    numbers = [re.findall(r"[\d.]+(?:e-?\d+)?", text(page, name))[0] for name in ("load-value", "state-load")]
    assert float(numbers[0]) == pytest.approx(float(numbers[1]), rel=1e-4)  # one load on the screen


def test_modes_move(opened: Callable[..., Any]) -> None:
    """Where a state has none, those of the nearest on either side are offered, in the order of their loads."""
    page = opened("pinned")
    rows, loads = sorted(map(int, data(page, "branches[0].modes"))), data(page, "branches[0].load")
    gap = next(a for a, b in pairwise(rows) if b > a + 1)
    select(page, 0, gap + 1)
    until(page, lambda: "modes at" in text(page, "modes"))
    offered = [float(words.split(" = ")[1]) for words in text(page, "modes").split("modes at")[1:]]
    assert offered == sorted(offered) and len(offered) == 2
    assert offered == pytest.approx([loads[row] for row in (gap, rows[rows.index(gap) + 1])], rel=1e-4)
    all_of(page, "#modes button")[0].click()
    until(page, lambda: shown(page)[1] == gap and "swings" in text(page, "modes"))
    all_of(page, "#modes button")[0].click()
    first = picture(page)
    until(page, lambda: picture(page) != first)
    pressed = (
        "[...document.querySelectorAll('#modes button')].findIndex((x) => x.getAttribute('aria-pressed') === 'true')"
    )
    for key, number in (("2", 1), ("2", -1), ("1", 0), (Keys.ESCAPE, -1)):
        press(page, key)
        until(page, lambda number=number: page.execute_script(f"return {pressed}") == number)
    press(page, Keys.END)
    until(page, lambda: shown(page)[1] == len(loads) - 1 and "grows" in text(page, "modes"))


def test_the_locus_of_a_flutter_load_leads_to_the_mode_that_flutters(opened: Callable[..., Any]) -> None:
    """Beck's column: omega = 11.02 at P = 20.05.  A click on the curve shows that state, and its mode moves."""
    page = opened("beck")
    all_of(page, "#diagram-tabs button")[1].click()
    until(page, lambda: all_of(page, "#loci .scatterlayer .trace"))
    (locus,) = data(page, "loci")
    ((_, row),) = locus["special"]
    click(page, *page.execute_script(IN_PLANE, locus["x"][len(locus["x"]) // 4], locus["load"][len(locus["x"]) // 4]))
    until(page, lambda: shown(page)[1] == row and "flutter" in text(page, "sentence").lower())
    assert float(re.findall(r"[\d.]+", text(page, "state-load"))[0]) == pytest.approx(20.05, abs=5e-3)
    buttons = all_of(page, "#modes button")
    values = [float(re.findall(r"[\d.]+", button.text)[0]) for button in buttons]
    assert min(values) ** 0.5 == pytest.approx(11.02, abs=5e-3)
    assert len({round(value, 1) for value in values}) == len(values)
    still = picture(page)
    buttons[values.index(min(values))].click()
    until(page, lambda: any(x.text.startswith("●") for x in all_of(page, "#modes [aria-pressed=true]")))
    moving = {picture(page) for _ in range(4)}
    assert still not in moving and len(moving) > 1


def test_each_number_has_its_error_or_says_that_it_has_none(opened: Callable[..., Any]) -> None:
    """Of Euler's column between hinges, which buckles at pi^2; rows without a special point have no estimates."""
    page = opened("pinned")

    def read(branch: int, row: int) -> list[str]:
        select(page, branch, row)
        return [text(page, part) for part in ("state-load", "numbers", "values", "modes")]

    load, numbers, *_ = read(0, row_of(page, "branch point"))
    value, bound = map(float, load.removeprefix("P = ").removesuffix(")").split(" ("))
    assert abs(value - np.pi**2) <= bound < 1e-9 and numbers.endswith("energy = 0.000000000000 (1e-12)")
    load, numbers, values, modes = read(1, row_of(page, "user", 1))
    numbered = r"middle = 0\.2679\d+ \(\de-\d+\); energy = 2\.111695\d+ \(\de-\d+\)"
    assert load == "P = 11 (given)" and re.search(numbered, numbers)
    assert values == "" and len(re.findall(r"\d\.\d+ \(\de-\d+\) swings", modes)) == 2 and "0 (exact)" in modes
    load, numbers, values, _ = read(1, 4)
    assert load.startswith("P = ~") and numbers.count("~") == numbers.count(" = ") == 2 == values.count("~")
    assert "~: error not estimated" in text(page, "errors")


def test_strains_forces_and_moments_are_curves_with_names(opened: Callable[..., Any]) -> None:
    """Of a pinned column under the load P: the force has the size P, and the moment vanishes at the ends."""
    page = opened("pinned")
    select(page, 1, 6)
    load, found = data(page, "branches[1].load[6]"), {}
    for tab in all_of(page, "#profile-tabs button"):
        tab.click()
        found[tab.text] = curves(page), text(page, "profile-legend")
    assert list(found) == ["curvature", "strain", "moment", "force"]
    assert "tension" in found["force"][1] and "torque" in found["moment"][1] and "twist" in found["curvature"][1]
    assert np.allclose(np.linalg.norm(found["force"][0], axis=0), load, rtol=1e-5) and (found["force"][0][2] < 0).any()
    all_of(page, "#profile-space input")[0].click()  # the force, chosen last
    assert np.allclose(curves(page), [[0.0], [0.0], [-load]], atol=1e-4 * load)
    assert "n₃ along e₃" in text(page, "profile-legend")
    size = np.linalg.norm(found["moment"][0], axis=0)
    assert size[[0, -1]].max() < 1e-2 * size.max() and size.argmax() in range(len(size) // 3, 2 * len(size) // 3)
    assert np.allclose(found["strain"][0][2], 1.0)
    # the elements' own polynomials, as fine as a wide screen: the elastica's |m| has no corner
    x = curves(page, "x")[0]
    slope = np.diff(size) / np.maximum(np.diff(x), POINT)
    inside = (np.diff(x) > 0)[1:] & (np.diff(x) > 0)[:-1]
    assert len(size) > 100 and abs(np.diff(slope)[inside]).max() < 0.05 * abs(slope).max()


def test_loci_ordinates_views_and_exports_work(opened: Callable[..., Any]) -> None:
    page = opened("locus")
    for choice in ("ordinate", "view"):
        options = all_of(page, f"#{choice} option")
        assert len(options) > 2
        for option in options:
            option.click()
    all_of(page, "#diagram-tabs button")[1].click()
    until(page, lambda: all_of(page, "#loci .scatterlayer .trace"))
    assert not page.find_element(By.ID, "diagram").is_displayed()
    for format in ("svg", "png"):
        script = """const done = arguments[1], plot = document.getElementById("diagram");
            Plotly.toImage({data: plot.data, layout: plot.layout}, {format: arguments[0], width: 600, height: 400})
            .then(done)"""
        url = page.execute_async_script(script, format)
        assert url.startswith(f"data:image/{format}") and len(url) > 5000
    svg = ElementTree.fromstring(vector(page))
    assert len(svg.findall("{*}path[@fill='none']")) > 500
    assert [x.text for x in svg.findall("{*}text")][:3] == ["e₁", "e₂", "e₃"]
    page.find_element(By.ID, "about-button").click()
    assert "dolfinx" in text(page, "origin")


def test_the_rod_shows_where_to_stiffen_it(opened: Callable[..., Any]) -> None:
    """Of a pinned column by 2 pi^2 sin^2 pi s: white at the hinges, red in the middle."""
    page = opened("column")
    label, legend = (page.find_element(By.ID, f"stiffen-{part}") for part in ("label", "legend"))
    select(page, 0, row_of(page, "branch point"))
    until(page, label.is_displayed)
    plain = picture(page)
    all_of(page, "#stiffen option")[1].click()
    until(page, lambda: legend.is_displayed() and picture(page) != plain)
    assert float(re.findall(r"to (\d+\.?\d*), most", legend.text)[0]) == pytest.approx(2 * np.pi**2, rel=0.02)
    assert float(legend.text.split("s = ")[1]) == pytest.approx(0.5, abs=1 / 16)
    script = "return import('report/stiffen').then((s) => [0, 0.25, 0.5, 1].map((t) => s.colours()(t)))"
    blue = [int(re.findall(r"\d+", colour)[2]) for colour in page.execute_script(script)]
    assert min(blue[0], blue[3]) > 240 and 100 < blue[1] < 200 and blue[2] < 50
    assert len(set(re.findall(r'stroke="([^"]+)"', vector(page)))) > 20
    select(page, 0, 0)
    until(page, lambda: not label.is_displayed() and not legend.is_displayed())


def test_frequencies_come_first_for_a_follower_load(opened: Callable[..., Any]) -> None:
    """Leipholz's column (1962): two frequencies meet at q = 40.05, and the range above is shaded."""
    page = opened("follower")
    script = """const plot = document.getElementById("diagram"), star = plot.data.at(-1), { shapes } = plot.layout;
        return [star.x[0], star.customdata[0][1], shapes.map((shape) => [shape.x0, shape.x1]),
            plot.data.filter((t) => t.mode == 'lines').map((t) => t.y[0])]"""
    load, row, ((low, high),), first = page.execute_script(script)
    assert load == pytest.approx(40.05, abs=5e-3) and low == pytest.approx(load) and high > low
    assert "range of flutter" in text(page, "legend")
    assert min(y for y in first if y is not None) == pytest.approx(3.51602, abs=1e-3)  # of the cantilever, at P = 0
    click_at(page, 0, row)
    until(page, lambda: shown(page)[1] == row)
    all_of(page, "#ordinate option")[1].click()
    until(page, lambda: "range of flutter" not in text(page, "legend"))
