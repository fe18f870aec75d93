"""Pages of studies and comparisons in a browser: tables sort and filter, figures tell cases, nothing overlaps."""

import json
from pathlib import Path

import pytest
from present.browser import needs_chromium, visit

import prb3r

ROOT = Path(__file__).parents[2]
DESIGNS = f"""
name = "designs"
title = "Which stiffness?"
question = "Four designs under three tensions of friction."
manipulator = "{ROOT}/studies/manipulators/two-segment.toml"
states = "path"
[[factor]]
name = "thickness_ratio"
ratio = ["segment.1.thickness_m", "segment.2.thickness_m"]
values = [1.0, 1.1, 1.2, 1.3, 1.4, 1.5]
[[factor]]
name = "mu"
path = "friction.coefficient"
values = [0.1, 0.3]
[[step]]
cable_1_n = 20
[[step]]
cable_1_n = 40
[[step]]
cable_1_n = 60
[[metric]]
kind = "position"
[[plot]]
name = "tips"
kind = "lines"
caption = "The tip over the ratio."
where = {{ mu = 0.3 }}
x = "thickness_ratio"
y = ["tip_y_m"]
[[plot]]
name = "bent"
kind = "shapes"
where = {{ mu = 0.3 }}
by = "thickness_ratio"
[designs]
factors = ["thickness_ratio"]
[[requirement]]
metric = "tip_y_m"
at_least = 0.01
[[preference]]
metric = "tip_y_m"
better = "greater"
[[preference]]
metric = "tip_x_m"
better = "less"
"""
CLOUD = f"""
name = "cloud"
title = "Where the tip comes"
manipulator = "{ROOT}/studies/manipulators/two-segment.toml"
states = "path"
state_disks = [14]
broken = ["2"]
[cloud]
count = 2048
tension_n = {{ 1 = 60.0, 2 = 60.0, 3 = 60.0 }}
[[metric]]
kind = "workspace"
cell = 0.02
[[plot]]
name = "region"
kind = "workspace"
"""
RIGS = f"""
name = "rigs"
title = "Which error matters?"
manipulator = "{ROOT}/studies/manipulators/two-segment.toml"
states = "none"
[[factor]]
name = "thickness_1_error_m"
added_to = "segment.1.thickness_m"
normal = {{ sd = 9.6e-6 }}
[[factor]]
name = "mu"
path = "friction.coefficient"
normal = {{ mean = 0.3, sd = 0.05, low = 0.0 }}
[sampling]
method = "saltelli"
count = 32
[[step]]
cable_1_n = 50
[[metric]]
kind = "position"
[[requirement]]
metric = "tip_y_m"
at_least = 0.1
"""
WAY = f"""
name = "way"
title = "A way"
manipulator = "{ROOT}/studies/manipulators/two-segment.toml"
states = "path"
[reach]
disk = "tip"
target = [{{ x_m = 0.45, y_m = 0.1 }}, {{ x_m = 0.9, y_m = 0.2 }}]
[[metric]]
kind = "follow"
[[plot]]
name = "path"
kind = "path"
"""
ACTS = (Path(__file__).parent / "acts.js").read_text()


@pytest.fixture(scope="module")
def visited(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    pages = {}
    for name, text in (("designs", DESIGNS), ("cloud", CLOUD), ("rigs", RIGS), ("way", WAY)):
        (folder / f"{name}.toml").write_text(text)
        pages[name] = prb3r.run_study(folder / f"{name}.toml", output=folder / "results").folder / "report.html"
    prb3r.compare(pages["designs"].parent).report(folder / "results" / "compared")
    pages["compared"] = folder / "results" / "compared" / "report.html"
    return pages, *visit(pages, folder, ACTS)


pytestmark = needs_chromium


def test_nothing_lies_on_another_and_the_console_is_silent(visited):
    _, found, console = visited
    assert console == []
    assert len(found) == 10
    assert {page: kept["wrong"] for page, kept in found.items() if kept["wrong"]} == {}


def numbers(texts):
    return [float(text.replace("−", "-").replace(",", "")) for text in texts]


@pytest.mark.parametrize("width", [400, 1400])
def test_tables_sort_by_number_both_ways_and_filter(visited, width):
    found = visited[1][f"designs {width}"]["found"]
    assert found["up"][0] == "ascending"
    assert found["down"][0] == "descending"
    values = numbers(found["before"])
    assert numbers(found["up"][1]) == sorted(values)
    assert numbers(found["down"][1]) == sorted(values, reverse=True)
    assert found["less"] == [["0.1"] * 6, "6 of 12 rows"]
    assert found["none"] == []
    assert found["again"] == 12


@pytest.mark.parametrize("width", [400, 1400])
@pytest.mark.parametrize("page", ["designs", "cloud", "compared"])
def test_pointing_at_a_place_tells_its_case(visited, page, width):
    figures = visited[1][f"{page} {width}"]["found"]["figures"]
    assert {figure["name"] for figure in figures} == {
        "designs": {"decision-front", "tips", "bent"},
        "cloud": {"region"},
        "compared": {"comparison-front"},
    }[page]
    for figure in figures:
        assert figure["hint"].startswith("Point at a place of the figure")
        assert figure["pointed"].startswith(figure["words"])
        assert figure["second"] != figure["first"] != figure["hint"]
        assert figure["drawn"]


def test_the_manipulator_is_drawn_at_scale_where_it_is(visited):
    """Drawn in the figure, the tip is at the place that is pointed at: the last point of the outline."""
    for page, name in (("designs", "bent"), ("cloud", "region")):
        figures = visited[1][f"{page} 1400"]["found"]["figures"]
        (figure,) = [figure for figure in figures if figure["name"] == name]
        outline = figure["drawn"].replace("M", " M").replace("L", " L").split(" M")[1:]
        x, y = map(float, outline[-1].split(" ")[:2])
        picture = json.loads(visited[0][page].read_text().split('id="pointed">')[1].split("</script>")[0])
        ratio = picture["figures"][name]["ratio"]
        assert (x / 1000, y / (1000 * ratio)) == pytest.approx((figure["x"], figure["y"]), abs=2e-3)
        assert outline[0] != outline[-1]


def test_of_very_many_places_some_tell_and_the_page_says_so(visited):
    (figure,) = visited[1]["cloud 1400"]["found"]["figures"]
    assert figure["all"] == 2048
    assert figure["told"] < 2048
    assert "Of 2,048 places" in figure["hint"]
    assert "Pulled: " in figure["pointed"] or "No cable" in figure["pointed"]
    assert "cable 2" not in figure["pointed"].split("Pulled")[-1]


def test_a_load_path_is_played(visited):
    assert visited[1]["designs 400"]["found"]["played"][:2] == ["2", True]
    assert visited[1]["designs 400"]["found"]["played"][2].startswith("Step 3 of 3. Pulled: cable 1: 60 N")


def test_what_lies_on_another_would_be_seen(tmp_path):
    page = tmp_path / "bad.html"
    text = '<!doctype html><body><p style="width: 700px">wide</p><p style="margin-bottom: -3em">one</p><p>two</p>'
    page.write_text(f"{text}<script>missing()</script></body>")
    found, console = visit({"bad": page}, tmp_path)
    assert any(what.startswith("overlap: P one and P two") for what in found["bad 400"]["wrong"])
    assert any(what.startswith("scrolls sideways") for what in found["bad 400"]["wrong"])
    assert not any("wide" in what for what in found["bad 1400"]["wrong"])
    assert "missing is not defined" in console[0]
