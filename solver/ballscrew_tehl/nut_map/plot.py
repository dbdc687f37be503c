"""Picture of a map: values over speed, samples, and points of its certificate.

The numbers are made by map_picture, drawn by map_figure. matplotlib is imported when a figure is made.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..parameters.units import CELSIUS, RPM
from ..physics.hertz import RACEWAYS
from ..runtime.evaluate import DoubleNutState, NutMap
from ..runtime.packed import POINT
from ..whole_file import whole_file
from .contact_map import ContactMap
from .contacts import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

#: speeds of a line
SPEEDS = 241
#: errors of a certificate by name, with their names in a picture
ERRORS = {"torque": "friction torque", "film": "central film", "temperature_rise": "temperature rise"}
#: totals of an error in the header of a map, by the ends of their keys, with their names in a picture
TOTALS = (("mean", "mean"), ("99", "99 % quantile"), ("999", "99.9 % quantile"), ("max", "largest"))
#: scale of the errors of a certificate, which is logarithmic: lowest over highest end, and the least highest end
ERROR_SPAN, MIN_ERROR = 1e-3, 1e-9
#: points of a certificate above which their marks are smaller
CROWD = 100
#: characters of a line of the caption
CAPTION_WIDTH = 150
#: films of a state with their names in a picture and their lines
FILM_LINES = {
    "film_thickness_central_screw": ("central, screw raceway", "-"),
    "film_thickness_central_nut": ("central, nut raceway", "--"),
    "film_thickness_min": ("minimum, both raceways", ":"),
}
#: colour-blind safe: the scales rise in lightness; the colour of Okabe & Ito for what needs care
PRELOAD_COLOURS, TEMPERATURE_COLOURS, ERROR_COLOURS, CAUTION = "cividis", "plasma", "viridis_r", "#D55E00"


class CertificatePoints(NamedTuple):
    """Random operating points of a certificate and the errors of the map there."""

    ball_load: Array  # [N] of the heaviest ball of both nuts, as the map has it
    speed: Array  # [rad/s]
    errors: Mapping[str, Array]  # relative, keys of ERRORS; of the packaged published map the torque alone


@dataclass(frozen=True)
class MapPicture:
    """Numbers of the picture, SI: lines over speed without axial load, samples, certificate.

    by_preload: state (preload, speed) at the temperature; by_temperature: state (temperature, speed) at the preload
    certificate: None if the map file does not hold its points
    """

    nut_map: NutMap
    contact_map: ContactMap
    speed: Array
    preloads: Array
    temperatures: Array
    preload: float
    temperature: float
    by_preload: DoubleNutState
    by_temperature: DoubleNutState
    certificate: CertificatePoints | None

    @property
    def film_rows(self) -> list[int]:
        """Temperatures whose films are drawn: coldest, that of the lines by preload, hottest."""
        chosen = (self.temperatures[0], self.temperature, self.temperatures[-1])
        return [row for row, temperature in enumerate(self.temperatures) if temperature in chosen]


def map_picture(nut_map: NutMap, contact_map: ContactMap) -> MapPicture:
    """The numbers to draw, over the whole range of speed of the map and with its own friction parameters."""
    axes = nut_map.header["axes"]
    slowest, fastest = axes["speed"][:2]
    speed = np.geomspace(slowest, fastest, SPEEDS)
    preloads = round_preloads(
        max(axes["force"][0], axes["preload"][0]), min(axes["force"][1], axes["preload"][1])
    )
    preload = float(preloads[np.argmin(np.abs(np.log(preloads**2 / (preloads[0] * preloads[-1]))))])
    cold, hot = axes["temperature"][:2]
    reference = round(contact_map.parameters.lubricant.reference_temperature - CELSIUS) + CELSIUS
    temperature = float(np.clip(reference, cold, hot))
    temperatures = np.unique([cold, temperature, 0.5 * (temperature + hot), hot])
    return MapPicture(
        nut_map, contact_map, speed, preloads, temperatures, preload, temperature,
        nut_map.evaluate(preloads[:, None], speed, temperature),
        nut_map.evaluate(preload, speed, temperatures[:, None]), _certificate_points(nut_map),
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


def _certificate_points(nut_map: NutMap) -> CertificatePoints | None:
    """None: no points."""
    each = nut_map.header["certificate"].get("each")
    if each is None:
        return None
    columns = {name: np.array(column, dtype=float) for name, column in each.items()}
    load = nut_map.evaluate(*(columns[name] for name in POINT)).ball_load_max
    errors = {name: columns[key] for name in ERRORS if (key := f"{name}_error") in columns}
    return CertificatePoints(load, columns["speed"], errors)


def percent(error: float) -> str:
    """Two digits.

    Example
        >>> percent(0.00448), percent(1.2), percent(3e-6)
        ('0.45 %', '120 %', '0.0003 %')
    """
    return f"{float(f'{100.0 * error:.2g}'):g} %"


def caption(picture: MapPicture) -> str:
    """Caption: samples and certificate."""
    header, contacts = picture.nut_map.header, picture.contact_map.contacts
    share = float(np.mean([np.mean(c.values["asymptotic"][c.good]) for c in contacts.values()]))
    solved = " and ".join(f"{int(c.good.sum())} on the {raceway}" for raceway, c in contacts.items())
    left_out = " and ".join(percent(header["sampling_errors"][raceway]) for raceway in contacts)
    unsolved = sum(int((~c.good).sum()) for c in contacts.values())
    lines = [
        f"Contacts solved: {solved} raceway, {percent(share)} of them on the asymptotic branch; {unsolved} not solved. "
        f"Mean error of a film when its contact is left out: {left_out}."
    ]
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
        lines.append(f"Errors at {certificate['points']} points: {'; '.join(parts)}.")
        if picture.certificate is None:
            lines[-1] += " The file does not hold the points."
    else:
        lines.append("The map has no certificate.")
    lines.append(f"Map {header.get('file_hash', header['content_hash'])[:12]}, version {header['version']}.")
    # a number keeps its unit
    pieces = [textwrap.wrap(line.replace(" %", "\xa0%"), CAPTION_WIDTH) for line in lines]
    return "\n".join(piece for line in pieces for piece in line).replace("\xa0", " ")


def map_figure(picture: MapPicture, error: str = "torque") -> Figure:
    """The picture; every panel carries its name as label.

    Parameters   error: which one of ERRORS gives colour and size to the points of the certificate
    Raises       ValueError: unknown error
    """
    from matplotlib.figure import Figure

    if error not in ERRORS:
        raise ValueError(f"error = {error!r}; allowed: {', '.join(ERRORS)}")
    header = picture.nut_map.header
    figure = Figure(figsize=(10.0, 11.6), layout="constrained")
    names = ("torque_by_preload", "torque_by_temperature", "film", "rise", *RACEWAYS)
    panels = dict(zip(names, figure.subplots(3, 2).flat, strict=True))
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
    held = None if picture.certificate is None else picture.certificate.errors.get(error)
    norm = None if held is None else _error_norm(held)
    for raceway in RACEWAYS:
        _draw_samples(panels[raceway], picture, raceway, error, norm)
    if held is not None and norm is not None:
        below = bool(held.min() < norm.vmin)
        _draw_error_scale(figure, [panels[raceway] for raceway in RACEWAYS], norm, error, below)
    for axes in panels.values():
        _plain_numbers(axes)
    figure.suptitle(
        f"Nut map of {picture.contact_map.parameters.name}, kinematics {header['kinematics']}, "
        f"film model {header['film_model']}"
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


def _draw_samples(axes: Axes, picture: MapPicture, raceway: str, error: str, norm: LogNorm | None) -> None:
    """Solved contacts of all temperatures; a square: the asymptotic branch."""
    contacts = picture.contact_map.contacts[raceway]
    load, rpm = contacts.points[:, 0], contacts.points[:, 1] / RPM
    axes.plot(rpm[contacts.good], load[contacts.good], "o", color="0.45", markersize=2.5, label="solved")
    for mask, mark, label in (
        (contacts.good & (contacts.values["asymptotic"] > 0.0), "s", "asymptotic"),
        (~contacts.good, "x", "not solved"),
    ):
        if mask.any():
            axes.plot(rpm[mask], load[mask], mark, color=CAUTION, fillstyle="none", markersize=7, label=label)
    axes.set(title=f"Samples on the {raceway} raceway", yscale="log", ylabel="ball load [N]")
    if picture.certificate is not None and norm is not None:
        found = picture.certificate
        errors = np.clip(found.errors[error], norm.vmin, norm.vmax)
        crowd = min(1.0, (CROWD / found.speed.size) ** 0.5)
        sizes = crowd * (15.0 + 85.0 * np.asarray(norm(errors)))
        axes.scatter(
            found.speed / RPM, found.ball_load, s=sizes, c=errors, norm=norm,
            cmap=ERROR_COLOURS, edgecolors="black", linewidths=0.8 * crowd, zorder=3,
            label="certificate, heaviest ball",
        )  # fmt: skip
    lightest, heaviest = picture.contact_map.range.load
    axes.set_ylim(bottom=lightest * (lightest / heaviest) ** 0.55)  # room for the legend
    axes.legend(loc="lower left")


def _error_norm(errors: Array) -> LogNorm:
    """Colours of errors, over half a decade at least and three at most; what is below counts as the lowest."""
    from matplotlib.colors import LogNorm

    highest = max(errors.max(), MIN_ERROR)
    return LogNorm(np.clip(errors.min(), ERROR_SPAN * highest, highest / 3.0), highest)


def _draw_error_scale(figure: Figure, axes: list[Axes], norm: LogNorm, error: str, below: bool) -> None:
    """below: errors below the scale are marked by a tip on it."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import LogLocator, NullFormatter

    bar = figure.colorbar(
        ScalarMappable(norm, ERROR_COLOURS), ax=axes, location="bottom", aspect=50, shrink=0.8,
        extend="min" if below else "neither",
    )  # fmt: skip
    bar.ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    bar.ax.xaxis.set_major_formatter(lambda value, _: percent(value))
    bar.ax.xaxis.set_minor_formatter(NullFormatter())
    bar.set_label(f"certificate: error of the {ERRORS[error]} against direct solves")


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
