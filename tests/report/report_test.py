"""Opens reports in a headless browser, presses keys and looks at what changes. Usage: report_test.py WRITE_REPORTS"""
import glob
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

HELP = "scripts/install-dependencies.sh tests installs what is missing (Debian: chromium chromium-driver python3-selenium)"
try:
    from selenium import webdriver
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.chrome.service import Service
except ImportError:
    sys.exit(f"report_test: Selenium for {sys.executable} is not there; {HELP}")
for program in ("chromium", "chromedriver"):
    if not shutil.which(program):
        sys.exit(f"report_test: the program {program} is not there; {HELP}")

# As tests/report/report_fixtures.h makes them.
WIDTH, HEIGHT = 160, 90
REFERENCE, DARK, SAME, RED = (0.2, 0.4, 0.1), (0.1, 0.2, 0.05), (0.2, 0.4, 0.1), (0.8, 0.1, 0.1)
SQUARE = (120, 32)  # a pixel of the white square
PLAIN = (40, 60)


def encoded(linear, gain=1):
    """8-bit sRGB of a linear colour."""
    def channel(v):
        v = min(1, v * gain)
        return round(255 * (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055))
    return tuple(channel(v) for v in linear)


def check(condition, message):
    if not condition:
        raise AssertionError(message)


class Page:
    """One report, open in the browser."""

    def __init__(self, browser, file):
        self.browser = browser
        browser.get_log("performance")
        browser.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": 2, "y": 2})  # over nothing
        browser.get(file.as_uri())
        self.until(lambda: self.text("shown"), "nothing was announced")

    def run(self, script, *arguments):
        return self.browser.execute_script(script, *arguments)

    def until(self, holds, message, seconds=20):
        end = time.time() + seconds
        while not holds():
            if time.time() > end:
                raise AssertionError(message() if callable(message) else message)
            time.sleep(0.02)

    def rest(self):
        """No control has the focus."""
        self.run("document.activeElement.blur()")

    def element(self, name):
        return self.browser.find_element(By.ID, name)

    def text(self, name):
        return self.run("return document.getElementById(arguments[0]).textContent", name)

    def press(self, *keys):
        ActionChains(self.browser).send_keys(*keys).perform()

    def says(self, *words):
        self.until(lambda: all(word in self.text("shown") for word in words),
                   lambda: f"{words} are not in what is announced: {self.text('shown')}")

    def color(self, x, y, pane=(0, 0, 1, 1)):
        """Of the canvas where pixel (x, y) of a picture that is shown as a whole lies; pane: left, top, width, height."""
        return tuple(self.run("""
            const [x, y, pane] = arguments, canvas = document.getElementById('canvas');
            const px = canvas.width * (pane[0] + pane[2] * x), py = canvas.height * (pane[1] + pane[3] * y);
            return [...canvas.getContext('2d').getImageData(Math.floor(px), Math.floor(py), 1, 1).data].slice(0, 3);
            """, (x + 0.5) / WIDTH, (y + 0.5) / HEIGHT, pane))

    def shows(self, wanted, what, at=PLAIN, tolerance=4):
        self.until(lambda: max(abs(a - b) for a, b in zip(self.color(*at), wanted)) <= tolerance,
                   lambda: f"{what}: the pixel is {self.color(*at)}, not {wanted}")

    def zoom(self):
        return int(self.text("zoom-text").split()[0])


