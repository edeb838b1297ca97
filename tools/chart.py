"""Charts of lines over logarithmic axes as SVG, without other libraries."""

import math

# Okabe and Ito's palette: told apart by the colour-blind too.
COLOURS = ["#000000", "#E69F00", "#56B4E9", "#009E73", "#D55E00", "#0072B2", "#CC79A7"]
MARKS = ["circle", "square", "diamond", "triangle"]


def mark(kind, x, y, colour):
    if kind == "circle":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour}"/>'
    ring = {
        "square": [(-3, -3), (3, -3), (3, 3), (-3, 3)],
        "diamond": [(0, -4.5), (4.5, 0), (0, 4.5), (-4.5, 0)],
        "triangle": [(0, -4.5), (4, 3), (-4, 3)],
    }[kind]
    points = " ".join(f"{x + a:.1f},{y + b:.1f}" for a, b in ring)
    return f'<polygon points="{points}" fill="{colour}"/>'


def axis(low, high):
    """Decades around the data, and the ticks within them: 1, 2, 5 where there is room."""
    a, b = math.log10(low), math.log10(high)
    pad = 0.04 * (b - a)
    a, b = a - pad, b + pad
    steps = (1, 2, 5) if b - a < 3.2 else (1,)
    ticks = [m * 10.0**k for k in range(math.floor(a), math.ceil(b) + 1) for m in steps]
    return a, b, [t for t in ticks if a <= math.log10(t) <= b]


def loglog(title, xlabel, ylabel, series, width=860, height=560):
    """SVG text. `series`: name -> list of (x, y), all positive; drawn in order, named at the right."""
    left, right, top, bottom = 80, 250, 48, 62
    xs = [x for points in series.values() for x, _ in points]
    ys = [y for points in series.values() for _, y in points]
    (x0, x1, xticks), (y0, y1, yticks) = axis(min(xs), max(xs)), axis(min(ys), max(ys))
    w, h = width - left - right, height - top - bottom
    px = lambda x: left + w * (math.log10(x) - x0) / (x1 - x0)
    py = lambda y: top + h * (1 - (math.log10(y) - y0) / (y1 - y0))
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="sans-serif" font-size="13">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        f'<text x="{left}" y="26" font-size="16" font-weight="bold">{title}</text>',
    ]
    for t in xticks:
        out.append(f'<line x1="{px(t):.1f}" y1="{top}" x2="{px(t):.1f}" y2="{top + h}" stroke="#ddd"/>')
        out.append(f'<text x="{px(t):.1f}" y="{top + h + 18}" text-anchor="middle">{t:g}</text>')
    for t in yticks:
        out.append(f'<line x1="{left}" y1="{py(t):.1f}" x2="{left + w}" y2="{py(t):.1f}" stroke="#ddd"/>')
        out.append(f'<text x="{left - 8}" y="{py(t) + 4:.1f}" text-anchor="end">{t:g}</text>')
    out.append(f'<rect x="{left}" y="{top}" width="{w}" height="{h}" fill="none" stroke="#444"/>')
    out.append(f'<text x="{left + w / 2}" y="{height - 16}" text-anchor="middle">{xlabel}</text>')
    out.append(f'<text transform="translate(20 {top + h / 2}) rotate(-90)" text-anchor="middle">{ylabel}</text>')
    for k, (name, points) in enumerate(series.items()):
        colour, shape = COLOURS[k % len(COLOURS)], MARKS[k % len(MARKS)]
        line = " ".join(f"{px(x):.1f},{py(y):.1f}" for x, y in points)
        out.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        out += [mark(shape, px(x), py(y), colour) for x, y in points]
        y = top + 14 + 22 * k
        out.append(f'<line x1="{left + w + 14}" y1="{y}" x2="{left + w + 40}" y2="{y}" stroke="{colour}" stroke-width="2"/>')
        out.append(mark(shape, left + w + 27, y, colour))
        out.append(f'<text x="{left + w + 48}" y="{y + 4}">{name}</text>')
    return "\n".join(out + ["</svg>", ""])
