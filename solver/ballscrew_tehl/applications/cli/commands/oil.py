"""The command `oil`: an oil over temperature, by its grade or from a screw file, with the assumptions."""

from argparse import Namespace

from ballscrew_tehl._version import __version__
from ballscrew_tehl.parameters import mineral_oil
from ballscrew_tehl.parameters.file import LubricantParameters, graded_oil, load_screw
from ballscrew_tehl.parameters.units import CELSIUS
from ballscrew_tehl.physics import lubricant

from ..shared.output import Answer, table

TEMPERATURES_C = (20.0, 40.0, 60.0, 80.0, 100.0)
HEADS = ("T [C]", "nu [mm2/s]", "eta [mPa s]", "rho [kg/m3]", "alpha [1/GPa]", "So & Klaus", "AGMA 925")


def oil_rows(oil: LubricantParameters) -> list[dict[str, float]]:
    """Viscosities, density and pressure-viscosity coefficient at TEMPERATURES_C, for a grade also by other rules."""
    points = oil.astm_viscosity_1, oil.astm_temperature_1, oil.astm_viscosity_2, oil.astm_temperature_2
    rows = []
    for celsius in TEMPERATURES_C:
        T = celsius + CELSIUS
        eta, rho = float(lubricant.eta0(oil, T)), float(lubricant.ambient_density(oil, T))
        row = {
            "temperature_c": celsius, "kinematic_viscosity_mm2_s": 1e6 * eta / rho, "viscosity_mpas": 1e3 * eta,
            "density_kg_m3": rho, "alpha_per_gpa": 1e9 * float(lubricant.pressure_viscosity(oil, T)),
        }  # fmt: skip
        if oil.iso_vg is not None:
            slope = mineral_oil.slope_d341(*(float(value) for value in points if value is not None))
            row["so_klaus_per_gpa"] = 1e9 * mineral_oil.so_klaus(eta / rho, rho, slope)
            row["agma_925_per_gpa"] = 1e9 * mineral_oil.agma_925(eta)
        rows.append(row)
    return rows


def assumptions(oil: LubricantParameters) -> list[str]:
    """Values derived from the grade, with their errors; empty without a grade."""
    if oil.iso_vg is None or oil.viscosity_index is None or oil.density_15c is None:
        return []
    low, high = ((1.0 + sign * mineral_oil.GRADE_TOLERANCE) * oil.iso_vg for sign in (-1.0, 1.0))
    lines = {
        "iso_3448": f"viscosity at 40 C: the number of the grade; an oil of it may have {low:g} to {high:g} mm2/s "
        "(ISO 3448)",
        "astm_d2270": "viscosity at 100 C: from the index (ASTM D2270); at other temperatures by ASTM D341",
        "astm_d1250": "density over temperature: ASTM D1250, linear, within 0.1 % of it from 10 to 100 C",
        "density_15c": f"density at 15 C: {oil.density_15c:.1f} kg/m3, a paraffinic oil (ASTM D2501): +-2 %",
        "pressure_viscosity": f"alpha: exponent Z = {oil.z_roelands:.3f} of Roelands from both viscosities; "
        f"{100.0 * mineral_oil.Z_ERROR_RMS:.0f} % rms, {100.0 * mineral_oil.Z_ERROR_MAX:.0f} % at most off measured "
        "mineral oils. For comparison: So & Klaus 1980 and AGMA 925",
        "specific_heat": f"specific heat {oil.specific_heat:.0f} J/(kg K): Cragoe 1929, some 5 %, taken as constant",
        "thermal_conductivity": f"thermal conductivity {oil.thermal_conductivity:.4f} W/(m K): Cragoe 1929, some 10 %, "
        "taken as constant",
    }
    if oil.viscosity_index > mineral_oil.MINERAL_INDEX and "pressure_viscosity" not in oil.model_fields_set:
        lines["synthetic"] = (
            f"an index above {mineral_oil.MINERAL_INDEX:g} means a synthetic oil or an improver: alpha is not known "
            "for it, give pressure_viscosity"
        )
    return [line for field, line in lines.items() if field not in oil.model_fields_set]


def run_oil(args: Namespace) -> Answer:
    """One oil over temperature."""
    grade = args.iso_vg, args.viscosity_index
    if args.screw is not None:
        if (*grade, args.density_15c_kg_m3) != (None, None, None):
            raise ValueError("--screw; allowed: alone, or --iso-vg with --viscosity-index: give one oil")
        oil = load_screw(args.screw).lubricant
    elif None in grade:
        raise ValueError("--iso-vg, --viscosity-index (missing); allowed: both, or --screw FILE.toml")
    else:
        oil = graded_oil(*grade, args.density_15c_kg_m3)
    rows, assumed = oil_rows(oil), assumptions(oil)
    result = {
        "oil": oil.name, "iso_vg": oil.iso_vg, "viscosity_index": oil.viscosity_index,
        "density_15c_kg_m3": oil.density_15c, "z_roelands": oil.z_roelands, "rows": rows,
        "specific_heat_j_kgk": oil.specific_heat, "thermal_conductivity_w_mk": oil.thermal_conductivity,
        "assumed": assumed, "version": __version__,
    }  # fmt: skip
    cells = [[f"{value:.4g}" for value in row.values()] for row in rows]
    lines = [oil.name, "", table(HEADS[: len(cells[0])], cells)]
    if assumed:
        lines += ["", "assumed:", *(f"- {line}" for line in assumed)]
        lines += ["", "For the screw file:", "[lubricant]", f'name = "{oil.name}"', f"iso_vg = {oil.iso_vg}"]
        lines.append(f"viscosity_index = {oil.viscosity_index:g}")
        if "density_15c" in oil.model_fields_set:
            lines.append(f"density_15c_kg_m3 = {oil.density_15c:g}")
    return Answer([result], text="\n".join(lines))