def tables_sort(page):
    def column(name):
        return [row.text for row in page.browser.find_elements(By.CSS_SELECTOR, f"#summary-time-0 tbody tr > :nth-child({name})")]

    def heading(label):
        return next(th for th in page.browser.find_elements(By.CSS_SELECTOR, "#summary-time-0 thead th") if th.text.startswith(label))

    names = lambda: [text.split("\n")[0] for text in column(2)]
    check(names() == ["same", "dark", "red"], f"the best comes first, not {names()}")
    rmse = heading("RMSE").find_element(By.TAG_NAME, "button")
    for order, wanted in (("ascending", ["same", "dark", "red"]), ("descending", ["red", "dark", "same"])):
        rmse.send_keys(Keys.ENTER)
        check(heading("RMSE").get_attribute("aria-sort") == order, f"aria-sort is not {order}")
        check(names() == wanted, f"sorted {order}: {names()}")
    heading("SSIM").find_element(By.TAG_NAME, "button").click()
    check(heading("SSIM").get_attribute("aria-sort") == "descending", "the best SSIM is the largest")
    check(heading("RMSE").get_attribute("aria-sort") == "none", "only one column is sorted by")
    heading("method").find_element(By.TAG_NAME, "button").click()
    check(names() == ["dark", "red", "same"], f"by name: {names()}")


def keys_flip(page):
    page.press("1")
    page.says("dark", "equal time", "image")
    page.shows(encoded(DARK), "key 1")
    page.press("3")
    page.says("red")
    page.shows(encoded(RED), "key 3")
    for key in ("0", "r", "R"):
        page.press("3")
        page.press(key)
        page.says("reference")
        page.shows(encoded(REFERENCE), f"key {key}")
    page.press(Keys.ARROW_RIGHT)
    page.shows(encoded(DARK), "right arrow")
    page.press(Keys.ARROW_LEFT, Keys.ARROW_LEFT)
    page.shows(encoded(RED), "left arrow goes around")
    page.shows((255, 255, 255), "light above white", at=SQUARE)
    pressed = [b.text for b in page.browser.find_elements(By.CSS_SELECTOR, "#names button[aria-pressed=true]")]
    check(len(pressed) == 1 and "red" in pressed[0], f"pressed: {pressed}")
    page.press("b")
    page.says("equal samples")
    page.shows(encoded(RED, 0.8), "key b")
    page.press("b")
    page.shows(encoded(RED), "key b again")
    # Names show their picture while the pointer is over them.
    button = page.browser.find_elements(By.CSS_SELECTOR, "#names button")[1]
    page.run("arguments[0].scrollIntoView({block: 'center'})", button)
    ActionChains(page.browser).move_to_element(button).perform()
    page.shows(encoded(DARK), "pointer over a name")
    ActionChains(page.browser).move_to_element(page.element("viewer-heading")).perform()
    page.shows(encoded(RED), "pointer gone")


def keys_change_light(page):
    page.press("1")
    page.shows(encoded(DARK), "before the exposure")
    page.press("ee")
    page.says("exposure +1 EV")
    page.shows(encoded(DARK, 2), "one stop up")
    page.press("EEEE")
    page.says("exposure \u22121 EV")
    page.shows(encoded(DARK, 0.5), "one stop down")
    page.press("ee")
    page.shows(encoded(DARK), "back")
    slider = page.element("exposure")
    slider.send_keys(Keys.ARROW_RIGHT)
    page.says("exposure +0.5 EV", "dark")
    slider.send_keys(Keys.ARROW_LEFT)
    page.says("exposure 0 EV")


def keys_change_mode(page):
    page.press("1", "m")
    page.says("signed difference")
    # (Y - Yr) / (Y + Yr) = -1/3 is a third of the way from white to blue.
    page.shows(tuple(round(255 * (2 + c) / 3) for c in (0.02, 0.19, 0.70)), "signed difference")
    page.press("2")
    page.shows((255, 255, 255), "no difference")
    page.press("1", "m")
    page.says("absolute difference")
    page.shows(encoded(tuple(r - d for r, d in zip(REFERENCE, DARK))), "absolute difference")
    page.press("m")
    page.says("FLIP map")
    page.until(lambda: sum(page.color(*PLAIN)) > 60, "an error is not black in a FLIP map")
    page.press("2")
    page.until(lambda: sum(page.color(*PLAIN)) < 20, "no error is black in a FLIP map")
    page.press("m")
    page.says("bias map")
    page.press("1")
    page.until(lambda: page.color(*PLAIN)[2] > page.color(*PLAIN)[0] + 60, "darker than the reference is blue")
    page.press("2")
    page.shows((150, 150, 150), "what is no bias")
    check(page.run("return document.getElementById('scale').offsetHeight > 0"), "a colour scale is shown")
    page.press("m", "1")
    page.says("image")
    check(page.run("return document.getElementById('scale').offsetHeight === 0"), "an image has no colour scale")


