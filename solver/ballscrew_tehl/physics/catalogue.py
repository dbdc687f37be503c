"""A screw from what a page of a catalogue states; what is not stated is assumed."""

import math
from typing import Any, NamedTuple

from pydantic import ValidationError

from ..parameters.file import Parameters, ScrewParameters
from ..parameters.screw import ROOT_OF_BALL
from .rating import computed_dynamic_rating, computed_static_rating

#: diameters of balls that are made [mm]
BALLS = (
    0.8, 1.0, 1.2, 1.588, 2.0, 2.381, 3.175, 3.969, 4.763, 5.556, 6.35, 7.144, 7.938, 9.525, 12.7, 15.875, 19.05,
)  # fmt: skip
#: ball over lead of one start and over nominal diameter, pitch circle beyond the latter over ball
BALL_OF_LEAD, BALL_OF_DIAMETER, BEYOND = 0.635, 0.2, 0.27
#: nominal diameter minus root diameter, over ball; weight of BALL_OF_LEAD where the root diameter is stated
ROOT_DEPTH, LEAD_WEIGHT = 0.82, 0.3
#: loaded turns of a nut with one start; of each start of several
USUAL_TURNS, TURNS_OF_A_START = 3.0, 1.5
#: groove radius over ball, assumed; ends of what follows from a stated rating
USUAL_CONFORMITY, CONFORMITIES = 0.53, (0.515, 0.56)


class CatalogueSizes(NamedTuple):
    """What a catalogue page states of a screw [mm, N]; None: assumed."""

    diameter_mm: float
    lead_mm: float  # negative: left-hand
    ball_mm: float | None = None
    turns: float | None = None
    starts: int = 1
    root_mm: float | None = None
    rating_n: float | None = None
    static_rating_n: float | None = None
    nut_kind: str | None = None
    hand: str | None = None


def catalogue_parameters(sizes: CatalogueSizes, like: Parameters) -> tuple[Parameters, frozenset[str]]:
    """A screw of these sizes, the rest as of another one, and names of its fields that are assumed.

    With the root diameter ball and pitch circle follow from it. With C_a, turns, and ball or root the conformity of the
    grooves follows: C_a goes with (1 - 1/(2 f))^-0.41 of the conformity f.
    """
    ball, screw = _ball(sizes), None
    circle = sizes.diameter_mm + BEYOND * ball if sizes.root_mm is None else sizes.root_mm + ROOT_OF_BALL * ball
    several = TURNS_OF_A_START if sizes.starts > 1 else USUAL_TURNS
    given: dict[str, Any] = {
        "hand": sizes.hand, "starts": None if sizes.starts == 1 else sizes.starts,
        "root_diameter": sizes.root_mm and 1e-3 * sizes.root_mm,
        "dynamic_rating": sizes.rating_n, "static_rating": sizes.static_rating_n,
    }  # fmt: skip
    known = sizes.rating_n and sizes.turns and (sizes.ball_mm or sizes.root_mm)
    conformity = USUAL_CONFORMITY
    try:
        if sizes.root_mm is not None and not abs(circle - sizes.diameter_mm) <= 0.5 * ball:
            raise ValueError("a root diameter that belongs to another nominal diameter or ball")
        for _ in range(2 if known else 1):
            groove = 1e-3 * conformity * ball
            screw = ScrewParameters(
                preload_kind=sizes.nut_kind or "double_nut", nominal_radius=0.5e-3 * circle,
                ball_diameter=1e-3 * ball, contact_angle=math.radians(45.0), screw_raceway_radius=groove,
                nut_raceway_radius=groove, lead=1e-3 * sizes.lead_mm, turns=sizes.turns or several,
                youngs_modulus=like.screw.youngs_modulus, poisson_ratio=like.screw.poisson_ratio,
                **{name: value for name, value in given.items() if value is not None},
            )  # fmt: skip
            if sizes.rating_n:
                excess = computed_dynamic_rating(screw) / sizes.rating_n
                conformity = 0.5 / (1.0 - min((1.0 - 0.5 / conformity) * excess ** (1.0 / 0.41), 0.4))
                conformity = min(max(conformity, CONFORMITIES[0]), CONFORMITIES[1])
    except ValueError as error:
        shown = ", ".join(f"{name} = {value}" for name, value in sizes._asdict().items() if value)
        if isinstance(error, ValidationError):
            problem = error.errors()[0]
            error = ValueError(".".join((*map(str, problem["loc"]), problem["msg"].removeprefix("Value error, "))))
        raise ValueError(f"no screw has {shown}: {error}") from error
    assert screw is not None
    stated = {"lead", "hand", "starts", "root_diameter", "dynamic_rating", "static_rating"}
    others = {"ball_diameter": sizes.ball_mm, "turns": sizes.turns, "preload_kind": sizes.nut_kind}
    stated |= {field for field, value in others.items() if value}
    name = f"screw {sizes.diameter_mm:g}x{abs(sizes.lead_mm):g}"
    return like.model_copy(update={"name": name, "screw": screw}), frozenset(screw.model_fields_set - stated)


def _ball(sizes: CatalogueSizes) -> float:
    """Ball diameter [mm]: stated, or the one that is made nearest to what root diameter, lead and diameter leave."""
    if sizes.ball_mm is not None:
        return sizes.ball_mm
    usual = min(BALL_OF_LEAD * abs(sizes.lead_mm) / sizes.starts, BALL_OF_DIAMETER * sizes.diameter_mm)
    if sizes.root_mm is None:
        return min(BALLS, key=lambda ball: abs(math.log(ball / usual)))
    depth = (sizes.diameter_mm - sizes.root_mm) / ROOT_DEPTH
    if not depth > 0.0:
        raise ValueError(f"--root-mm = {sizes.root_mm:g}; allowed: less than --diameter-mm = {sizes.diameter_mm:g}")
    return min(BALLS, key=lambda ball: abs(math.log(ball / depth)) + LEAD_WEIGHT * abs(math.log(ball / usual)))


def rating_ratios(screw: ScrewParameters) -> dict[str, float]:
    """Computed over stated ratings, of those that the screw file states, by their fields."""
    pairs = {
        "dynamic_rating": (computed_dynamic_rating, screw.dynamic_rating),
        "static_rating": (computed_static_rating, screw.static_rating),
    }
    return {name: computed(screw) / stated for name, (computed, stated) in pairs.items() if stated is not None}
