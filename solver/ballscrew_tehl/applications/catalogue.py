"""A screw from what a page of a catalogue states; what is not stated is assumed."""

import math
import numbers
from typing import Any, NamedTuple

from pydantic import ValidationError

from ..parameters.file import Parameters, ScrewParameters
from ..parameters.screw import ROOT_OF_BALL
from ..physics.rating import computed_dynamic_rating, computed_static_rating
from .published_formulas import BELOW_CIRCLE
from .tables.headings import FORCE, INCH

#: diameters of balls that are made [mm]
BALLS = (
    0.8, 1.0, 1.2, 1.588, 2.0, 2.381, 2.778, 3.175, 3.969, 4.763, 5.556, 6.35, 7.144, 7.938, 9.525, 12.7, 15.875, 19.05,
)  # fmt: skip
#: ball over lead of one start and over nominal diameter
BALL_OF_LEAD, BALL_OF_DIAMETER = 0.635, 0.2
#: nominal diameter minus root diameter, over ball; weight of BALL_OF_LEAD where the root diameter is stated
ROOT_DEPTH, LEAD_WEIGHT = 0.82, 0.3
#: weight of BALL_OF_LEAD where ratings choose the ball: of twelve catalogue screws 7 right, 5 one size off; without: 6
RATING_WEIGHT = 1.5
#: loaded turns of a nut with one start; of each start of several
USUAL_TURNS, TURNS_OF_A_START = 3.0, 1.5
#: groove radius over ball, assumed; ends of what follows from a stated rating
USUAL_CONFORMITY, CONFORMITIES = 0.53, (0.515, 0.57)
#: units that older catalogues state ratings in [N]; factor off the computed rating from which on a rating is in one:
#: turns of two starts that are stated for one, and smaller balls, make it up to 3.5
RATING_UNITS = {unit: FORCE[unit][0] for unit in ("kN", "kgf", "lbf")}
SUSPECT = 4.0
#: exponents, with a minus, of 1 - 1/(2 f) in ratings
OPENNESS = {"dynamic_rating": 0.41, "static_rating": 0.5}


class CatalogueSizes(NamedTuple):
    """Sizes that a catalogue page states of a screw; None: assumed.

    Attributes
    ----------
    diameter_mm : float
        Nominal diameter [mm].
    lead_mm : float
        Lead [mm], negative: left-hand.
    ball_mm : float, optional
        Ball diameter [mm].
    turns : float, optional
        Loaded turns of one start of a nut.
    starts : int, optional
        Starts of the thread.
    root_mm, circle_mm : float, optional
        Diameter of the root and of the ball centre circle [mm].
    rating_n, static_rating_n : float, optional
        Dynamic and static rating of one nut [N].
    nut_kind : str, optional
        Kind of preload, as in a screw file.
    hand : {"right", "left"}, optional
        Hand of the thread.
    """

    diameter_mm: float
    lead_mm: float
    ball_mm: float | None = None
    turns: float | None = None
    starts: int = 1
    root_mm: float | None = None
    circle_mm: float | None = None
    rating_n: float | None = None
    static_rating_n: float | None = None
    nut_kind: str | None = None
    hand: str | None = None


