"""Draw layers.svg, the figure of the layers on the design page.

python docs/images/draw_layers.py
"""

from __future__ import annotations

from pathlib import Path

PLAIN, OMPL, TORCH = "#f1f3f5", "#d3f0e0", "#fde3c4"
# Rows of the stack from above, each with its boxes: name, what it does, colour.
STACK = [
    [("cli", "the commands", PLAIN)],
    [("plotting", "figures of plans", PLAIN)],
    [("training", "losses, training loop, export of models", TORCH)],
    [("evaluation", "scores of regions, baselines, label noise", PLAIN)],
    [("datasets", "training sets, labels", PLAIN), ("benchmarking", "OMPL's Benchmark", OMPL)],
    [("planning", "plan, attach, hooks, checks for OMPL", OMPL)],
    [("inference", "exported models: heat maps from maps", TORCH)],
    [("sampling", "heat maps, samplers, adaptation", PLAIN)],
    [("maps", "grids, files, search", PLAIN), ("map_generators", "random maps", PLAIN)],
    [("common", "files, processes, checks of numbers", PLAIN)],
]
LEFT, TOP, WIDTH, HEIGHT, GAP = 60, 16, 460, 44, 10
SIDE = 190  # width of the box of the networks
FONT = "font-family='DejaVu Sans, Helvetica, Arial, sans-serif'"


def main() -> None:
    right = LEFT + WIDTH + GAP
    width, ground = right + SIDE + 16, top(len(STACK))
    height = ground + HEIGHT + 44
    parts = [f"<rect width='{width}' height='{height}' fill='white'/>"]
    for row, boxes in enumerate(STACK):
        each = (WIDTH - GAP * (len(boxes) - 1)) / len(boxes)
        for column, (name, text, color) in enumerate(boxes):
            x = LEFT + column * (each + GAP)
            parts.append(box(x, top(row), each, HEIGHT, name, text, color))
    # Only training imports the networks, from its own row.
    first = 2
    tall = ground - GAP - top(first)
    parts.append(box(right, top(first), SIDE, tall, "networks", "the architectures", TORCH))
    whole = WIDTH + GAP + SIDE
    parts.append(box(LEFT, ground, whole, HEIGHT, "errors", "the exceptions", PLAIN))
    parts.append(arrow(30, top(0), ground + HEIGHT))
    parts.append(legend(LEFT, ground + HEIGHT + 16))
    head = f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' width='{width}'"
    title = "<title>The layers of the package; imports point down only</title>"
    svg = "\n".join([f"{head} height='{height}' role='img'>", title, *parts, "</svg>\n"])
    Path(__file__).with_name("layers.svg").write_text(svg, encoding="utf-8")


def top(row: int) -> float:
    return TOP + row * (HEIGHT + GAP)


def box(x: float, y: float, width: float, height: float, name: str, text: str, color: str) -> str:
    middle, center = x + width / 2, y + height / 2
    return (
        f"<rect x='{x:g}' y='{y:g}' width='{width:g}' height='{height:g}' rx='6' fill='{color}' "
        "stroke='#495057'/>\n"
        f"<text x='{middle:g}' y='{center - 3:g}' text-anchor='middle' font-size='14' "
        f"font-weight='bold' {FONT}>{name}</text>\n"
        f"<text x='{middle:g}' y='{center + 14:g}' text-anchor='middle' font-size='11' "
        f"fill='#343a40' {FONT}>{text}</text>"
    )


def arrow(x: float, y0: float, y1: float) -> str:
    middle = (y0 + y1) / 2
    return (
        f"<path d='M{x} {y0:g} V{y1:g} m-6 -10 l6 10 l6 -10' fill='none' stroke='#495057' "
        "stroke-width='2'/>\n"
        f"<text x='{x - 10:g}' y='{middle:g}' text-anchor='middle' font-size='12' {FONT} "
        f"transform='rotate(-90 {x - 10:g} {middle:g})'>imports</text>"
    )


def legend(x: float, y: float) -> str:
    parts = []
    for color, text in ((OMPL, "imports ompl"), (TORCH, "imports torch"), (PLAIN, "neither")):
        parts.append(
            f"<rect x='{x:g}' y='{y:g}' width='14' height='14' fill='{color}' stroke='#495057'/>"
            f"<text x='{x + 20:g}' y='{y + 12:g}' font-size='12' {FONT}>{text}</text>"
        )
        x += 130
    return "\n".join(parts)


if __name__ == "__main__":
    main()
