"""Icon of the FMUs: a ball screw with its double nut in section. One list of shapes is drawn as SVG and as PNG."""

import io
from typing import Any, NamedTuple

SIZE = 100.0  # coordinates from -SIZE to SIZE, y up
PIXELS = 256


class Shape(NamedTuple):
    """Closed polygon (three points or more), line (two) or circle (centre and radius)."""

    points: tuple[tuple[float, float], ...]
    fill: str | None
    edge: str | None = "#26323c"
    width: float = 1.5
    radius: float | None = None


def _box(x: float, y: float, width: float, height: float, fill: str) -> Shape:
    return Shape(((x, y), (x + width, y), (x + width, y + height), (x, y + height)), fill)


def _groove(x: float, core: float, lean: float) -> Shape:
    return Shape(((x - lean, -core), (x + lean, core)), None, "#5b6873", 2.5)


def shapes() -> list[Shape]:
    """From back to front."""
    steel, nut, dark, inside, ball = "#c3cbd2", "#3b7db4", "#2f6591", "#e9eef2", "#f0b429"
    core, lean = 15.0, 3.0  # radius of the screw, half the offset of a groove
    drawn = [_box(-92.0, -core, 184.0, 2.0 * core, steel)]
    drawn += [_groove(x, core, lean) for x in (-76.0, 64.0, 76.0)]
    drawn += [_box(-92.0, -9.0, 8.0, 18.0, steel), _box(84.0, -9.0, 8.0, 18.0, steel)]
    drawn += [_box(-66.0, -70.0, 16.0, 140.0, dark), _box(-50.0, -48.0, 50.0, 96.0, nut)]
    drawn += [_box(0.0, -48.0, 6.0, 96.0, dark), _box(6.0, -48.0, 50.0, 96.0, nut)]
    for window in (-44.0, 6.0):  # the cut through each nut
        drawn.append(_box(window, -28.0, 44.0, 56.0, inside))
        drawn.append(_box(window, -core, 44.0, 2.0 * core, steel))
        for x in (window + 10.0, window + 22.0, window + 34.0):
            drawn.append(_groove(x, core, lean))
            drawn += [Shape(((x + side * lean, side * 20.5),), ball, radius=5.2) for side in (1.0, -1.0)]
    return drawn


def icon_svg() -> bytes:
    """The icon as SVG (y down)."""
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{PIXELS}" height="{PIXELS}" '
        f'viewBox="{-SIZE:g} {-SIZE:g} {2 * SIZE:g} {2 * SIZE:g}">'
    ]
    for s in shapes():
        style = f'fill="{s.fill or "none"}" stroke="{s.edge or "none"}" stroke-width="{s.width:g}"'
        if s.radius is not None:
            ((x, y),) = s.points
            lines.append(f'<circle cx="{x:g}" cy="{-y:g}" r="{s.radius:g}" {style}/>')
        else:
            path = " ".join(f"{x:g},{-y:g}" for x, y in s.points)
            kind = "polyline" if len(s.points) == 2 else "polygon"
            lines.append(f'<{kind} points="{path}" {style}/>')
    return "\n".join([*lines, "</svg>\n"]).encode()


def icon_png() -> bytes:
    """The icon as PNG with a transparent background."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle, Polygon

    inches = 2.0
    per_unit = inches * 72.0 / (2.0 * SIZE)  # points
    figure = Figure(figsize=(inches, inches), dpi=PIXELS / inches)
    figure.patch.set_alpha(0.0)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-SIZE, SIZE), ylim=(-SIZE, SIZE))
    axes.set_axis_off()
    for z, s in enumerate(shapes()):
        style: dict[str, Any] = {"linewidth": s.width * per_unit, "zorder": z}
        if s.radius is not None:
            axes.add_patch(Circle(s.points[0], s.radius, facecolor=s.fill, edgecolor=s.edge, **style))
        elif len(s.points) == 2:
            axes.add_line(Line2D(*zip(*s.points, strict=True), color=s.edge, **style))
        else:
            axes.add_patch(Polygon(s.points, facecolor=s.fill, edgecolor=s.edge, **style))
    stream = io.BytesIO()
    FigureCanvasAgg(figure).print_png(stream, metadata={"Software": None})
    return stream.getvalue()
