import pickle

from prb3r.errors import EngineError, Problem, RecordingError, SpecError, did_you_mean


def test_an_error_lists_every_problem_and_survives_pickling():
    error = SpecError(Problem("a.toml:3 name", "is missing"), Problem("a.toml:9 mass_kg", "must be positive"))
    assert str(error) == "a.toml:3 name: is missing\na.toml:9 mass_kg: must be positive"
    assert pickle.loads(pickle.dumps(error)).problems == error.problems


def test_exit_codes_tell_bad_input_from_a_failed_engine():
    assert (SpecError.exit_code, RecordingError.exit_code, EngineError.exit_code) == (2, 2, 3)


def test_suggestion_is_close_or_complete_or_absent():
    assert did_you_mean("Thicknes_m", ["thickness_m", "width_m"]) == "; did you mean 'thickness_m'?"
    assert did_you_mean("zzz", ["su", "chen"]) == "; valid: chen, su"
    assert did_you_mean("zzz", map(str, range(99))) == ""
