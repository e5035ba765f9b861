"""Opens reports in a headless browser without network and checks what a person would see.

Usage: browser_check.py REPORT.html...
    SCREENSHOTS=FOLDER    keeps the pictures
    CHROMIUM=PATH         names the browser
    TRIED="NAME NAME"     of the reports in folders of these names alone every control is tried; of the others how they open
Exit code 1 when a check fails. Installs nothing: ci/setup.sh does.
"""

import base64
import io
import json
import os
import pathlib
import shutil
import sys

from PIL import Image, ImageChops
from playwright.sync_api import Error, sync_playwright

FLAGS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--no-first-run",
]


TRIED = os.environ["TRIED"].split() if "TRIED" in os.environ else None


class Failures(list):
    def expect(self, holds, what):
        if not holds:
            self.append(what)


def screenshot(locator):
    return Image.open(io.BytesIO(locator.screenshot(timeout=120_000))).convert("RGB")


def picture(canvas):
    """What the canvas holds, upside down. A screenshot shows the same, and has everything drawn once more."""
    width, height, pixels = canvas.evaluate(
        """c => { const gl = c.getContext('webgl2'), p = new Uint8Array(4 * c.width * c.height);
             gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
             let text = '';
             for (let i = 0; i < p.length; i += 32768) text += String.fromCharCode(...p.subarray(i, i + 32768));
             return [c.width, c.height, btoa(text)]; }"""
    )
    return Image.frombytes("RGBA", (width, height), base64.b64decode(pixels)).convert("RGB")


def difference(a, b):
    """Share of pixels that differ visibly."""
    if a.size != b.size:
        return 1.0
    grey = ImageChops.difference(a, b).convert("L")
    return sum(grey.histogram()[12:]) / (a.size[0] * a.size[1])


def wait_for_view(page):
    """Until the view is ready, or says why there is none."""
    page.locator("body[data-view=ready], #view-message:text-matches('could not|shows no 3D|too old')").first.wait_for(
        state="attached", timeout=60_000
    )
    if page.locator("body[data-view=ready]").count() == 0:
        raise Error(page.locator("#view-message").inner_text())


def settle(page):
    """Waits until the next frames are drawn."""
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30))))")


def check_view(page, failures):
    wait_for_view(page)
    settle(page)
    canvas = page.locator("#canvas")
    for what, image in (("view", screenshot(canvas)), ("canvas", whole := picture(canvas))):
        failures.expect(len(image.resize((96, 64)).getcolors(96 * 64)) > 40, f"the 3D {what} is blank: hardly any colours")
    error = canvas.evaluate("c => c.getContext('webgl2').getError()")
    failures.expect(error == 0, f"WebGL reports error {error}")

    layer = page.locator("#layer")
    if page.locator("#layer-controls").is_visible():
        last = int(layer.get_attribute("max"))
        label = page.locator("#layer-label")
        failures.expect(label.inner_text() == f"{last} of {last}", f"the layer label says {label.inner_text()!r}")
        layer.fill("1")
        settle(page)
        first = picture(canvas)
        failures.expect(label.inner_text() == f"1 of {last}", f"the layer label says {label.inner_text()!r} at layer 1")
        failures.expect(difference(whole, first) > 0.002, "the layer slider does not change the picture")
        layer.fill(str(last))
        page.locator("[name=layer-mode][value=only]").check()
        settle(page)
        failures.expect(difference(whole, picture(canvas)) > 0.002, "“only it” does not change the picture")
        page.locator("[name=layer-mode][value=upto]").check()
        settle(page)
        failures.expect(difference(whole, picture(canvas)) < 0.002, "the picture does not come back")

    boxes = page.locator("#items input[type=checkbox]")
    shown = [boxes.nth(i).is_checked() for i in range(boxes.count())]
    surfaces = page.locator("#items > div:has(button) input")
    for select, ramp in (("#surface-scalar", "#surface-ramp"), ("#line-scalar", "#line-ramp")):
        box = page.locator(select)
        if not box.is_visible() or box.locator("option").count() < 2:
            continue
        if select == "#line-scalar":
            # metal hides the paths inside it
            for i in range(surfaces.count()):
                surfaces.nth(i).uncheck()
            settle(page)
        before, words = picture(canvas), page.locator(ramp).inner_text()
        changed = 0.0
        for index in range(1, box.locator("option").count()):
            box.select_option(index=index)
            settle(page)
            changed = max(changed, difference(before, picture(canvas)))
            failures.expect(page.locator(ramp).inner_text() != words, f"{select}: the legend does not follow")
        failures.expect(changed > 0.001, f"{select} does not change the picture")
        box.select_option(index=0)
    for i, on in enumerate(shown):
        boxes.nth(i).set_checked(on)
    settle(page)
    failures.expect(difference(whole, picture(canvas)) < 0.002, "the picture does not come back after colouring")

    before = picture(canvas)
    page.locator("[data-view=top]").click()
    settle(page)
    failures.expect(difference(before, picture(canvas)) > 0.01, "the top view does not change the picture")
    page.locator("[data-view=oblique]").click()
    canvas.focus()
    page.keyboard.press("ArrowLeft")
    settle(page)
    failures.expect(difference(before, picture(canvas)) > 0.002, "the arrow keys do not turn the view")
    page.locator("[data-view=oblique]").click()
    page.locator("#section-axis").select_option("0")
    settle(page)
    failures.expect(difference(before, picture(canvas)) > 0.002, "the cut does not change the picture")
    page.locator("#section-axis").select_option("")
    settle(page)
    check_film(page, failures)
    check_places(page, failures)


