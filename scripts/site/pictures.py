"""Takes the pictures of the page in docs/figures: python scripts/site/pictures.py [NAME...]

Runs, opens their replays in a browser and keeps what it shows: view, compare, lane, plane, fleets;
hands is a live page. All of them if none is named. The browser is that of the tests.
"""

import io
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from PIL import Image

import gne_mj as gm
from gne_mj.scenario import load_scenario
from gne_mj.viewer import Session, write_html

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from browser import Recorded, launched  # noqa: E402

FOLDER = ROOT / "docs" / "figures"
FLEETS = {"cars": 0.3, "drones": 0.3, "boats": 1.5, "mixed": 0.4}  # at so many s
GAP = 8  # px between them


def view(browser: Any) -> Image.Image:
    """The paper's two experiments, with their plots."""
    return taken(browser, gm.run("paper"), 0.9, (1366, 768))


def compare(browser: Any) -> Image.Image:
    """Two runs beside each other."""
    runs = {
        f"planar_{name}": gm.run("planar-sync", {"barrier.rho": rho, "simulation.duration": 5.0})
        for name, rho in (("a", 0.1), ("b", 0.5))
    }
    return taken(browser, runs, 2.4, (1240, 720))


def lane(browser: Any) -> Image.Image:
    """Five robots in the lane, alone."""
    run = gm.run("velocity-sync", {"simulation.duration": 2.0})
    whole = taken(browser, run, 0.9, (1100, 640), "#view", "light", nearer=-250)
    return whole.crop((30, whole.height // 2 - 120, 1070, whole.height // 2 + 120))


def plane(browser: Any) -> Image.Image:
    """Six robots in the plane, alone."""
    run = gm.run("planar-sync", {"simulation.duration": 2.0})
    return taken(browser, run, 0.8, (720, 640), "#view", "light", nearer=-250)


def fleets(browser: Any) -> Image.Image:
    """The four fleets of robots with bodies of their own, by day and by night."""
    found = [
        taken(
            browser, gm.run(name, {"simulation.duration": time + 1.0}), time, (620, 640), "#view",
            "dark" if name in ("drones", "mixed") else "light", nearer=-350,
        )
        for name, time in FLEETS.items()
    ]  # fmt: skip
    width, height = (min(sizes) for sizes in zip(*(each.size for each in found), strict=True))
    whole = Image.new("RGB", (2 * width + GAP, 2 * height + GAP), "white")
    for k, each in enumerate(found):
        part = each.crop((0, 0, width, height))
        whole.paste(part, (k % 2 * (width + GAP), k // 2 * (height + GAP)))
    return whole


def hands(browser: Any) -> Image.Image:
    """A live page: robot 2 is chosen and dragged, its link with 3 was lost."""
    law = {"information": "partial", "graph": "ring", "coupling": 5.0}
    with (
        live("velocity-sync", {"controller": law, "simulation.duration": 1000.0}) as session,
        opened(browser, session.server.url, (1240, 720), "dark") as page,
    ):
        page.evaluate("document.getElementById('tuning').open = false")
        wait(page, "window.gne.time() > 2")
        page.keyboard.press("Space")
        wait(page, "!window.gne.state().playing")
        page.mouse.click(*head(page, 1, 2))
        wait(page, "window.gne.state().lost.length === 1")
        x, y = head(page, 1)
        page.mouse.click(x, y)
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 70, y, steps=3)
        page.wait_for_timeout(500)
        return picture(page.screenshot())


def taken(
    browser: Any,
    runs: Any,
    time: float,
    size: tuple[int, int],
    part: str = "",
    theme: str = "light",
    *,
    nearer: float = 0.0,
) -> Image.Image:
    """A replay at a time: all of the page, or a part of it with the wheel turned."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "run.html"
        write_html(runs, file)
        with opened(browser, file.as_uri(), size, theme) as page:
            page.evaluate("time => window.gne.seek(time)", time)
            if not part:
                page.wait_for_timeout(1500)
                return picture(page.screenshot())
            if page.locator("#plots").is_visible():
                page.get_by_role("button", name="Plots").click()
            page.locator("#pane").click(position={"x": 5, "y": 5})  # the wheel zooms after a click
            page.mouse.wheel(0, nearer)
            page.wait_for_timeout(1500)
            return picture(page.locator(part).screenshot())


@contextmanager
def opened(browser: Any, url: str, size: tuple[int, int], theme: str) -> Iterator[Any]:
    """A page that shows something, in a theme."""
    with browser.page(Recorded()) as page:
        page.emulate_media(color_scheme=theme)
        page.set_viewport_size({"width": size[0], "height": size[1]})
        page.goto(url)
        wait(page, "window.gne && window.gne.ready")
        yield page


@contextmanager
def live(scenario: str, changes: dict[str, Any]) -> Iterator[Session]:
    """A live session in a thread."""
    session, stop = Session(load_scenario(scenario, changes), scenario), threading.Event()
    thread = threading.Thread(target=lambda: session.run(stop))
    thread.start()
    try:
        yield session
    finally:
        stop.set()
        thread.join()
        session.server.close()


def wait(page: Any, expression: str) -> None:
    """Until an expression holds; the page refuses Playwright's own way."""
    while not page.evaluate(expression):
        page.wait_for_timeout(50)


def head(page: Any, *agents: int) -> tuple[float, float]:
    """Where an agent's head, or the middle of a link, from 0, is in the window."""
    page.wait_for_timeout(300)
    at = page.evaluate("a => window.gne.head(...a)", ["robots", *agents])
    box = page.locator("#pane").bounding_box()
    return box["x"] + at["x"], box["y"] + at["y"]


def picture(png: bytes) -> Image.Image:
    """What a browser has taken."""
    return Image.open(io.BytesIO(png)).convert("RGB")


def main(names: list[str]) -> None:
    """Those named, or all."""
    pictures = {each.__name__: each for each in (view, compare, lane, plane, fleets, hands)}
    with launched() as browser:
        for name in names or pictures:
            pictures[name](browser).save(FOLDER / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
