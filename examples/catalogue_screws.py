"""Ten screws of catalogues: screw files from sizes, root diameter and ratings, and the ratings computed over stated.

The rows of examples/screws/catalogue.csv state the origin of their numbers. One number, the groove radius over the
ball, is fitted to both ratings. C_a over C_0a is 0.35 to 0.47 by ISO 3408-5; Rexroth states 0.54 and 0.58.

    python examples/catalogue_screws.py [FOLDER]      # writes the screw files
"""

import csv
import sys
from pathlib import Path

from ballscrew_tehl.applications.catalogue import CatalogueSizes, catalogue_parameters, rating_ratios
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.template import example_parameters, screw_template
from ballscrew_tehl.parameters.units import turns_of

TABLE = Path(__file__).parent / "screws" / "catalogue.csv"


def main(folder: Path | None = None) -> list[tuple[dict[str, str], Parameters, dict[str, float]]]:
    """Rows of the table, their screws and their ratios; folder: where to write the screw files."""
    results, numbers = [], set(CatalogueSizes._fields) - {"nut_kind", "starts"}
    for row in csv.DictReader(TABLE.read_text(encoding="utf-8").splitlines()):
        sizes = {name: float(turns_of(row[name])) for name in numbers if row.get(name)}
        stated = CatalogueSizes(**sizes, starts=int(row["starts"]), nut_kind=row["nut_kind"])
        screw, assumed = catalogue_parameters(stated, example_parameters("iso_vg"))
        screw = screw.model_copy(update={"name": f"{row['maker']} {row['designation']}"})
        if folder is not None:
            text = f"# {row['origin']}\n{screw_template(screw, assumed)}"
            (folder / f"{screw.name.replace(' ', '_')}.toml").write_text(text, encoding="utf-8")
        results.append((row, screw, rating_ratios(screw.screw)))
    return results


if __name__ == "__main__":
    print(f"{'screw':<38}{'ball [mm]':>10}{'groove':>8}{'C_a':>6}{'C_0a':>6}   origin")
    for row, parameters, ratios in main(Path(sys.argv[1]) if sys.argv[1:] else None):
        ball, groove = parameters.screw.ball_diameter, parameters.screw.screw_raceway_radius
        print(f"{parameters.name:<38}{1e3 * ball:>10.3f}{groove / ball:>8.3f}{ratios['dynamic_rating']:>6.2f}"
              f"{ratios['static_rating']:>6.2f}   {row['origin'].split(':')[0]}")  # fmt: skip