def keys_zoom(page):
    page.press("3", "f")
    fit = page.zoom()
    page.press("+")
    page.until(lambda: abs(page.zoom() - fit * 1.414) < 3, lambda: f"zoom {page.zoom()} after {fit}")
    page.press("-", "-")
    page.until(lambda: abs(page.zoom() - fit / 1.414) < 3, lambda: f"zoom {page.zoom()} after {fit}")
    page.press("z")
    page.until(lambda: page.zoom() == 100, "key z is 1:1")
    page.press("f", *"++++++")
    page.until(lambda: page.zoom() > 7 * fit, "six steps are a factor of eight")
    # The square lies right of the centre and above it.
    centre = (WIDTH / 2, HEIGHT / 2)
    page.shows(encoded(RED), "the middle", at=centre)
    ActionChains(page.browser).key_down(Keys.SHIFT).send_keys(*([Keys.ARROW_RIGHT] * 40 + [Keys.ARROW_UP] * 13)).key_up(Keys.SHIFT).perform()
    page.until(lambda: any(page.color(x, y) == (255, 255, 255) for x in range(10, 160, 20) for y in range(10, 90, 10)), "moved to the square")
    page.press("f")
    page.until(lambda: page.zoom() == fit, "key f is the whole picture")
    # The wheel belongs to the page until the picture has the focus.
    screen = page.element("screen")
    page.run("document.activeElement.blur(); arguments[0].scrollIntoView({block: 'center'})", screen)
    wheel = """const [target, y] = arguments, box = target.getBoundingClientRect();
        return target.dispatchEvent(new WheelEvent('wheel', { deltaY: y, clientX: box.left + 50, clientY: box.top + 50,
                                                              bubbles: true, cancelable: true }));"""
    check(page.run(wheel, screen, -120), "the page may scroll")
    page.run("arguments[0].focus()", screen)
    check(not page.run(wheel, screen, -120), "the wheel zooms")
    page.until(lambda: page.zoom() > fit, "the wheel zooms in")
    before = page.run("return document.getElementById('canvas').toDataURL()")
    ActionChains(page.browser).move_to_element(screen).click_and_hold().move_by_offset(60, 40).release().perform()
    page.until(lambda: page.run("return document.getElementById('canvas').toDataURL()") != before, "dragging moves")
    page.press("f")


def slider_divides(page):
    page.press("3", "s")
    page.says("reference left of red")
    page.shows(encoded(REFERENCE), "left of the divider", at=(40, 60))
    page.shows(encoded(RED), "right of the divider", at=(120, 60))
    divider = page.element("divider")
    check(divider.get_attribute("aria-valuenow") == "50", "the divider starts in the middle")
    divider.send_keys(*[Keys.PAGE_DOWN] * 4)
    page.until(lambda: divider.get_attribute("aria-valuenow") == "10", "page down moves the divider")
    page.shows(encoded(RED), "right of the moved divider", at=(40, 60))
    divider.send_keys(Keys.ARROW_RIGHT)
    page.until(lambda: divider.get_attribute("aria-valuenow") == "11", "an arrow moves the divider")
    divider.send_keys(Keys.END)
    page.shows(encoded(REFERENCE), "the divider at its end", at=(150, 80))
    divider.send_keys(Keys.HOME)
    page.shows(encoded(RED), "the divider at its start", at=(20, 80))
    width = page.run("return document.getElementById('screen').clientWidth")
    page.run("arguments[0].scrollIntoView({block: 'center'})", divider)
    ActionChains(page.browser).move_to_element_with_offset(divider, 8, 0).click_and_hold().move_by_offset(round(width / 2), 0).release().perform()
    page.until(lambda: 40 <= int(divider.get_attribute("aria-valuenow")) <= 60, "dragging moves the divider")
    page.press("v")
    page.shows(encoded(RED), "one picture again", at=(40, 60))