def check_film(page, failures):
    """The film of the machine: the slider moves it, and the metal with it; the cell can be looked at as a whole."""
    if not page.locator("#film-controls").is_visible():
        return
    canvas, slider = page.locator("#canvas"), page.locator("#film")
    whole = picture(canvas)
    slider.fill("500")
    settle(page)
    failures.expect(page.locator("#machine-shown").is_checked(), "the film shows no machine")
    middle = picture(canvas)
    failures.expect(difference(whole, middle) > 0.002, "the film does not change the picture")
    slider.fill("300")
    settle(page)
    failures.expect(difference(middle, picture(canvas)) > 0.0005, "the film stands still")
    before = picture(canvas)
    page.locator("[data-view=cell]").click()
    settle(page)
    failures.expect(difference(before, picture(canvas)) > 0.01, "“Cell” does not look at the cell")
    slider.fill("1000")
    page.locator("#machine-shown").uncheck()
    page.locator("[data-view=oblique]").click()
    settle(page)
    failures.expect(difference(whole, picture(canvas)) < 0.002, "the picture does not come back after the film")


def check_places(page, failures):
    """The first places that the verdict names are flown to: marked in the picture where they have a position."""
    canvas, pin = page.locator("#canvas"), page.locator("#pin")
    places = page.locator("button.fly")
    last = int(page.locator("#layer").get_attribute("max"))
    for i in range(min(places.count(), 2)):
        button = places.nth(i)
        before = picture(canvas)
        button.click()
        settle(page)
        words = button.inner_text()
        failures.expect(words in page.locator("#pin-name").inner_text(), f"the view does not name {words!r}")
        layer = button.get_attribute("data-layer")
        if layer and last > 1:
            shown = page.locator("#layer-label").inner_text()
            failures.expect(shown == f"{layer} of {last}", f"{words!r}: the view shows layer {shown}")
        if button.get_attribute("data-position"):
            # the spot is in the middle of the picture, at the nearer of the two scales
            box, stage = pin.bounding_box(), canvas.bounding_box()
            failures.expect(box is not None, f"{words!r} is not marked")
            if box:
                off = max(abs(box[a] + box[s] / 2 - stage[a] - stage[s] / 2) for a, s in (("x", "width"), ("y", "height")))
                failures.expect(off < 3, f"{words!r} is marked {off:.0f} pixels from the middle")
            if i == 0:
                failures.expect(difference(before, picture(canvas)) > 0.002, f"{words!r}: the picture does not change")
    if places.count():
        page.locator("[data-view=fit]").click()
        settle(page)
        failures.expect(not pin.is_visible(), "the mark stays after the view was fitted")
        page.locator("[data-view=oblique]").click()
        if page.locator("#layer-controls").is_visible():
            page.locator("#layer").fill(str(last))
        settle(page)


