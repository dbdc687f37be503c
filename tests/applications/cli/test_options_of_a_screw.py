"""Options of a screw file through torque, preload, interval, screw and page: each changes what follows from it by a
closed form or a sum, and nothing else. Files are those of init."""

import json
import re

import pytest

from ballscrew_fmu.command import main as ballscrew
from ballscrew_tehl import load_screw
from ballscrew_tehl.applications.cli.main import main
from ballscrew_tehl.physics.rating import catalogue_preload

pytestmark = pytest.mark.slow
POINT = {"speed-rpm": "500", "temperature-c": "30"}
PRELOAD = 2000.0
#: entries that take the place of one of the file of init, or are added to the table screw
OPTIONS = {
    "none": {}, "seals": {"seal_torque_Nm": "0.05"}, "hand": {"hand": '"left"'}, "starts": {"starts": "2"},
    "ratings": {"dynamic_rating_N": "30000.0", "static_rating_N": "60000.0"}, "spacers": {"spacer_balls": "true"},
    "clearance": {"preload_kind": '"single_nut_offset"'},
    "hybrid": {"ball_material": '"silicon_nitride"'}, "stainless": {"thermal_conductivity_W_mK": "24.0"},
}  # fmt: skip

#: keys of torque that an option leaves alone; of screw, whose ratios are compared
UNCHANGED = {
    "seals": ("viscous_torque_nm", "hysteresis_torque_nm", "sliding_torque_nm", "film_thickness_min_m"),
    "ratings": ("friction_torque_nm", "torque_low_nm", "torque_high_nm", "film_thickness_min_m"),
    "hand": ("friction_torque_nm", "torque_low_nm", "torque_high_nm", "contact_pressure_max_pa"),
    "stainless": ("contact_pressure_max_pa", "ball_load_max_n"),
}
RATIOS = "ball_load_max_n", "contact_pressure_max_pa", "static_safety", "life_turns", "static_load_rating_n"


@pytest.fixture(scope="module")
def of(tmp_path_factory):
    """Answers of torque, screw and preload with an option, and its screw."""
    folder, known = tmp_path_factory.mktemp("options"), {}

    def answers(option, capsys):
        if option not in known:
            file = folder / f"{option}.toml"
            words = ["--diameter-mm", "32", "--lead-mm", "20", "--ball-mm", "6.35", "--oil-grade", "68"]
            assert main(["init", str(file), *words]) == 0
            entries, lines = dict(OPTIONS[option]), []
            for line in file.read_text().splitlines():
                key = line.removeprefix("# ").partition(" ")[0]
                lines.append(f"{key} = {entries.pop(key)}" if key in entries else line)
            assert not entries
            file.write_text("\n".join(lines))
            capsys.readouterr()

            def run(command, *words, **options):
                flags = [word for key, value in options.items() for word in (f"--{key}", value)]
                assert main([command, *words, *flags, "--screw", str(file), "--json"]) == 0
                return json.loads(capsys.readouterr().out)

            assert (
                main(["map", "build", "--screw", str(file), "--output", str(folder / f"{option}.npz")]) == 0
            )
            capsys.readouterr()
            at = POINT | {"map": str(folder / f"{option}.npz")}
            torque = run("torque", **at, **{"preload-n": str(PRELOAD)})
            loose = run("torque", **at, **{"preload-n": "0", "axial-load-n": str(PRELOAD)})
            page = folder / f"{option}.html"
            assert ballscrew(["page", "--screw", str(file), "--map", at["map"], "--output", str(page)]) == 0
            capsys.readouterr()
            shown = json.loads(re.search(r'id="about">(.*?)</script>', page.read_text())[1])
            back = run("preload", **at, **{"torque-nm": repr(torque["friction_torque_nm"])})
            known[option] = (
                torque,
                run("screw", **{"preload-n": str(PRELOAD)}),
                back,
                run("screw"),
                load_screw(file),
                loose,
                shown,
            )
        return known[option]

    return answers