def catalogue_parameters(sizes: CatalogueSizes, like: Parameters) -> tuple[Parameters, dict[str, str]]:
    """Screw of the sizes of a catalogue page, the rest as of another screw.

    Parameters
    ----------
    sizes : CatalogueSizes
        Stated sizes.
    like : Parameters
        Screw that materials, oil and friction law are taken from.

    Returns
    -------
    parameters : Parameters
        The screw.
    assumed : dict of str to str
        Names of its fields that are assumed, each with what it follows from.

    Raises
    ------
    ValueError
        No screw has these sizes.

    Notes
    -----
    With the root diameter ball and pitch circle follow from it. With C_a or C_0a, and turns, the conformity f of the
    grooves follows: ratings go with (1 - 1/(2 f)) to the powers of OPENNESS; without ball and root also the ball.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> parameters, assumed = catalogue_parameters(CatalogueSizes(25.0, 10.0, ball_mm=4.763), load_screw())
    >>> parameters.name, "turns" in assumed
    ('screw 25x10', True)
    """
    for name, value in sizes._asdict().items():
        if isinstance(value, str | None):
            continue
        size = float(value) if isinstance(value, numbers.Real) else math.nan
        if not 0.0 < (abs(size) if name == "lead_mm" else size) < math.inf:
            raise ValueError(f"{name} = {value}; allowed: a finite number, more than 0; check it")
    sizes = sizes._replace(starts=int(sizes.starts))
    try:
        if not abs(sizes.lead_mm) < math.pi * sizes.diameter_mm:
            raise ValueError("a lead above pi times the diameter: are lead and diameter swapped?")
        check_rating_units(sizes, like)
        ball = _ball(sizes, like)
        screw, stated = _screw(sizes, like, ball)
        if not abs(2e3 * screw.nominal_radius - sizes.diameter_mm) <= 0.5 * ball:
            raise ValueError("pitch circle or root diameter belong to another nominal diameter or ball")
        grooves_by_ratings = bool(sizes.turns and rating_ratios(screw))
        if grooves_by_ratings:
            ratios = rating_ratios(screw)
            # least squares of the logarithms where both are stated
            excess = sum(OPENNESS[name] * math.log(ratio) for name, ratio in ratios.items())
            excess /= sum(OPENNESS[name] ** 2 for name in ratios)
            low, high = (1.0 - 0.5 / end for end in CONFORMITIES)
            open_part = (1.0 - 0.5 / USUAL_CONFORMITY) * math.exp(excess)
            screw, _ = _screw(sizes, like, ball, 0.5 / (1.0 - min(max(open_part, low), high)))
    except ValueError as error:
        shown = ", ".join(f"{name} = {value}" for name, value in sizes._asdict().items() if value)
        if isinstance(error, ValidationError):
            problem = error.errors()[0]
            error = ValueError(
                " ".join((*map(str, problem["loc"]), problem["msg"])).removeprefix("Value error, ")
            )
        raise ValueError(f"no screw has {shown}: {error}") from error
    name = f"screw {sizes.diameter_mm:g}x{abs(sizes.lead_mm):g}"
    reasons = _reasons(sizes, grooves_by_ratings)
    assumed = {name: reasons[name] for name in reasons if name in screw.model_fields_set - stated}
    return like.model_copy(update={"name": name, "screw": screw}), assumed


def _reasons(sizes: CatalogueSizes, grooves_by_ratings: bool) -> dict[str, str]:
    """What each field follows from that a page does not state."""
    ball = f"{BALL_OF_LEAD} of the lead of one start, up to {BALL_OF_DIAMETER} of the diameter; nearest that is made"
    if sizes.root_mm is not None:
        ball = f"from the root and the {'diameter and lead' if sizes.circle_mm is None else 'pitch circle'}"
    elif grooves_by_ratings:
        ball = "nearest to ratings, lead and diameter"
    groove = "from ratings and turns" if grooves_by_ratings else f"{USUAL_CONFORMITY} of the ball, usual"
    circle = "diameter" if sizes.root_mm is None else "root"
    return {
        "preload_kind": "usual", "turns": "usual, of one start",
        "nominal_radius": f"from {circle} and ball", "ball_diameter": ball,
        "contact_angle": "usual", "screw_raceway_radius": groove, "nut_raceway_radius": groove,
        "youngs_modulus": "bearing steel", "poisson_ratio": "bearing steel",
    }  # fmt: skip


def _screw(
    sizes: CatalogueSizes, like: Parameters, ball: float, conformity: float = USUAL_CONFORMITY
) -> tuple[ScrewParameters, set[str]]:
    """The screw with a ball [mm], and its fields that are stated."""
    root, circle = sizes.root_mm, sizes.circle_mm
    usual = sizes.diameter_mm + BELOW_CIRCLE * ball if root is None else root + ROOT_OF_BALL * ball
    assumed = {
        "preload_kind": "double_nut", "turns": USUAL_TURNS if sizes.starts == 1 else TURNS_OF_A_START,
        "nominal_radius": 0.5e-3 * usual, "ball_diameter": 1e-3 * ball, "contact_angle": math.radians(45.0),
        **like.screw.model_dump(include={"youngs_modulus", "poisson_ratio"}),
        **dict.fromkeys(("screw_raceway_radius", "nut_raceway_radius"), 1e-3 * conformity * ball),
    }  # fmt: skip
    page = {
        "preload_kind": sizes.nut_kind, "hand": sizes.hand, "lead": 1e-3 * sizes.lead_mm, "turns": sizes.turns,
        "starts": sizes.starts if sizes.starts > 1 else None, "root_diameter": root and 1e-3 * root,
        "nominal_radius": circle and 0.5e-3 * circle, "ball_diameter": sizes.ball_mm and 1e-3 * ball,
        "dynamic_rating": sizes.rating_n, "static_rating": sizes.static_rating_n,
    }  # fmt: skip
    stated: dict[str, Any] = {name: value for name, value in page.items() if value is not None}
    return ScrewParameters(**assumed | stated), set(stated)


