"""Figure of results over commits, as SVG: a panel for each protocol, a line for each planner."""

import math
from xml.sax.saxutils import escape

WIDTH = 760
LEFT, RIGHT = 80, 175
# Above and below the axes of a panel.
ABOVE, BELOW = 42, 58
HEIGHT_MIN = 240
# Distance of labels, in pixels.
LINE, LABEL = 14, 78

INK, FAINT, GRID, FRAME = "#222222", "#666666", "#e4e4e4", "#666666"
# As in the reports of Palpate: src/report/style.rs.
OWN = {"active": "#0072b2", "random": "#d55e00", "sobol": "#cc79a7"}
SPARE = ("#e69f00", "#56b4e9", "#000000", "#7a5195", "#8c6d31", "#667788", "#2f8f8f", "#b0305c")


class Panel:
    """Results of a protocol."""

    def __init__(self, title, commits, series):
        """`commits` are (date, commit, SHA-256 of the protocol) by date. `series` has the points of each planner: index of
        the commit, value, ends of the interval or None."""
        self.title, self.commits, self.series = title, commits, series


def svg(panels):
    """Returns the figure of panels by their protocol."""
    parts, top = [], 0
    names = sorted({name for panel in panels.values() for name in panel.series if name not in OWN})
    colours = OWN | {name: SPARE[index % len(SPARE)] for index, name in enumerate(names)}
    for protocol, panel in panels.items():
        height = max(HEIGHT_MIN, LINE * (len(panel.series) + 1))
        parts += drawn(protocol, panel, top + ABOVE, height, colours)
        top += ABOVE + height + BELOW
    size = f'width="{WIDTH}" height="{top}" viewBox="0 0 {WIDTH} {top}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif">'
    paper = '<rect width="100%" height="100%" fill="#ffffff"/>'
    return "\n".join([head, "<!-- drawn by benches/results.py -->", paper, *parts, "</svg>\n"])


def drawn(protocol, panel, top, height, colours):
    """Returns the elements of a panel whose axes begin at `top`."""
    right, bottom = WIDTH - RIGHT, top + height
    step = (right - LEFT) / max(1, len(panel.commits))
    values = [it for points in panel.series.values() for _, *point in points for it in point if it is not None]
    low, high, ticks = scale(values)
    y = lambda value: bottom - (value - low) / (high - low) * height
    # Points of one commit are side by side, so that their intervals can be told apart.
    side = min(9, 0.6 * step / max(1, len(panel.series)))
    middle = 0.5 * (len(panel.series) - 1)
    x = lambda commit, index: LEFT + (commit + 0.5) * step + side * (index - middle)

    parts = [text(LEFT, top - 14, f"{protocol}: {panel.title}", size=13)]
    for tick, label in ticks:
        parts += [line((LEFT, y(tick)), (right, y(tick)), GRID), text(LEFT - 7, y(tick) + 4, label, "end")]
    every = math.ceil(LABEL / step)
    for index, (date, commit, sha256) in enumerate(panel.commits):
        centre = LEFT + (index + 0.5) * step
        if (len(panel.commits) - 1 - index) % every == 0:
            parts += [line((centre, bottom), (centre, bottom + 5), FRAME)]
            parts += [text(centre, bottom + 19, date[:10], "middle")]
            parts += [text(centre, bottom + 34, commit[:8], "middle", FAINT)]
        if index and sha256 != panel.commits[index - 1][2]:
            parts += [line((centre - 0.5 * step, top), (centre - 0.5 * step, bottom), FAINT, 'stroke-dasharray="4 4"')]
    parts += [f'<path d="M{LEFT} {top}H{right}V{bottom}H{LEFT}z" fill="none" stroke="{FRAME}"/>']
    # From the best to the worst of the newest values: the order of the labels.
    order = sorted(panel.series.items(), key=lambda item: y(item[1][-1][1]))
    radius = max(1.5, min(3, 0.3 * step))
    ends = []
    for index, (name, points) in enumerate(order):
        colour = colours[name]
        for (a, value_a, *_), (b, value_b, *_) in zip(points, points[1:]):
            if panel.commits[a][2] == panel.commits[b][2]:
                parts.append(line((x(a, index), y(value_a)), (x(b, index), y(value_b)), colour, 'stroke-width="1.5"'))
        for commit, value, low_end, high_end in points:
            at = x(commit, index)
            if low_end is not None and high_end is not None:
                interval = (at, y(low_end)), (at, y(high_end))
                parts.append(line(*interval, colour, 'stroke-width="1.5" stroke-opacity="0.7"'))
            parts.append(f'<circle cx="{at:.1f}" cy="{y(value):.1f}" r="{radius:.1f}" fill="{colour}"/>')
        ends.append((name, x(points[-1][0], index), y(points[-1][1]), points[-1][0] == len(panel.commits) - 1))
    heights = spread([end[2] for end in ends], top + 5, bottom - 5)
    for (name, at, end, is_newest), label in zip(ends, heights):
        if is_newest:
            parts.append(line((at + 4, end), (right, end), colours[name], 'stroke-opacity="0.25"'))
        parts.append(line((right, end), (right + 16, label), colours[name], 'stroke-opacity="0.6"'))
        parts.append(text(right + 20, label + 4, name, colour=colours[name]))
    return parts


def scale(values):
    """Returns the ends of an axis and its ticks with their labels."""
    low, high = (min(values), max(values)) if values else (0, 1)
    margin = 0.06 * (high - low) or 0.1 * abs(high) or 1
    low, high = low - margin, high + margin
    unit = 10 ** math.floor(math.log10((high - low) / 4))
    step = next(unit * it for it in (1, 2, 5, 10) if (high - low) / (unit * it) <= 6)
    decimals = max(0, -math.floor(math.log10(step)))
    first, last = math.ceil(low / step), math.floor(high / step)
    return low, high, [(index * step, f"{index * step:.{decimals}f}") for index in range(first, last + 1)]


def spread(heights, top, bottom):
    """Returns ascending heights moved apart by at least `LINE`, within top and bottom if they fit."""
    # Groups of neighbours: sum of the heights of their first labels, and number of labels.
    groups = []
    first = lambda group: max(top, min(group[0] / group[1], bottom - (group[1] - 1) * LINE))
    for height in heights:
        groups.append((height, 1))
        while len(groups) > 1 and first(groups[-2]) + groups[-2][1] * LINE > first(groups[-1]):
            (total, number), (other, others) = groups[-2:]
            groups[-2:] = [(total + other - others * number * LINE, number + others)]
    return [first(group) + index * LINE for group in groups for index in range(group[1])]


def line(start, end, colour, more=""):
    (x, y), (x_end, y_end) = start, end
    return f'<path d="M{x:.1f} {y:.1f}L{x_end:.1f} {y_end:.1f}" stroke="{colour}"{more and " " + more}/>'


def text(x, y, words, anchor="start", colour=INK, size=11.5):
    at = f'x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}"'
    return f'<text {at} fill="{colour}">{escape(words)}</text>'