def grid_shows_all(page):
    page.press("g")
    page.says("all pictures")
    for i, wanted in enumerate((REFERENCE, DARK, SAME, RED)):  # two columns of two
        pane = (0.5 * (i % 2), 0.5 * (i // 2), 0.5, 0.5)
        page.until(lambda: max(abs(a - b) for a, b in zip(page.color(*PLAIN, pane), encoded(wanted))) <= 4,
                   lambda: f"pane {i}: {page.color(*PLAIN, pane)}, not {encoded(wanted)}")
    page.press("v")


def values_follow_cursor(page):
    page.press("1")
    rows = lambda: page.run("return [...document.querySelectorAll('#values tbody tr')].map(r => [...r.cells].map(c => c.textContent))")
    page.press("j")
    page.until(lambda: len(rows()) == 4, "a row for the reference and each method")
    place = lambda: tuple(int(part) for part in page.text("values-caption").split("(")[1].split(")")[0].split(","))
    x, y = place()
    for row, wanted in zip(rows(), (REFERENCE, DARK, SAME, RED)):
        for text, value in zip(row[1:4], wanted):
            check(abs(float(text) - value) < 0.04 * value + 0.002, f"{row} is not {wanted}")
    page.press("l", "L", "I", "k")
    page.until(lambda: place() == (x + 11, y - 9), lambda: f"from {(x, y)} to {place()}")
    page.press(*"LLLLLLLLLLLLLLLLIIIIIIIII", *"J" * 4, *"kkk" * 10)  # the corner on the top right, then inside the square
    page.until(lambda: place() == (119, 30), lambda: f"{place()}")
    page.until(lambda: abs(float(rows()[0][1]) - 2) < 0.1, lambda: f"the square is 2: {rows()}")
    canvas = page.element("canvas")
    page.run("arguments[0].scrollIntoView({block: 'center'})", canvas)
    ActionChains(page.browser).move_to_element_with_offset(canvas, 50, 50).move_to_element(canvas).perform()
    page.until(lambda: any(f"({x}, {y})" in page.text("values-caption") for x in (79, 80) for y in (44, 45)), "the pointer is in the middle")


def keys_leave_controls_alone(page):
    page.press("1")
    page.says("dark")
    page.element("mode").send_keys("f")  # chooses "FLIP map" in the list
    page.says("FLIP map")
    page.element("mode").send_keys(Keys.HOME)
    page.says("image", "dark")
    page.run("document.activeElement.blur()")
    page.press("?")
    page.until(lambda: page.run("return document.getElementById('keys-dialog').open"), "? opens the help")
    page.press("3")
    page.press(Keys.ESCAPE)
    page.until(lambda: not page.run("return document.getElementById('keys-dialog').open"), "Esc closes the help")
    page.says("dark")
    box = page.element("keys")
    page.run("arguments[0].click()", box)
    page.press("3")
    time.sleep(0.2)
    page.says("dark")
    page.run("arguments[0].click()", box)
    page.press("3")
    page.says("red")


def crops_lead_to_the_viewer(page):
    crops = page.browser.find_elements(By.CSS_SELECTOR, "button.crop")
    check(len(crops) >= 8 and len(crops) % 4 == 0, f"{len(crops)} crops")
    mean = page.run("""const c = arguments[0].querySelector('canvas');
        return [...c.getContext('2d').getImageData(0, 0, 1, 1).data].slice(0, 3)""", crops[3])
    check(max(abs(a - b) for a, b in zip(mean, encoded(RED))) <= 4, f"the crop of red is {mean}")
    crops[1].send_keys(Keys.ENTER)
    page.says("dark")
    page.until(lambda: page.zoom() > 100, "a crop is shown large")
    check(page.run("return document.activeElement.id") == "screen", "the viewer has the focus")
    page.press("f")


def lines_are_highlighted(page):
    button = page.browser.find_elements(By.CSS_SELECTOR, "figure.curves [data-line]")[1]
    page.run("arguments[0].focus()", button)
    on = page.run("return [...document.querySelectorAll('figure.curves .series.on')].map(s => s.dataset.series)")
    check(set(on) == {"same"} and len(on) == 4, f"highlighted: {on}")
    visible = lambda: page.run("return [...document.querySelectorAll('figure.curves svg.plot')].filter(s => s.checkVisibility()).map(s => s.querySelector('title')?.textContent).filter(Boolean)")
    check(visible() == ["RMSE against time", "RMSE against samples"], f"{visible()}")
    page.run("[...document.querySelectorAll('[data-choose]')].find(b => b.textContent === 'relMSE').click()")
    check(visible() == ["relMSE against time", "relMSE against samples"], f"{visible()}")


def everything_is_named_and_reached(page):
    nameless = page.run("""
        const named = e => e.getAttribute('aria-label') || e.getAttribute('aria-labelledby') || e.title || e.textContent.trim() ||
                           (e.labels && e.labels.length) || e.getAttribute('aria-hidden') === 'true';
        return [...document.querySelectorAll('button, input, select, canvas, img, svg, [role], summary')].filter(e => !named(e))
          .map(e => e.outerHTML.slice(0, 80));""")
    check(nameless == [], f"without a name: {nameless}")
    wanted = page.run("""
        const list = [...document.querySelectorAll('button, input, select, summary, [tabindex="0"]')].filter(e => e.checkVisibility());
        list.forEach((e, i) => { e.dataset.stop = i; });
        list[0].focus();
        return list.length;""")
    page.press(*[Keys.TAB] * (wanted - 1))
    reached = page.run("return document.activeElement.dataset.stop")
    check(reached == str(wanted - 1), f"tabs reach control {reached} and not the last of {wanted}, in the order of the page")
    check(page.run("return getComputedStyle(document.activeElement).outlineStyle") != "none", "the focus can be seen")


def schemes_have_contrast(page):
    ratios = """
        const value = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
        const light = hex => { const c = [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16) / 255)
            .map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4); return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; };
        const ratio = (a, b) => { const [x, y] = [light(value(a)), light(value(b))].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05); };
        const pairs = [['--ink', '--ground'], ['--soft', '--ground'], ['--soft', '--raised'], ['--accent', '--ground'],
          ['--accent-ink', '--accent'], ['--best-ink', '--best'], ['--ink', '--warn'], ['--plot-soft', '--plot-ground'],
          ...Array.from({ length: 10 }, (_, i) => ['--line-' + i, '--plot-ground'])];
        return pairs.map(([a, b]) => [a + ' on ' + b, ratio(a, b)]);"""
    grounds = []
    for scheme in ("light", "dark"):
        page.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
        grounds.append(page.run("return getComputedStyle(document.body).backgroundColor"))
        for pair, ratio in page.run(ratios):
            check(ratio >= 4.5, f"{scheme}: contrast of {pair} is {ratio:.2f}")
    check(grounds[0] != grounds[1], f"the page has the same ground in both schemes: {grounds}")
    page.element("theme").click()  # from auto to light
    check(page.run("return getComputedStyle(document.body).backgroundColor") == grounds[0], "the button overrides the system")
    page.run("delete document.documentElement.dataset.theme")
    page.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def no_horizontal_scroll(page):
    for width in (1280, 800):
        page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False})
        wide = page.run("return document.documentElement.scrollWidth - document.documentElement.clientWidth")
        check(wide <= 0, f"at {width} pixels the page is {wide} too wide")
    page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 1280, "height": 900, "deviceScaleFactor": 1, "mobile": False})