def _ball(sizes: CatalogueSizes, like: Parameters) -> float:
    """Ball diameter [mm]: stated, or that of BALLS nearest to root or ratings, lead and diameter."""
    if sizes.ball_mm is not None:
        return sizes.ball_mm
    usual = min(BALL_OF_LEAD * abs(sizes.lead_mm) / sizes.starts, BALL_OF_DIAMETER * sizes.diameter_mm)
    weight, depth, circle = 1.0, usual, sizes.circle_mm
    if (root := sizes.root_mm) is not None:
        weight, depth = LEAD_WEIGHT, (sizes.diameter_mm - root) / ROOT_DEPTH
        if circle is not None:
            weight, depth = 0.0, (circle - root) / ROOT_OF_BALL
        if not depth > 0.0:
            allowed = f"less than --diameter-mm = {sizes.diameter_mm:g} and --circle-mm"
            raise ValueError(f"--root-mm = {root:g}; allowed: {allowed}")

    def misfit(ball: float) -> float:
        beyond = abs(math.log(ball / usual))
        if root is not None or not (sizes.turns and (sizes.rating_n or sizes.static_rating_n)):
            return abs(math.log(ball / depth)) + weight * beyond
        try:
            ratios = rating_ratios(_screw(sizes, like, ball)[0]).values()
        except ValueError:  # the grooves meet
            return math.inf
        return sum(math.log(ratio) ** 2 for ratio in ratios) / len(ratios) + RATING_WEIGHT * beyond**2

    return min(BALLS, key=misfit)


def check_rating_units(sizes: CatalogueSizes, like: Parameters) -> None:
    """Refuse ratings that are far below those of a screw of this size, and near them in another unit: ValueError."""
    usual = sizes._replace(rating_n=None, static_rating_n=None)
    screw, _ = _screw(usual, like, _ball(usual, like))
    for option, stated, computed in (
        ("--rating-n", sizes.rating_n, computed_dynamic_rating(screw)),
        ("--static-rating-n", sizes.static_rating_n, computed_static_rating(screw)),
    ):
        if stated is None or not computed / stated > SUSPECT:
            continue
        meant = {unit: stated * newtons for unit, newtons in RATING_UNITS.items()}
        if has_inches(sizes.lead_mm):
            of_inches = rating_of_inches(stated * RATING_UNITS["lbf"], sizes.lead_mm)
            meant["lbf for a million inches of travel"] = of_inches
        unit = min(meant, key=lambda name: abs(math.log(computed / meant[name])))
        smaller = ", or state the ball (--ball-mm) if it is smaller than usual" * (sizes.ball_mm is None)
        raise ValueError(
            f"{option} = {stated:g}; usual is {computed:.3g} N; allowed: N, for a million turns; {stated:g} {unit} are "
            f"{option} {meant[unit]:.5g}{smaller}"
        )


def has_inches(lead_mm: float) -> bool:
    """Whether a lead is of inches: metric ones are multiples of 0.5 mm."""
    return abs(2.0 * lead_mm - round(2.0 * lead_mm)) > 0.02


def rating_of_inches(rating: float, lead_mm: float) -> float:
    """Rating [N] for a million turns of one for a million inches of travel, as inch catalogues state it.

    Life L = (C/F)^3 in millions: of inches it is L/lead in turns, so C_turns = C_inches (lead/1 in)^(-1/3).
    """
    return rating * (1e-3 * abs(lead_mm) / INCH) ** (-1.0 / 3.0)


def rating_ratios(screw: ScrewParameters) -> dict[str, float]:
    """Computed over stated ratings of a screw.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry and stated ratings.

    Returns
    -------
    dict of str to float
        Ratios by field, of the ratings that the screw file states.

    Notes
    -----
    Ratings by physics.rating, after ISO 3408-5.

    Examples
    --------
    >>> from ballscrew_tehl.parameters.file import changed, load_screw
    >>> ratios = rating_ratios(changed(load_screw(), screw={"dynamic_rating": 20e3}).screw)
    >>> list(ratios)
    ['dynamic_rating']
    """
    laws = {"dynamic_rating": computed_dynamic_rating, "static_rating": computed_static_rating}
    stated = {name: getattr(screw, name) for name in laws}
    return {name: laws[name](screw) / value for name, value in stated.items() if value is not None}
