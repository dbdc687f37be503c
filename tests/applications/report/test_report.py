"""The report: its numbers are those of the commands, its figures those of the map, its page opens alone."""

import base64
import re

import pytest
from command_line import answer

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", ["of_packaged", "of_own"])
def test_page_opens_alone_and_its_pictures_are_complete(request, name):
    report = request.getfixturevalue(name)
    page, text = report.page, report.text
    assert report.answer["figures"] == len(page.images) == 4
    assert text.isascii()
    assert len(text) < 1e6
    assert not page.names & {"script", "link", "iframe", "object", "embed"}
    outside = re.sub(r'src="data:[^"]*"', "", text)
    assert not re.search(r"https?:|url\(|@import|//[a-z]|Markup", outside)
    assert all(link[1:] in page.ids for link in page.links)
    assert len(page.ids) == len(set(page.ids))
    for image in page.images:
        kind, data = re.fullmatch(r"data:image/(svg\+xml);base64,(.+)", image["src"]).groups()
        assert base64.b64decode(data, validate=True).rstrip().endswith(b"</svg>"), kind
        assert image["alt"]
    if name == "of_own":
        # names of a file are text
        assert "a &lt;b&gt; &amp; c" in text
        assert report.answer["screw"] == "a <b> & c"
    # not for a reader of this page
    shown = page.text
    assert not re.search(r"[0-9a-f]{12}|Zhou|NSK|\bnan\b|None|contact_cell|sampling_error", shown)
    cautions = [line for line in shown.splitlines() if len(line) > 60]
    assert len(cautions) == len(set(cautions))


def test_headline_is_that_of_the_commands(of_own, own_words, capsys):
    place = "--preload-n", 820, "--temperature-c", 35, "--speed-rpm"
    said, slow = (answer(capsys, "torque", *own_words, *place, rpm)[0] for rpm in (800, 100))
    screw = answer(capsys, "screw", *own_words, "--preload-n", 820)[0]
    numbers, texts = zip(*re.findall(r"<b>(.*?)</b><span>(.*?)</span>", of_own.text), strict=True)
    release = f"{screw['separation_load_n']:.0f}"
    assert numbers == (
        f"{said['friction_torque_nm']:#.3g} N m", f"{said['catalogue_torque_nm']:#.3g} N m",
        f"{said['lambda_ratio']:.2f}", f"{1e-6 * screw['axial_stiffness_n_per_m']:.0f} N/um", f"{release} N",
    )  # fmt: skip
    assert f"interval {said['torque_low_nm']:#.3g} to {said['torque_high_nm']:#.3g}" in texts[0]
    assert texts[1].endswith(f"computed at 100 r/min and 35.0 C: {slow['friction_torque_nm']:#.3g} N m")
    assert of_own.page.tables["loads"][3][0] == release


def test_tables_are_those_of_the_commands(of_own, own_words, capsys):
    tables = of_own.page.tables

    def at(command, preload, *words):
        return answer(capsys, command, *own_words, "--preload-n", preload, *words)[0]

    warm = "--temperature-c", "35"
    assert tables["torques"][0][2:] == [f"{rpm} r/min" for rpm in (100, 500, 800, 1000, 2500)]
    for preload, catalogue, *cells in tables["torques"][1:]:
        said = [at("torque", preload, "--speed-rpm", rpm, *warm) for rpm in (100, 500, 800, 1000, 2500)]
        assert cells == [
            f"{one['friction_torque_nm']:#.3g} ({one['torque_low_nm']:#.3g} to {one['torque_high_nm']:#.3g})"
            for one in said
        ]
        assert catalogue == f"{said[0]['catalogue_torque_nm']:#.3g}"
    keys = (
        ("axial_load_n", 1.0), ("ball_load_max_n", 1.0), ("contact_pressure_max_pa", 1e-9), ("static_safety", 1.0),
        ("life_turns", 1e-6), ("axial_stiffness_n_per_m", 1e-6), ("efficiency", 1e2), ("efficiency_backdriving", 1e2),
    )  # fmt: skip
    for cells, case in zip(tables["loads"][1:], of_own.numbers.cases, strict=True):
        said = at("screw", 820, "--axial-load-n", repr(case.axial_load), "--speed-rpm", 800, *warm)
        for cell, (key, factor) in zip(cells, keys, strict=True):
            if cell == "-":
                assert key not in said
            elif cell == "outside the map":
                assert not said["in_range"]
            else:
                assert float(cell) == pytest.approx(factor * said[key], rel=5e-3), key
    names = [f"film_thickness_{name}" for name in ("central_screw_m", "central_nut_m", "min_m")]
    assert [row[0] for row in tables["films"][1:]] == ["10.0", "35.0", "40.0"]
    for celsius, _, *cells in tables["films"][1:]:
        said = at("torque", 820, "--speed-rpm", 800, "--temperature-c", celsius)
        films = [f"{1e9 * said[name]:.1f}" for name in names]
        assert cells == [*films, f"{said['lambda_ratio']:.2f}", f"{said['film_temperature_rise_k']:.2f}"]
