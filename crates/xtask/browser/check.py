"""Opens pages in headless Chromium and tests what no parser can see.

    python check.py CHROMIUM PAGES OUT

PAGES holds `pages.json`, a list of {"file": .., "sections": [ids]}, and the files it names. Pictures of every page (wide and phone, light and dark)
and its print go to OUT. First the tests are tested: each has to find the fault of a page that has it (`faults.py`).
"""

import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import sync_playwright
from pypdfium2 import PdfDocument

from faults import FAULTS

WIDTHS_PX = (1280, 390)
SCHEMES = ("light", "dark")
LEAST_CONTRAST = 4.5  # WCAG 2.2, 1.4.3

# Text in a figure: axe reads `color` there, drawings have `fill`. The ground of a figure is that of the page.
FIGURE_TEXT = """least => {
  const channels = text => text.match(/[\\d.]+/g).slice(0, 3).map(c => c / 255)
      .map(c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  const luminance = text => { const [r, g, b] = channels(text); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const ground = luminance(getComputedStyle(document.body).backgroundColor);
  return [...document.querySelectorAll('svg text')].map(text => {
    const ink = luminance(getComputedStyle(text).fill);
    return [text.textContent, (Math.max(ink, ground) + 0.05) / (Math.min(ink, ground) + 0.05)];
  }).filter(([_, contrast]) => contrast < least).map(([text, contrast]) => `${text}: ${contrast.toFixed(2)}`);
}"""

NAMELESS = """() => [...document.querySelectorAll('svg')]
  .filter(svg => !svg.closest('[aria-hidden=true]') && !(svg.getAttribute('aria-label') || '').trim())
  .map(svg => svg.outerHTML.slice(0, 80))"""

# What a reader can mark by hand: all text that is shown.
UNMARKED = """() => {
  const marked = getSelection().toString().replace(/\\s+/g, '');
  return [...document.querySelectorAll('h1, h2, h3, p, td, th, li, dd, pre')]
    .filter(element => element.checkVisibility({visibilityProperty: true}))
    .filter(element => !marked.includes(element.innerText.replace(/\\s+/g, '')))
    .map(element => element.innerText.slice(0, 80));
}"""

# What stands beside a slider.
DRAWN = """slider => [...slider.closest('figure, section').querySelectorAll('svg, canvas')]
  .map(drawing => drawing.toDataURL ? drawing.toDataURL() : drawing.outerHTML).join()"""

HEADINGS = "() => [...document.querySelectorAll('h1, h2, h3, h4, h5, h6')].map(h => h.innerText.replace(/\\s+/g, ''))"


def opened(browser, file, width_px, scheme):
    """The page, and a list to which everything it complains about or asks for is added."""
    viewport = {"width": width_px, "height": 844}
    # Without motion of its own a page looks the same each time, and only the keys move its figures.
    context = browser.new_context(viewport=viewport, color_scheme=scheme, reduced_motion="reduce")
    page = context.new_page()
    found, address = [], file.resolve().as_uri()
    page.on("console", lambda message: found.append(f"console: {message.type}: {message.text}"))
    page.on("pageerror", lambda error: found.append(f"script: {error}"))
    page.on("request", lambda request: request.url == address or found.append(f"network: asks for {request.url}"))
    page.goto(address)
    return page, found


def of_every_view(page, found):
    """Faults that depend on width and colours; leaves the page without its drawings."""
    width_px, needed_px = page.evaluate("[innerWidth, document.documentElement.scrollWidth]")
    if needed_px > width_px:
        found.append(f"scroll: the page is {needed_px} px wide")
    found += [f"contrast: in a figure: {text}" for text in page.evaluate(FIGURE_TEXT, LEAST_CONTRAST)]
    # To axe a drawing is one image with a name; thousands of marks inside would only cost time.
    page.evaluate("document.querySelectorAll('svg').forEach(svg => svg.replaceChildren())")
    for violation in Axe().run(page).response["violations"]:
        nodes = violation["nodes"]
        found.append(f"{violation['id']}: {violation['help']}: {len(nodes)} times, first {nodes[0]['html'][:120]}")