def frames_are_scrubbed(page):
    page.press("1")
    page.says("frame 10")
    page.shows(encoded(DARK), "first frame")
    page.press(".")
    page.says("frame 11")
    page.shows(encoded(DARK, 1.1), "second frame")
    page.press(",", ",")
    page.says("frame 12")
    page.shows(encoded(DARK, 1.2), "the frame before the first is the last")
    page.element("frame").send_keys(Keys.HOME)
    page.says("frame 10")
    page.press("p")
    page.until(lambda: page.text("frame-text") != "10", "playing moves on")
    check(page.text("play") == "Pause" and page.element("shown").get_attribute("aria-live") == "off", "playing says nothing")
    page.press("p")
    page.until(lambda: page.text("play") == "Play", "p pauses")
    titles = page.run("return [...document.querySelectorAll('svg title')].map(t => t.textContent)")
    for value in ("RMSE", "temporal error", "flicker"):
        check(f"{value} by frame at equal time" in titles, f"{value} by frame is not among {titles}")
    headings = page.run("return [...document.querySelectorAll('#summary-time-0 th[scope=col]')].map(t => t.textContent)")
    check("temporal error" in headings and "flicker" in headings, f"{headings}")


def parts_that_are_missing_are_named(page):
    page.press("1")
    page.says("dark")
    page.shows(encoded(DARK), "what is there")
    page.press("b")
    page.says("dark-0-0-samples.exr is missing")
    page.press("b", "3")
    page.says("it needs a light that the scene does not have")
    page.press("1", "m", "m", "m", "m")
    page.says("at least two seeds")
    message = page.run("return document.querySelector('#summary-time-0 td.message').textContent")
    check(message, "the table says why a row is empty")


