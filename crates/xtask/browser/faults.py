"""Pages with one fault each, and the beginning of the words with which it must be found; None for a page that has none."""

FIGURE = '<svg viewBox="0 0 10 10" role="img" aria-label="A dot"><circle id="dot" cx="5" cy="5" r="2"/></svg>'
KEY = '<svg viewBox="0 0 9 1" aria-hidden="true"><circle r="1"/></svg>'
SLIDER = '<label>Time <input type="range" min="0" max="9" value="5"></label>'
MOVES = '<script>document.querySelector("input").oninput = e => dot.setAttribute("cx", e.target.value);</script>'


def page(body="", head="", section="main"):
    return f"""<!doctype html><html lang="en"><head><meta charset="utf-8"><title>A page</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">
<style>body {{ background: #fff; color: #222 }} svg {{ width: 9rem }} {head}</style></head>
<body><main><section id="{section}"><h1>Heading</h1><p>Words of a page.</p>{body}</section></main></body></html>"""


FAULTS = [
    (None, page(f"<h2>Figure</h2><figure>{KEY}{FIGURE}{SLIDER}</figure>{MOVES}")),
    ("console: warning", page("<script>console.warn('a')</script>")),
    ("script", page("<script>throw new Error('a')</script>")),
    ("network", page('<img src="missing.png" alt="">')),
    ("section", page(section="other")),
    ("scroll", page('<div style="width: 40rem">wide</div>')),
    ("svg", page('<svg viewBox="0 0 1 1"></svg>')),
    ("contrast", page('<svg viewBox="0 0 90 10" role="img" aria-label="A word"><text y="9" fill="#999">word</text></svg>')),
    ("color-contrast", page('<p style="color: #999">pale</p>')),
    ("heading-order", page("<h3>Too deep</h3><p>Words.</p>")),
    ("select", page('<p style="user-select: none">fixed</p>')),
    ("slider", page(f"<figure>{FIGURE}{SLIDER}</figure>")),
    ("print: page 2 holds only", page('<h2 style="break-before: page; break-after: page">Lost</h2><p>Words.</p>')),
    ("print: page 1 ends", page('<h2 style="break-after: page">Lost</h2><p>Words.</p>')),
]