@pytest.mark.parametrize("option", OPTIONS)
def test_option_acts_on_what_follows_from_it_alone(of, option, capsys):
    before, before_screw, _, _, base, _, _ = of("none", capsys)
    torque, loaded, back, usual, parameters, loose, page = of(option, capsys)
    screw = parameters.screw
    ratio = {key: loaded[key] / before_screw[key] for key in RATIOS}
    total = {key: torque[f"{key}_torque_nm"] for key in ("friction", "viscous", "hysteresis", "sliding")}
    change = torque["friction_torque_nm"] - before["friction_torque_nm"]
    assert back["preload_n"] == pytest.approx(PRELOAD, rel=1e-3)
    # with clearance one nut carries the load that both have as preload
    both, one = (each["friction_torque_nm"] - screw.seal_torque for each in (torque, loose))
    assert one == pytest.approx(0.5 * both, rel=1e-9)
    assert loose["in_range"]
    assert loose["torque_low_nm"] < loose["friction_torque_nm"] < loose["torque_high_nm"]
    assert page["seal"] == screw.seal_torque
    assert page["lead"] == screw.signed_lead
    assert page["start"]["preload"] == pytest.approx(catalogue_preload(screw), rel=1e-12)
    assert ("seal_torque", "seal") in map(tuple, page["parts"]) or not screw.seal_torque
    assert page["side"] == ("half" if option == "clearance" else "nut")
    assert torque["torque_low_nm"] < total["friction"] < torque["torque_high_nm"]
    parts = total["viscous"] + total["hysteresis"] + total["sliding"]
    assert parts + screw.seal_torque == pytest.approx(total["friction"], rel=1e-12)
    assert usual["preload_n"] == pytest.approx(0.05 * usual["dynamic_load_rating_n"], rel=1e-9)
    if option == "seals":
        for key in ("friction_torque_nm", "torque_low_nm", "torque_high_nm"):
            assert torque[key] - before[key] == pytest.approx(0.05, abs=1e-12)
    elif option == "ratings":
        assert (usual["dynamic_load_rating_n"], loaded["static_load_rating_n"]) == (30000.0, 60000.0)
        assert loaded["static_safety"] == pytest.approx(60000.0 / PRELOAD, rel=1e-12)
        larger = 30000.0 / before_screw["dynamic_load_rating_n"]
        assert ratio["life_turns"] == pytest.approx(larger**3, rel=1e-9)
    elif option == "starts":
        # twice the balls carry the force; C_0a goes as the balls
        balls = screw.loaded_ball_count / base.screw.loaded_ball_count
        assert balls == pytest.approx(2.0, rel=0.02)
        # a longer nut shares the force less evenly
        assert 1.0 / balls < ratio["ball_load_max_n"] < 1.1 / balls
        assert ratio["static_load_rating_n"] == pytest.approx(balls, rel=0.02)
        assert ratio["contact_pressure_max_pa"] == pytest.approx(
            ratio["ball_load_max_n"] ** (1.0 / 3.0), rel=1e-2
        )
    elif option == "spacers":
        balls = screw.loaded_ball_count / base.screw.loaded_ball_count
        assert balls == pytest.approx(0.5, rel=0.05)
        assert ratio["ball_load_max_n"] == pytest.approx(1.0 / balls, rel=0.05)
        assert total["sliding"] < before["sliding_torque_nm"]
        assert "net_sliding_coefficient" not in torque["torque_interval"]
    elif option == "hybrid":
        # E' = 2/((1 - 0.3^2)/206 + (1 - 0.26^2)/310), p_max as (Q E'^2)^(1/3)
        stiffer = 2.0 * (1.0 - 0.3**2) / 206.0 / ((1.0 - 0.3**2) / 206.0 + (1.0 - 0.26**2) / 310.0)
        expected = stiffer ** (2.0 / 3.0) * ratio["ball_load_max_n"] ** (1.0 / 3.0)
        assert ratio["contact_pressure_max_pa"] == pytest.approx(expected, rel=1e-3)
    elif option == "stainless":
        assert torque["film_temperature_rise_k"] > before["film_temperature_rise_k"]
        assert abs(change) < 0.02 * before["friction_torque_nm"]
    unchanged = UNCHANGED.get(option, ())
    assert [torque[key] for key in unchanged] == pytest.approx([before[key] for key in unchanged], rel=1e-12)
    if option in ("seals", "hand", "stainless"):
        assert loaded == {**before_screw, "screw": loaded["screw"]}
    assert screw.signed_lead == (-0.02 if option == "hand" else 0.02)
