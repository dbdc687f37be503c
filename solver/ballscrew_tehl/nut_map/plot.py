"""Picture of a map: values over speed.

The numbers are made by map_picture, drawn by map_figure. matplotlib is imported when a figure is made.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..parameters.file import Parameters
from ..parameters.units import CELSIUS, RPM
from ..physics.ball_law import Array
from ..runtime.evaluate import DoubleNutState, NutMap
from ..whole_file import whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: speeds of a line
SPEEDS = 241
#: errors of a certificate by name, with their names in a picture
ERRORS = {"torque": "friction torque", "film": "central film", "temperature_rise": "temperature rise"}
#: totals of an error in the header of a map, by the ends of their keys, with their names in a picture
TOTALS = (("mean", "mean"), ("99", "99 % quantile"), ("999", "99.9 % quantile"), ("max", "largest"))
#: characters of a line of the caption
CAPTION_WIDTH = 150
#: films of a state with their names in a picture and their lines
FILM_LINES = {
    "film_thickness_central_screw": ("central, screw raceway", "-"),
    "film_thickness_central_nut": ("central, nut raceway", "--"),
    "film_thickness_min": ("minimum, both raceways", ":"),
}
#: colour-blind safe: the scales rise in lightness
PRELOAD_COLOURS, TEMPERATURE_COLOURS = "cividis", "plasma"


@dataclass(frozen=True)
class MapPicture:
    """Numbers of the picture, SI: lines over speed without axial load.

    by_preload: state (preload, speed) at the temperature; by_temperature: state (temperature, speed) at the preload
    """

    nut_map: NutMap
    name: str
    speed: Array
    preloads: Array
    temperatures: Array
    preload: float
    temperature: float
    by_preload: DoubleNutState
    by_temperature: DoubleNutState

    @property
    def film_rows(self) -> list[int]:
        """Temperatures whose films are drawn: coldest, that of the lines by preload, hottest."""
        chosen = (self.temperatures[0], self.temperature, self.temperatures[-1])
        return [row for row, temperature in enumerate(self.temperatures) if temperature in chosen]


def map_picture(nut_map: NutMap, parameters: Parameters) -> MapPicture:
    """The numbers to draw, over the whole range of speed of the map and with its own friction parameters."""
    axes = nut_map.header["axes"]
    slowest, fastest = axes["speed"][:2]
    speed = np.geomspace(slowest, fastest, SPEEDS)
    preloads = round_preloads(
        max(axes["force"][0], axes["preload"][0]), min(axes["force"][1], axes["preload"][1])
    )
    preload = float(preloads[np.argmin(np.abs(np.log(preloads**2 / (preloads[0] * preloads[-1]))))])
    cold, hot = axes["temperature"][:2]
    reference = round(parameters.lubricant.reference_temperature - CELSIUS) + CELSIUS
    temperature = float(np.clip(reference, cold, hot))
    temperatures = np.unique([cold, temperature, 0.5 * (temperature + hot), hot])
    return MapPicture(
        nut_map, parameters.name, speed, preloads, temperatures, preload, temperature,
        nut_map.evaluate(preloads[:, None], speed, temperature),
        nut_map.evaluate(preload, speed, temperatures[:, None]),
    )  # fmt: skip


def round_preloads(lowest: float, highest: float) -> Array:
    """Preloads between two [N]: of 1, 2, 5, 10, ..., at most six; three even ones where the range holds fewer than two.

    Example
        >>> round_preloads(120.0, 12000.0)
        array([  200.,   500.,  1000.,  2000.,  5000., 10000.])
    """
    decades = 10.0 ** np.arange(np.floor(np.log10(lowest)), np.ceil(np.log10(highest)) + 1.0)
    series = np.outer(decades, [1.0, 2.0, 5.0]).ravel()
    found = series[(series >= lowest) & (series <= highest)]
    if found.size < 2:
        return np.geomspace(lowest, highest, 3)
    return found[:: -(-found.size // 6)]


def percent(error: float) -> str:
    """Two digits.

    Example
        >>> percent(0.00448), percent(1.2), percent(3e-6)
        ('0.45 %', '120 %', '0.0003 %')
    """
    return f"{float(f'{100.0 * error:.2g}'):g} %"


def caption(picture: MapPicture) -> str:
    """Caption: the certificate of the contacts."""
    header, lines = picture.nut_map.header, list[str]()
    certificate = header["certificate"]
    parts = []
    for name, words in ERRORS.items():
        totals = [
            f"{total} {percent(certificate[f'{name}_error_{key}'])}"
            for key, total in TOTALS
            if f"{name}_error_{key}" in certificate
        ]
        if totals:
            parts.append(f"{words} {', '.join(totals)}")
    if parts:
        lines.append(
            f"Errors at {certificate['points']} points of {certificate['what']}: {'; '.join(parts)}."
        )
    else:
        lines.append("The map has no certificate.")
    lines.append(f"Map {header.get('file_hash', header['content_hash'])[:12]}, version {header['version']}.")
    # a number keeps its unit
    pieces = [textwrap.wrap(line.replace(" %", "\xa0%"), CAPTION_WIDTH) for line in lines]
    return "\n".join(piece for line in pieces for piece in line).replace("\xa0", " ")


def map_figure(picture: MapPicture) -> Figure:
    """The picture; every panel carries its name as label."""
    from matplotlib.figure import Figure

    header = picture.nut_map.header
    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    names = ("torque_by_preload", "torque_by_temperature", "film", "rise")
    panels = dict(zip(names, figure.subplots(2, 2).flat, strict=True))
    for name, axes in panels.items():
        axes.set_label(name)
        axes.set(xlabel="screw speed [r/min]", xscale="log")
        axes.grid(alpha=0.3)
    by_temperature = picture.by_temperature
    torque, rise = by_temperature.friction_torque, by_temperature.film_temperature_rise
    right, rises = panels["torque_by_temperature"], panels["rise"]
    _draw_torque(panels["torque_by_preload"], picture)
    _draw_by_temperature(
        right, picture, torque, "Friction torque by oil temperature", "friction torque [N m]"
    )
    _draw_film(panels["film"], picture)
    _draw_by_temperature(
        rises, picture, rise, "Film temperature rise", "mean rise of the hottest contact [K]"
    )
    for axes in panels.values():
        _plain_numbers(axes)
    figure.suptitle(
        f"Nut map of {picture.name}, kinematics {header['kinematics']}, film model {header['film_model']}"
    )
    figure.supxlabel(caption(picture), x=0.012, ha="left", fontsize=8.5, linespacing=1.5)
    return figure


def scale(name: str, count: int) -> list[Any]:
    """Colours from dark to light, none too light for a line on white."""
    from matplotlib import colormaps

    return [colormaps[name](x) for x in np.linspace(0.0, 0.82, count)]


def kilonewton(force: float) -> str:
    """A force [N] in words."""
    return f"{force / 1000.0:.3g} kN"


def celsius(temperature: float) -> str:
    """A temperature [K] in words."""
    return f"{temperature - CELSIUS:.3g} C"


def _draw_torque(axes: Axes, picture: MapPicture) -> None:
    rpm = picture.speed / RPM
    torques, colours = picture.by_preload.friction_torque, scale(PRELOAD_COLOURS, len(picture.preloads))
    for preload, torque, colour in zip(picture.preloads, torques, colours, strict=True):
        axes.plot(rpm, torque, color=colour, label=kilonewton(preload))
        axes.annotate(
            kilonewton(preload),
            (rpm[-1], torque[-1]),
            xytext=(4.0, 0.0),
            textcoords="offset points",
            va="center",
        )
    title = f"Friction torque by preload, oil at {celsius(picture.temperature)}"
    axes.set(title=title, yscale="log", ylabel="friction torque [N m]")
    axes.set_xlim(right=rpm[-1] * (rpm[-1] / rpm[0]) ** 0.2)  # room for the names of the lines


def _draw_by_temperature(axes: Axes, picture: MapPicture, values: Array, title: str, label: str) -> None:
    colours = scale(TEMPERATURE_COLOURS, len(picture.temperatures))
    for temperature, value, colour in zip(picture.temperatures, values, colours, strict=True):
        axes.plot(picture.speed / RPM, value, color=colour, label=celsius(temperature))
    axes.set(title=f"{title}, preload {kilonewton(picture.preload)}", ylabel=label)
    axes.set_ylim(bottom=0.0)
    axes.legend(title="oil temperature", loc="upper left")


def _draw_film(axes: Axes, picture: MapPicture) -> None:
    rpm = picture.speed / RPM
    colours = scale(TEMPERATURE_COLOURS, len(picture.temperatures))
    for name, (label, style) in FILM_LINES.items():
        films = 1e9 * getattr(picture.by_temperature, name)
        for row in picture.film_rows:
            axes.plot(rpm, films[row], style, color=colours[row])
        axes.plot([], [], style, color="0.3", label=label)
    axes.set(
        title=f"Film, preload {kilonewton(picture.preload)}",
        yscale="log",
        ylabel="least film over the balls [nm]",
    )
    low, high = axes.get_ylim()
    axes.set_ylim(low * (low / high) ** 0.25, high)  # room for the legend
    axes.legend(title="colours: oil temperature", loc="lower right")


def _plain_numbers(axes: Axes) -> None:
    """Labels 1000 instead of 10^3, more of them on a short axis."""
    from matplotlib.ticker import LogLocator, NullFormatter

    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        if axis.get_scale() == "log":
            axis.set_major_locator(LogLocator(subs=(1.0, 3.0) if high > 300.0 * low else (1.0, 2.0, 5.0)))
            axis.set_major_formatter(lambda value, _: f"{value:g}")
            axis.set_minor_formatter(NullFormatter())


def save_figure(figure: Figure, path: Path, file_hash: str) -> None:
    """Write a PNG to a temporary file next to `path` and rename it; its metadata name the map."""
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150, metadata={"Source": f"map {file_hash}"})