def open_browser(folder):
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
                 "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--window-size=1280,900",
                 "--force-device-scale-factor=1", f"--user-data-dir={folder}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    browser = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 1280, "height": 900, "deviceScaleFactor": 1, "mobile": False})
    return browser


def requests_of(browser):
    urls = []
    for entry in browser.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            urls.append(message["params"]["request"]["url"])
    return [url for url in urls if not url.startswith(("data:", "blob:"))]


CHECKS = {
    "still": [tables_sort, keys_flip, keys_change_light, keys_change_mode, keys_zoom, slider_divides, grid_shows_all, values_follow_cursor,
              keys_leave_controls_alone, crops_lead_to_the_viewer, lines_are_highlighted, schemes_have_contrast, no_horizontal_scroll,
              everything_is_named_and_reached],
    "sequence": [frames_are_scrubbed, everything_is_named_and_reached],
    "partial": [parts_that_are_missing_are_named, everything_is_named_and_reached],
}


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    failed = 0
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        folder = pathlib.Path(folder)
        subprocess.run([sys.argv[1], folder / "reports"], check=True)
        browser = open_browser(folder / "profile")
        try:
            for name, checks in CHECKS.items():
                file = folder / "reports" / name / "report.html"
                page = Page(browser, file)
                for one in checks:
                    start = time.time()
                    try:
                        page.rest()
                        one(page)
                        print(f"{name}: {one.__name__} ({time.time() - start:.1f} s)")
                    except Exception as error:  # the other checks may still tell something
                        failed += 1
                        print(f"{name}: {one.__name__} FAILED: {type(error).__name__}: {error}")
                check(file.stat().st_size < 1_000_000, f"{name}: the report has {file.stat().st_size} bytes")
                errors = [entry["message"] for entry in browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
                check(errors == [], f"{name}: the console says {errors}")
                requests = requests_of(browser)
                check(requests == [file.as_uri()], f"{name}: more was loaded than the page: {requests}")
        finally:
            browser.quit()
    sys.exit(1 if failed else 0)


main()