def of_its_content(page, found, sections):
    """Faults that are the same in every view."""
    for section in sections:
        if not page.locator(f"section[id='{section}'] >> visible=true").count():
            found.append(f"section: {section} is not shown")
    found += [f"svg: without a name: {svg}" for svg in page.evaluate(NAMELESS)]
    page.keyboard.press("Control+A")
    found += [f"select: cannot be marked: {text}" for text in page.evaluate(UNMARKED)]
    page.evaluate("getSelection().removeAllRanges()")
    for slider in page.locator("input[type=range] >> visible=true").all():
        # The keys must move what is drawn, not only the slider.
        slider.focus()
        page.keyboard.press("Home")
        before = slider.evaluate(DRAWN)
        page.keyboard.press("End")
        if slider.evaluate(DRAWN) == before:
            found.append("slider: keys do not move the figure")


def of_its_print(page, found, file):
    """Faults on paper."""
    page.emulate_media(media="print")
    headings = page.evaluate(HEADINGS)
    page.pdf(path=file, prefer_css_page_size=True, print_background=True)
    with PdfDocument(file) as document:
        texts = ["".join(leaf.get_textpage().get_text_range().split()) for leaf in document]
    for number, text in enumerate(texts, 1):
        rest = text
        for heading in headings:
            rest = rest.removeprefix(heading)
        if not rest:
            found.append(f"print: page {number} holds {f'only a heading, {text}' if text else 'nothing'}")
        elif any(heading and text.endswith(heading) for heading in headings):
            found.append(f"print: page {number} ends with a heading")
    return len(texts)


def faults_of(browser, file, sections, out, views):
    """Faults of a page, and its pages of print."""
    page, found = opened(browser, file, *views[0])
    of_its_content(page, found, sections)
    leaves = of_its_print(page, found, out / f"{file.stem}.pdf")
    page.context.close()
    for width_px, scheme in views:
        page, seen = opened(browser, file, width_px, scheme)
        page.screenshot(path=out / f"{file.stem}-{width_px}-{scheme}.png", full_page=True)
        of_every_view(page, seen)
        page.context.close()
        found += [f"{fault} ({width_px} px, {scheme})" for fault in seen]
    return found, leaves


def missed(browser, out):
    """Faults made on purpose that were not found, and faults found in the page that has none."""
    folder = out / "faults"
    folder.mkdir(exist_ok=True)
    file = folder / "page.html"
    for expected, html in FAULTS:
        file.write_text(html)
        found, _ = faults_of(browser, file, ["main"], folder, [(WIDTHS_PX[-1], SCHEMES[0])])
        good = any(fault.startswith(expected) for fault in found) if expected else not found
        if not good:
            yield f"a page with the fault {expected!r} gives {found}"


def work(chromium, pages, out, page):
    """Faults of a page, or of the tests themselves when there is none; what was done, in words."""
    start = time.monotonic()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium)
        if page is None:
            name, done, found = "tests", f"{len(FAULTS)} pages made for them", list(missed(browser, out))
        else:
            views = [(width_px, scheme) for width_px in WIDTHS_PX for scheme in SCHEMES]
            found, leaves = faults_of(browser, pages / page["file"], page["sections"], out, views)
            name, done = page["file"], f"{len(views)} views, {leaves} pages of print"
        browser.close()
    return f"{name}: {done}, {len(found)} faults, {time.monotonic() - start:.1f} s", [f"{name}: {fault}" for fault in found]


def main(chromium, pages, out):
    tasks = [None, *json.loads((pages / "pages.json").read_text())]
    with ProcessPoolExecutor() as pool:
        done = list(pool.map(partial(work, chromium, pages, out), tasks))
    for words, _ in done:
        print(words, flush=True)
    found = [fault for _, faults in done for fault in faults]
    print(*found, sep="\n", end="\n" if found else "", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])))
