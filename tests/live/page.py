"""Test of the live page in headless Chromium: a mesh is dropped, explored by planners and by a person, held, stepped,
reloaded, entered by its token, seen in two tabs, on a phone, on dark paper, by keyboard alone, and checked by axe.

Usage: python page.py PROGRAM MESH [--axe axe.min.js] [--pictures FOLDER]
"""

import argparse
import pathlib
import re
import subprocess
import sys
import tempfile
import time

from playwright.sync_api import Page, expect, sync_playwright

LONGEST_MS = 60_000


class Live:
    """`palpate live` in a folder of its own."""

    def __init__(self, program: str, *arguments: str) -> None:
        self.folder = tempfile.TemporaryDirectory()
        command = [str(pathlib.Path(program).resolve()), "--quiet", "live", "--no-browser", *arguments]
        self.process = subprocess.Popen(command, cwd=self.folder.name, stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        self.url = re.search(r"http://\S+", line)[0]

    def __enter__(self) -> "Live":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        self.process.wait(10)
        self.folder.cleanup()


def statuses(page: Page) -> str:
    return page.locator("#panels").inner_text()


def wait(page: Page, words: str) -> None:
    page.wait_for_function("words => document.querySelector('#panels').innerText.includes(words)", arg=words, timeout=LONGEST_MS)


def touches(page: Page, name: str) -> int:
    return page.evaluate("name => told.planners.find(it => it.name === name).touches", name)


def when(found, what: str) -> None:
    begun = time.monotonic()
    while not found():
        assert time.monotonic() - begun < LONGEST_MS / 1e3, what
        time.sleep(0.05)


def is_drawn(page: Page, index: int) -> bool:
    """Whether a canvas has many colours, which an empty one has not."""
    script = """index => {
        const canvas = document.querySelectorAll('#panels canvas')[index];
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        const seen = new Set();
        for (let i = 0; i < data.length; i += 16) seen.add(data[i] * 65536 + data[i + 1] * 256 + data[i + 2]);
        return seen.size;
    }"""
    return page.evaluate(script, index) > 50


def axe(page: Page, script: pathlib.Path | None, what: str) -> None:
    if script is None:
        return
    page.evaluate(script.read_text())
    found = page.evaluate("axe.run().then(({ violations }) => violations.map(({ id, nodes }) => [id, nodes[0].html]))")
    assert not found, f"{what}: {found}"


def bring(page: Page, mesh: str, planners: list[str], around: bool = False) -> None:
    page.set_input_files("input[type=file]", mesh)
    if around:
        page.check("[name=around]")
    page.click("#mesh button[type=submit]")
    expect(page.locator("#brought")).to_be_visible(timeout=LONGEST_MS)
    assert page.locator("#picture").evaluate("it => it.naturalWidth") > 300
    for box in page.locator("[name=with]").all():
        box.set_checked(box.get_attribute("value") in planners)
    page.click("#start")
    expect(page.locator("#explorer")).to_be_visible(timeout=LONGEST_MS)


def fits(page: Page) -> None:
    """Checks that nothing is wider than a phone, in one column, and that a finger hits each control."""
    wide = page.evaluate("document.documentElement.scrollWidth - innerWidth")
    assert wide <= 0, f"the page is {wide} pixels too wide"
    scrolled = page.evaluate("[...document.querySelectorAll('body *')].filter(it => it.scrollWidth > it.clientWidth + 1 && getComputedStyle(it).overflowX !== 'visible' && it.clientWidth).map(it => it.outerHTML.slice(0, 80))")
    assert not scrolled, f"scroll sideways: {scrolled}"
    lefts = page.evaluate("new Set([...document.querySelectorAll('#panels figure')].map(it => Math.round(it.getBoundingClientRect().left))).size")
    assert lefts <= 1, f"{lefts} columns"
    low = page.evaluate("[...document.querySelectorAll('button, select, input[type=number]')].filter(it => it.checkVisibility() && it.getBoundingClientRect().height < 39.5).map(it => it.outerHTML.slice(0, 80))")
    assert not low, f"lower than 40 pixels: {low}"


def choose(page: Page, index: int) -> None:
    """Clicks a little beside the middle of a canvas."""
    box = page.locator("#panels canvas").nth(index).bounding_box()
    page.mouse.click(box["x"] + 0.45 * box["width"], box["y"] + 0.42 * box["height"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("mesh")
    parser.add_argument("--axe", type=pathlib.Path)
    parser.add_argument("--pictures", type=pathlib.Path)
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    args = parser.parse_args()
    mesh = str(pathlib.Path(args.mesh).resolve())

    def picture(page: Page, name: str) -> None:
        if args.pictures:
            args.pictures.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=args.pictures / f"{name}.png", full_page=True)

    with sync_playwright() as playwright, Live(args.program) as live:
        browser = playwright.chromium.launch(executable_path=args.chromium, args=["--no-sandbox"])
        errors = []
        # Once under the page's own policy of contents, which forbids what the driver does.
        page = browser.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text))
        page.goto(live.url)
        expect(page.locator("#bring")).to_be_visible()
        page.close()
        assert not errors, errors

        # The token is needed; a browser also takes it from a file and from a link of another site, and keeps it.
        with browser.new_context() as fresh, tempfile.NamedTemporaryFile("w", suffix=".html") as entry:
            page = fresh.new_page()
            bare = live.url.split("?")[0]
            assert page.goto(bare).status == 403
            assert "open the address" in page.inner_text("body")
            entry.write(f'<meta http-equiv="refresh" content="0;url={live.url}">')
            entry.flush()
            page.goto(f"file://{entry.name}")
            expect(page.locator("#bring")).to_be_visible(timeout=LONGEST_MS)
            assert page.url == bare, page.url
        with browser.new_context() as fresh:
            page = fresh.new_page()
            page.set_content(f'<a href="{live.url}">live</a>')
            page.click("a")
            expect(page.locator("#bring")).to_be_visible(timeout=LONGEST_MS)
        print("token")
        context = browser.new_context(viewport={"width": 1200, "height": 900}, bypass_csp=True)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(live.url)
        axe(page, args.axe, "choice of a mesh")
        picture(page, "1-bring")

        # A file that is no mesh is refused, and nothing is lost.
        page.set_input_files("input[type=file]", {"name": "no.stl", "mimeType": "model/stl", "buffer": b"no mesh"})
        page.click("#mesh button[type=submit]")
        page.wait_for_function("document.querySelector('#alert').textContent.includes('no.stl')", timeout=LONGEST_MS)

        bring(page, mesh, ["human", "active"])
        print("brought")
        wait(page, "your turn")
        picture(page, "2-turn")
        before = touches(page, "human")
        mine = 1 if "human" in page.locator("#panels figure").nth(1).inner_text() else 0
        when(lambda: is_drawn(page, mine), "the belief is not drawn")
        # A person sees neither true errors nor the surfaces of the other planners.
        assert not is_drawn(page, 1 - mine)
        assert page.evaluate("told.planners.every(it => it.errors.length === 0)")
        assert "RMSE" not in page.inner_text("#panels")
        choose(page, mine)
        numbers = [float(it.input_value()) for it in page.locator("#numbers input").all()]
        page.click("#target button[type=submit]")
        when(lambda: touches(page, "human") == before + 1, "the chosen touch was not made")
        assert all(abs(number) < 1000 for number in numbers), numbers
        print("chose a target by a click")

        # Two tabs show the same, and either steers.
        other = context.new_page()
        other.goto(live.url)
        wait(other, "your turn")
        other.click("[data-order=hold]")
        page.wait_for_function("told?.is_held", timeout=LONGEST_MS)
        other.close()
        print("two tabs")

        # A reload in the middle loses nothing.
        page.reload()
        wait(page, "your turn")
        assert touches(page, "human") == before + 1
        when(lambda: is_drawn(page, mine), "the belief is not drawn after a reload")
        print("reloaded")

        # By keyboard alone.
        page.locator("#numbers input").first.focus()
        page.keyboard.press("Tab")
        focused = page.evaluate("document.activeElement.form?.id")
        assert focused == "target", focused
        page.locator("#numbers input").first.focus()
        page.keyboard.press("ArrowUp")
        page.keyboard.press("Enter")
        when(lambda: touches(page, "human") == before + 2, "Enter makes no touch")
        print("keyboard")
        axe(page, args.axe, "running")

        # The legend names what is drawn, and the numbers are below the experiment.
        legend = page.locator(".legend").inner_text()
        for words in ["initial touch", "no contact", "next target", "out of the finger"]:
            assert words in legend, f"{words} is not in {legend}"
        for words in ["approach of the last touch", "95 % band"]:
            assert words not in legend, f"{words} is in {legend}"
        assert page.locator("#numbers input").first.evaluate("it => getComputedStyle(it).opacity") == "1"
        below = page.locator("#exact").bounding_box()["y"]
        for part in ["#panels", "#target", ".time", ".legend"]:
            box = page.locator(part).bounding_box()
            assert box["y"] + box["height"] <= below, f"{part} is below the numbers"

        # On a phone, and on dark paper.
        page.set_viewport_size({"width": 380, "height": 740})
        time.sleep(0.3)
        fits(page)
        picture(page, "3-phone")
        page.emulate_media(color_scheme="dark")
        time.sleep(0.3)
        picture(page, "4-dark")
        axe(page, args.axe, "dark")
        page.set_viewport_size({"width": 1200, "height": 900})
        print("phone and dark")

        page.click("[data-order=stop]")
        page.wait_for_function("told?.phase === 'ended'", timeout=LONGEST_MS)
        assert not errors, errors

        # All around, planners alone: held, stepped, gone on.
        bring(page, mesh, ["active", "random"], around=True)
        page.wait_for_function("told?.is_around && told.planners.length === 2", timeout=LONGEST_MS)
        page.click("[data-order=hold]")
        page.wait_for_function("told?.planners.every(it => it.status === 'held')", timeout=LONGEST_MS)
        made = touches(page, "active")
        page.click("[data-order=step]")
        when(lambda: touches(page, "active") == made + 1, "one touch is not one touch")
        page.wait_for_function("told?.planners.every(it => it.status === 'held')", timeout=LONGEST_MS)
        assert touches(page, "active") == made + 1
        assert "approach of the last touch" in page.locator(".legend").inner_text()
        picture(page, "5-around")
        choose(page, 0)
        page.click("#target button[type=submit]")
        when(lambda: touches(page, "active") == made + 2, "a target in place of the planner's is not touched")
        page.click("[data-order=stop]")
        page.wait_for_function("told?.phase === 'ended'", timeout=LONGEST_MS)
        assert not errors, errors
        print("all around")

        # A finished run of several trials: each is seen, and the belief is that of its touches.
        with tempfile.TemporaryDirectory() as folder:
            program = str(pathlib.Path(args.program).resolve())
            run = [program, "--quiet", "run", "container", "--no-report", "--out", "run", "--set", "trials=2", "--set", "touches=12"]
            subprocess.run(run, cwd=folder, check=True, stdout=subprocess.DEVNULL)
            with Live(args.program, f"{folder}/run") as replay:
                page.goto(replay.url)
                expect(page.locator("#panels canvas").first).to_be_visible(timeout=LONGEST_MS)
                when(lambda: is_drawn(page, 0), "the belief of a replay is not drawn")
                other = 1 - page.evaluate("told.trial")
                contacts = page.evaluate("JSON.stringify(data.planners[0].contacts)")
                page.fill("#trial", str(other))
                page.keyboard.press("Enter")
                page.wait_for_function("other => told?.trial === other", arg=other, timeout=LONGEST_MS)
                when(lambda: page.evaluate("JSON.stringify(data.planners[0].contacts)") != contacts, "the same belief is drawn")
                axe(page, args.axe, "replay")
                picture(page, "6-replay")
        assert not errors, errors
        print("another trial of a finished run")
        browser.close()
    print("ok")


if __name__ == "__main__":
    sys.exit(main())
