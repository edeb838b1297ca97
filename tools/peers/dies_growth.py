#!/usr/bin/env python3
"""Chart of the time of `convert --tol` against the number of faces, from the first table of docs/results/dies.md whose
columns are `file`, `faces` and `--tol 0.05mm [s]`: docs/results/dies-growth.svg. Prints the exponent of the growth by least
squares of the logarithms, over the files within the tolerance.

  tools/peers/dies_growth.py"""
import math
import pathlib

RESULTS = pathlib.Path(__file__).resolve().parents[2] / "docs" / "results"
LEFT, TOP, WIDE, HIGH = 60, 20, 520, 320
FACES, SECONDS = (20, 2000), (0.3, 100)
COLOURS = {"within": "#1F77B4", "above": "#7F7F7F"}


def rows():
    """Name, faces, seconds and error (empty within the tolerance) of each line of the table."""
    found = []
    for line in (RESULTS / "dies.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 5 and cells[1].isdigit() and cells[3].isdigit():
            found.append((cells[0], int(cells[1]), float(cells[2]), cells[4]))
        elif found and not line.startswith("|"):
            break
    return found


def kind(row):
    return "above" if row[3] else "within"


def exponent(points):
    """Slope and intercept of the line of least squares through the logarithms."""
    x, y = ([math.log(value) for value in values] for values in zip(*points))
    mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
    slope = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y)) / sum((a - mean_x) ** 2 for a in x)
    return slope, mean_y - slope * mean_x


def place(faces, seconds):
    along = math.log(faces / FACES[0]) / math.log(FACES[1] / FACES[0])
    up = math.log(seconds / SECONDS[0]) / math.log(SECONDS[1] / SECONDS[0])
    return LEFT + WIDE * along, TOP + HIGH * (1 - up)


def text(x, y, words, anchor="middle"):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-family="sans-serif" font-size="11">{words}</text>'


def grid():
    for faces in (20, 50, 100, 200, 500, 1000, 2000):
        x, _ = place(faces, 1)
        yield f'<path d="M{x:.1f} {TOP}v{HIGH}" stroke="#DDDDDD"/>'
        yield text(x, TOP + HIGH + 16, faces)
    for seconds in (0.3, 1, 3, 10, 30, 100):
        _, y = place(100, seconds)
        yield f'<path d="M{LEFT} {y:.1f}h{WIDE}" stroke="#DDDDDD"/>'
        yield text(LEFT - 6, y + 4, seconds, "end")
    yield text(LEFT + WIDE / 2, TOP + HIGH + 34, "faces")
    yield text(LEFT, TOP - 6, "processor time on one thread [s]", "start")


def chart(found, line):
    yield f'<svg width="{LEFT + WIDE + 20}" height="{TOP + HIGH + 44}" xmlns="http://www.w3.org/2000/svg">'
    yield '<rect width="100%" height="100%" fill="#FFFFFF"/>'
    yield from grid()
    slope, start = line
    ends = [place(faces, math.exp(start) * faces**slope) for faces in (30, 1050)]
    (a, b), (c, d) = ends
    yield f'<path d="M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" stroke="{COLOURS["within"]}" stroke-dasharray="5 4"/>'
    for row in found:
        x, y = place(row[1], row[2])
        yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{COLOURS[kind(row)]}"><title>{row[0]}: {row[2]} s</title></circle>'
    names = {"within": f"within the tolerance, exponent {slope:.2f}", "above": "above the tolerance"}
    for k, (key, words) in enumerate(names.items()):
        yield f'<circle cx="{LEFT + 14}" cy="{TOP + 14 + 18 * k}" r="4" fill="{COLOURS[key]}"/>'
        yield text(LEFT + 24, TOP + 18 + 18 * k, words, "start")
    yield "</svg>"


def main():
    found = rows()
    within = [(row[1], row[2]) for row in found if not row[3]]
    line = exponent(within)
    print(f"exponent of the files within the tolerance: {line[0]:.2f} ({len(within)} files)")
    (RESULTS / "dies-growth.svg").write_text("\n".join(chart(found, line)) + "\n")


if __name__ == "__main__":
    main()