def check(browser, path, folder):
    failures = Failures()
    requests, messages = [], []
    try:
        open_and_look(browser, path, folder, failures, requests, messages)
    except Error as error:
        failures.append(f"the page does not get so far: {str(error).splitlines()[0]}")
    own = path.resolve().as_uri()
    # "blob:" is how the page unpacks its own data; it never leaves the page
    foreign = [r for r in requests if r != own and not r.startswith(("blob:", "data:"))]
    failures.expect(not foreign, f"the page asked for {foreign[:3]}")
    failures.expect(not messages, f"the console says {messages[:3]}")
    return failures


def open_and_look(browser, path, folder, failures, requests, messages):
    # without a graphics card each drawing takes seconds: half as many pixels a side where nobody looks at them
    scale = 1 if folder else 0.5
    for scheme, width in (("light", 1400), ("dark", 400)):
        context = browser.new_context(
            offline=True, color_scheme=scheme, viewport={"width": width, "height": 1000}, reduced_motion="reduce", device_scale_factor=scale
        )
        page = context.new_page()
        page.on("request", lambda r: requests.append(r.url))
        page.on("console", lambda m: messages.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda e: messages.append(str(e)))
        page.goto(path.resolve().as_uri())
        name = f"{path.resolve().parent.name}-{scheme}-{width}"
        words = page.locator("#verdict").inner_text().lower()
        failures.expect(
            any(s in words for s in ("pass", "warn", "fail", "cannot say", "not checked")),
            f"no verdict in words: {words!r}",
        )
        # a fit judges nothing: its report has figures alone
        judged = json.loads((path.parent / "verdict.json").read_text(encoding="utf-8"))["checks"]
        failures.expect(bool(judged) == (page.locator("table.checks tbody tr").count() > 0), "checks are not listed as the verdict has them")
        failures.expect("nan" not in page.locator("main").inner_text().lower().split(), "a NaN is shown")
        wide = page.evaluate("document.documentElement.scrollWidth - window.innerWidth")
        failures.expect(wide <= 0, f"at {width} px the page is {wide} px too wide")
        if page.locator("#view").count():
            if (scheme, width) == ("light", 1400) and (TRIED is None or path.resolve().parent.name in TRIED):
                check_view(page, failures)
            else:
                wait_for_view(page)
                settle(page)
        if folder:
            if page.locator("#view .stage").count():
                page.locator("#view .stage").screenshot(path=folder / f"{name}-view.png")
            page.screenshot(path=folder / f"{name}.png", full_page=True)
            if (scheme, width) == ("light", 1400):
                page.pdf(path=folder / f"{name}.pdf", format="A4", prefer_css_page_size=True)
        context.close()


def main(paths):
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    if not chromium or not paths:
        print(__doc__ if chromium else "no Chromium found: apt-get install chromium, or set CHROMIUM")
        return 2
    folder = os.environ.get("SCREENSHOTS")
    folder = pathlib.Path(folder) if folder else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    wrong = 0
    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=FLAGS)
        for path in map(pathlib.Path, paths):
            failures = check(browser, path, folder)
            print(f"{path}: {'ok' if not failures else 'FAILED'} ({path.stat().st_size / 1e6:.2f} MB)")
            for failure in failures:
                print(f"  {failure}")
            wrong += bool(failures)
        browser.close()
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
