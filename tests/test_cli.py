"""The command line: exit codes, streams, messages; what a user meets first."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from command import PROTOTYPE, ROOT, prb3r, process

from prb3r import load_manipulator, solve


@pytest.fixture
def steps(tmp_path):
    path = tmp_path / "steps.csv"
    path.write_text("sequence,step,cable_3_kg,cable_1_kg,slip_3\na,1,10,0,-1\na,2,10,2.5,1\n")
    return path


def test_solve_writes_a_table_to_stdout_or_to_a_file(steps, tmp_path):
    done = prb3r("solve", PROTOTYPE, steps)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("sequence,step,disk,x_m,y_m,angle_rad,outcome\na,1,0,-0.002,0.0,0.0,converged\n")
    assert len(done.stdout.splitlines()) == 1 + 2 * 15
    done = prb3r("solve", PROTOTYPE, steps, "--model", "elastica", "-o", tmp_path / "m.parquet")
    assert done.returncode == 0, done.stderr
    tip = pd.read_parquet(tmp_path / "m.parquet").iloc[-1]
    assert (tip["x_m"], tip["y_m"]) == pytest.approx((0.4091, -0.2182), abs=2e-4)


def test_a_load_without_equilibrium_exits_with_1_and_says_so(steps):
    steps.write_text("sequence,step,cable_1_n\na,1,10\na,2,1000000\na,3,10\n")
    done = process("solve", PROTOTYPE, steps)
    assert done.returncode == 1
    assert "1 of 3 steps have no stable equilibrium" in done.stderr
    assert "1 after them is reached by leaving them out" in done.stderr
    assert done.stdout.splitlines()[-1].endswith("detour")


def test_bad_input_is_refused_with_its_place_and_the_remedy(steps, tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text(
        PROTOTYPE.read_text().replace("clamp_m = 0.008", "clamp_mm = 8", 1).replace("plates = 7", "plates = 0", 1)
    )
    done = prb3r("solve", bad, steps)
    assert done.returncode == 2
    assert "unknown key 'clamp_mm': lengths are given in metres, as 'clamp_m'" in done.stderr
    assert "segment.1.plates: must be at least 1, not 0" in done.stderr
    assert "Traceback" not in done.stderr
    steps.write_text("sequence,step,cable_9_n\na,1,10\n")
    done = prb3r("solve", PROTOTYPE, steps)
    assert done.returncode == 2
    assert "cable_9_n: unknown column: there is no cable 9; the manipulator has the cables 1, 2, 3, 4" in done.stderr
    assert prb3r("run", tmp_path / "none.toml").returncode == 2
    assert prb3r("solve", PROTOTYPE, tmp_path / "none.csv").returncode == 2
    assert prb3r("frobnicate").returncode == 2


def test_check_says_what_files_are_and_all_that_is_wrong(steps, tmp_path):
    done = prb3r("check", PROTOTYPE, ROOT / "studies/workspace.toml", steps)
    assert done.returncode == 0, done.stderr
    assert "2 segments, 14 plates, 4 cables, 0.476 m long" in done.stdout
    assert "study of 12 cases" in done.stdout
    wishes = tmp_path / "wishes.toml"
    wishes.write_text('[[requirement]]\nmetric = "safety_factor"\nat_least = 1.5\n')
    assert "1 requirement, 0 preferences for `prb3r compare" in prb3r("check", wishes).stdout
    one, two = tmp_path / "one.toml", tmp_path / "two.toml"
    one.write_text("name = \n")
    two.write_text('name = "x"\nyoungs_modulus_pa = nan\n')
    done = prb3r("check", one, two)
    assert done.returncode == 2
    assert "not valid TOML" in done.stderr
    assert "nan is not allowed" in done.stderr


def test_times_that_do_not_grow_are_refused_by_every_command_that_reads_steps(tmp_path):
    folder = shutil.copytree(ROOT / "studies/recordings/bench-example", tmp_path / "timed")
    header, *rows = (folder / "steps.csv").read_text().splitlines()
    timed = [f"{header},time_s", *(f"{row},{60 * k}" for k, row in enumerate(rows))]
    (folder / "steps.csv").write_text("\n".join(timed))
    assert prb3r("check", folder).returncode == 0
    (folder / "steps.csv").write_text("\n".join([*timed[:3], timed[3].rsplit(",", 1)[0] + ",30", *timed[4:]]))
    for command in (("check", folder), ("diagnose", folder), ("solve", PROTOTYPE, folder / "steps.csv")):
        done = prb3r(*command)
        assert done.returncode == 2
        assert "is not later than the one before it (row 3); times grow" in done.stderr


def test_check_sums_a_recording_up_with_every_remark_or_refuses_it_with_every_problem(tmp_path):
    example = ROOT / "studies/recordings/bench-example"
    done = prb3r("check", example, example / "recording.toml")
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 2 * 3
    assert "recording, 6 sequences, 42 steps, 1713 readings (567 x_m, 577 y_m, 569 angle_rad) of disks" in done.stdout
    assert "positions within 0.0003 m, angles within 0.005 rad, tensions within 0.3 %" in done.stdout
    assert "  30 of 1743 cells of markers.csv are empty: not read" in done.stdout
    folder = shutil.copytree(example, tmp_path / "bad")
    (folder / "steps.csv").unlink()
    (folder / "recording.toml").write_text('name = "bad"\nmanipulator = "manipulator.toml"\n[measurement]\n')
    done = prb3r("check", folder, example)
    assert done.returncode == 2
    assert "no steps.csv or steps.parquet" in done.stderr
    assert "recording.toml:3 measurement: 'position_sd_m' is missing, but the markers record x_m and y_m" in done.stderr
    assert "6 sequences" in done.stdout


def test_check_says_that_history_ignores_declared_slips(steps, tmp_path):
    history = tmp_path / "history.toml"
    text = PROTOTYPE.read_text()
    assert text.count("[friction]\n") == 1
    history.write_text(text.replace("[friction]\n", '[friction]\ndirection = "history"\n'))
    done = prb3r("check", history, steps, ROOT / "studies/loading-order.toml")
    assert done.returncode == 0, done.stderr
    assert "table of 2 steps in 1 sequence\n  slip_3 ignored: friction follows the cables' own travel" in done.stdout
    assert "study of 52 cases\n  slip_3 ignored" in done.stdout
    assert "slip_1 ignored: friction follows the cables' own travel (history), in 13 of them" in done.stdout
    assert "ignored" not in prb3r("check", PROTOTYPE, steps).stdout
    steps.write_text("sequence,step,cable_1_n\na,1,10\na,2,5\nb,1,2\n")
    late = (
        "cable 1 is let go, and slip_1 says drawn in (-1) throughout, as it is understood where there is no such column"
    )
    assert late in prb3r("check", PROTOTYPE, steps).stdout
    assert late in prb3r("solve", PROTOTYPE, steps).stderr
    assert late not in prb3r("check", history, steps).stdout
    for held in ("a,2,0", "a,2,20", "b,2,5"):
        steps.write_text(f"sequence,step,cable_1_n\na,1,10\n{held}\n")
        assert "let go" not in prb3r("check", PROTOTYPE, steps).stdout
    steps.write_text("sequence,step,cable_9_n\na,1,10\n")
    done = prb3r("check", PROTOTYPE, steps)
    assert done.returncode == 2
    assert "cable_9_n: unknown column" in done.stderr


def test_dry_run_says_how_many_what_they_cost_and_where_they_go(tmp_path):
    done = prb3r("run", ROOT / "studies/stiffness-coupling.toml", "-o", tmp_path / "out", "--dry-run")
    assert done.returncode == 0, done.stderr
    assert "33 cases, 0 of them stored, about" in done.stdout
    assert not (tmp_path / "out").exists()


def test_run_writes_tables_figures_and_report_and_is_a_no_op_the_second_time(tmp_path):
    words = ("run", ROOT / "studies/stiffness-coupling.toml", "-o", tmp_path, "-j", "2")
    done = prb3r(*words)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "stiffness-coupling"
    written = {path.name for path in folder.iterdir() if path.suffix}
    assert {"cases.parquet", "states.parquet", "manifest.json", "summary.md", "report.html"} <= written
    assert {"configurations.png", "configurations.svg", "angle-over-ratio.png", "angle-over-ratio.svg"} <= written
    assert len(done.stdout.splitlines()) == 1
    before = (folder / "cases.parquet").read_bytes()
    again = prb3r(*words)
    assert "33 cases (unchanged)" in again.stdout
    assert (folder / "cases.parquet").read_bytes() == before


@pytest.mark.long
def test_several_studies_end_with_the_files_and_words_that_each_ends_with_alone(tmp_path):
    studies = [ROOT / f"studies/{name}.toml" for name in ("three-segments", "experiments")]
    together = prb3r("run", *studies, "-o", tmp_path / "together", "-j", "2")
    assert together.returncode == 0, together.stderr
    alone = [prb3r("run", study, "-o", tmp_path / "alone", "-j", "1").stdout for study in studies]
    assert together.stdout.replace("together", "alone") == "".join(alone)
    pictures = sorted(path.relative_to(tmp_path / "alone") for path in (tmp_path / "alone").glob("*/*.[ps][nv]g"))
    assert pictures
    for path in [*pictures, *(Path(study.stem, "cases.parquet") for study in studies)]:
        assert (tmp_path / "together" / path).read_bytes() == (tmp_path / "alone" / path).read_bytes()
    assert prb3r("run", *studies, "-o", tmp_path / "together").stdout.count("(unchanged)") == 2


def test_reach_writes_steps_that_solve_takes_and_says_when_it_cannot(tmp_path):
    done = prb3r("reach", PROTOTYPE, "--x", 0.41, "--y", 0.2)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("sequence,step,cable_1_n,cable_2_n,cable_3_n,cable_4_n,slip_1")
    assert "disk 14 at x 0.41 m, y 0.2 m: reached with 86.94 N in sum" in done.stderr
    (tmp_path / "pull.csv").write_text(done.stdout)
    markers = prb3r("solve", PROTOTYPE, tmp_path / "pull.csv").stdout.splitlines()[-1].split(",")
    assert [float(cell) for cell in markers[3:5]] == pytest.approx([0.41, 0.2], abs=1e-6)
    done = prb3r("reach", PROTOTYPE, "--disk", 7, "--x", 0.3, "--most", 50, "-o", tmp_path / "near.csv")
    assert done.returncode == 1
    assert "is not reached; nearest is x 0.236 m" in done.stdout
    assert (tmp_path / "near.csv").exists()
    done = prb3r("reach", PROTOTYPE, "--x", 0.1, "--y", 0.4)  # there, if plates could take any stress
    assert done.returncode == 1
    assert "prb3r: plates would yield at 1 of 1 target; --least stress looks for pulls that spare them" in done.stderr
    done = prb3r("reach", PROTOTYPE)
    assert done.returncode == 2
    assert "say where to" in done.stderr


def test_compare_needs_results_with_designs(tmp_path):
    assert prb3r("compare", tmp_path).returncode == 2
    assert "no manifest.json" in prb3r("compare", tmp_path).stderr


def test_compare_takes_requirements_of_its_own_and_says_when_nothing_keeps_them(tmp_path):
    study = """
name = "three"
title = "three"
manipulator = "{}"
factor = [{{ name = "thickness_m", path = "segment.1.thickness_m", values = [0.8e-3, 1.0e-3, 1.2e-3] }},
          {{ name = "load_n", path = "step.1.cable_1_n", values = [20, 40] }}]
step = [{{ cable_1_n = 20 }}]
metric = [{{ kind = "position", disk = 7 }}, {{ kind = "tip-compliance" }}]
"""
    (tmp_path / "three.toml").write_text(study.format(PROTOTYPE))
    assert prb3r("run", tmp_path / "three.toml", "-o", tmp_path, "-j", 1).returncode == 0
    wishes, folder = tmp_path / "wishes.toml", tmp_path / "three"
    done = prb3r("compare", folder)
    assert done.returncode == 2
    assert "give [[preference]] or [[requirement]]" in done.stderr
    bound = '[[requirement]]\nmetric = "disk7_angle_rad"\nat_least = {}\nwhere = {{ load_n = 40 }}\n'
    preferred = '[[preference]]\nmetric = "tip_compliance_m_per_n"\nbetter = "less"\n'
    wishes.write_text(bound.format(0.15) + preferred)
    done = prb3r("compare", folder, "--requirements", wishes, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("**Recommendation: Thickness 1 mm.** 2 of 3 designs keep every requirement")
    assert (tmp_path / "out/comparison.md").exists()
    wishes.write_text(bound.format(2.0) + preferred)
    done = prb3r("compare", folder, "--requirements", wishes)
    assert done.returncode == 1
    assert "No design keeps every requirement" in done.stdout
    wishes.write_text('[[preference]]\nmetric = "tip_complience"\nbetter = "less"\n')
    done = prb3r("compare", folder, "--requirements", wishes)
    assert done.returncode == 2
    assert f"{wishes}:2 preference.1.metric: there is no column" in done.stderr
    assert "did you mean 'tip_compliance_m_per_n'?" in done.stderr
    wishes.write_text("# nothing yet\n")
    done = prb3r("compare", folder, "--requirements", wishes)
    assert done.returncode == 2
    assert "wants nothing of designs" in done.stderr


def test_prove_refuses_a_folder_that_is_none_before_any_work(steps):
    done = prb3r("prove", "--cases", "8", "-o", steps)
    assert done.returncode == 2
    assert done.stderr == f"prb3r: {steps}: results cannot go there: {steps} is a file\n"


@pytest.mark.parametrize("what", ["study", "manipulator", "recording"])
def test_schema_is_json_schema(what):
    schema = json.loads(prb3r("schema", what).stdout)
    assert schema["additionalProperties"] is False


def test_help_needs_neither_kernels_nor_pandas():
    probe = "import sys; sys.argv = ['prb3r', '--help']\ntry:\n import prb3r.cli; prb3r.cli.main()\n"
    probe += "except SystemExit: pass\n"
    probe += "print(sorted({'numba', 'pandas', 'numpy', 'matplotlib', 'pyarrow'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "[]"


def test_the_documentation_describes_the_columns_as_the_nomenclature_does():
    from prb3r.quantities import describe

    text = (ROOT / "docs/columns.md").read_text().split("<!-- columns -->")[1].split("<!-- /columns -->")[0]
    rows = [line.strip("| ").split(" | ") for line in text.strip().splitlines()[2:]]
    assert len(rows) > 10
    for cells in rows:
        quantity = describe(cells[0].strip("`"))
        assert cells[-1].strip(" |") == quantity.meaning
        assert cells[2] == (quantity.unit or "text")


def test_solve_says_in_how_many_steps_plates_would_yield(tmp_path):
    """As many as the stress that Python tells; the table and the exit code stay."""
    steps = pd.DataFrame({"sequence": "a", "step": [1, 2, 3], "cable_1_n": [5.0, 150.0, 400.0]})
    steps.to_csv(tmp_path / "steps.csv", index=False)
    done = prb3r("solve", PROTOTYPE, tmp_path / "steps.csv")
    manipulator = load_manipulator(PROTOTYPE)
    stress = solve(manipulator, steps, also=["stress_pa"]).groupby("step")["stress_pa"].max()
    beyond = stress > manipulator.yield_stress_pa
    assert 0 < beyond.sum() < 3
    assert (
        f"plates would yield in {beyond.sum()} of 3 steps: bending stress of up to {1e-6 * stress.max():.4g} MPa"
        in done.stderr
    )
    assert (done.returncode, len(done.stdout.splitlines())) == (0, 46)
    steps.head(1).to_csv(tmp_path / "steps.csv", index=False)
    assert "yield" not in prb3r("solve", PROTOTYPE, tmp_path / "steps.csv").stderr


def test_check_says_which_loads_the_steps_of_a_level_drop(tmp_path):
    level = '[[factor.level]]\nlabel = "{}"\nstep = [{}]\n'
    levels = level.format("tip", "{ tip_y_n = 1.0 }") + level.format("more", "{ cable_1_n = 5.0 }")
    head = f'name = "s"\ntitle = "s"\nmanipulator = "{PROTOTYPE}"\n'
    (tmp_path / "s.toml").write_text(head + "[[step]]\ncable_1_n = 3.0\n" + '[[factor]]\nname = "load"\n' + levels)
    told = prb3r("check", tmp_path / "s.toml").stdout
    assert "level 'tip' of load: its step stands in place of the study's, so that cable_1_n of that is dropped" in told
    assert "'more'" not in told


def test_check_says_where_masses_weigh_nothing(tmp_path):
    """The prototype moves level; neither with gravity nor without masses is there anything to say."""
    text, mass = PROTOTYPE.read_text(), "mass_kg = 0.0447"
    fall = '\n[[effect]]\nkind = "gravity"\ny_m_s2 = -9.81\n'
    for content, said in ((text, True), (text + fall, False), (text.replace(mass, "mass_kg = 0.0"), False)):
        (tmp_path / "arm.toml").write_text(content)
        done = prb3r("check", tmp_path / "arm.toml")
        assert ("its masses (0.626 kg) weigh nothing without an effect gravity" in done.stdout) == said
        assert done.returncode == 0


def test_a_page_that_cannot_be_made_leaves_the_cases_and_the_other_studies(tmp_path, monkeypatch):
    from prb3r.present.study import current

    publish = current.publish_what_changed

    def broken_for_one(result):
        if result.plan.study.name == "one":
            raise ZeroDivisionError("division by zero")
        publish(result)

    monkeypatch.setattr(current, "publish_what_changed", broken_for_one)
    text = f'title = "T"\nmanipulator = "{PROTOTYPE}"\n[[step]]\ncable_1_n = 5\n[[metric]]\nkind = "position"\n'
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text(f'name = "{name}"\n{text}')
    done = prb3r("run", tmp_path / "one.toml", tmp_path / "two.toml", "-o", tmp_path, "--jobs", "1")
    assert done.returncode == 3
    assert "one: 1 case in " in done.stderr
    assert "but no page: internal error: ZeroDivisionError: division by zero" in done.stderr
    assert "two: 1 case (" in done.stdout
    assert (tmp_path / "two/report.html").exists()
    assert len(pd.read_parquet(tmp_path / "one/cases.parquet")) == 1
    monkeypatch.undo()
    again = prb3r("run", tmp_path / "one.toml", "-o", tmp_path, "--jobs", "1")
    assert again.returncode == 0
    assert (tmp_path / "one/report.html").exists()


def test_check_asks_whether_plates_that_are_thicker_than_wide_are_meant(tmp_path):
    text, right = PROTOTYPE.read_text(), "width_m = 0.030\nthickness_m = 0.0008"
    assert right in text
    assert "exchanged" not in prb3r("check", PROTOTYPE).stdout
    (tmp_path / "arm.toml").write_text(text.replace(right, "width_m = 0.0008\nthickness_m = 0.030", 1))
    done = prb3r("check", tmp_path / "arm.toml")
    assert done.returncode == 0, done.stderr
    assert "segment 1: its plates are thicker (" in done.stdout
    assert "are thickness_m and width_m exchanged?" in done.stdout


@pytest.mark.parametrize(("bend", "refused"), [("1.2", False), ("40", True)])
def test_a_bend_in_degrees_is_asked_for_in_radians(tmp_path, bend, refused):
    metric = f'[[metric]]\nkind = "drive-tension"\ncable = "1"\nsegment = 1\nbend_rad = {bend}\n'
    head = f'name = "s"\ntitle = "s"\nmanipulator = "{PROTOTYPE}"\n[[step]]\ncable_1_n = 3.0\n'
    (tmp_path / "s.toml").write_text(head + metric)
    done = prb3r("check", tmp_path / "s.toml")
    assert done.returncode == (2 if refused else 0)
    assert ("40 rad are 6.4 turns; 40 degrees are 0.6981 rad" in done.stderr) == refused
