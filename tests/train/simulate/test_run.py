"""Scenes to files: the same bytes however they are run, and the command line."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from edge.record.recording import load
from tests.train.simulate.scenes import make, one_object, run, scene
from train.__main__ import main
from train.simulate import scene as scenes
from train.simulate.run import batches_of, simulate, write

DEMO = Path(__file__).parents[3] / "train" / "scenes" / "demo.toml"


def digests(folder):
    return {
        p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.iterdir()
    }


@pytest.fixture(scope="module")
def demo():
    return scenes.load(DEMO, count=2)


@pytest.fixture(scope="module")
def demo_files(demo, tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    return folder, write(demo, folder).paths


@pytest.fixture(scope="module")
def trial(demo_files):
    return load(demo_files[0] / "cardboard-box-movable-01.npz")


def test_arms_may_halt_at_different_times_once_they_push():
    trial_scene = scene(
        one_object(), spread={"travel_s": 1.0}, motion={"travel_s": 1.0}
    )
    trials = run(trial_scene).trials
    halts = trials.arm.travel_s[0]
    assert len(set(halts.tolist())) == trials.n
    assert (halts >= trials.values["lead_s"] + 0.2).all()
    later = trials.everyone.equilibrium(halts + 1.0)
    assert (later == trials.everyone.equilibrium(halts)).all()


def test_a_joint_may_have_another_speed_in_each_trial():
    spread = {"rate_deg_s": [0.0, 0.0, 0.0, 8.0, 0.0]}
    rates = run(scene(one_object(), spread=spread)).trials.arm.rate
    assert np.count_nonzero(np.ptp(rates, axis=1)) == 1
    assert len(set(rates[3].tolist())) == len(rates.T)


def test_a_recordings_metadata_are_as_the_contract_says(demo, trial):
    assert trial.labels == {
        "category": "rigid-movable",
        "mobility": "movable",
        "softness": "rigid",
        "object": "cardboard box",
    }
    assert trial.layout.to_dict() == demo.skin.to_dict()
    assert trial.meta["arm"] == demo.arm.to_dict()
    assert trial.meta["simulation"]["effects"] == ["sliding", "noise", "dead_band"]


def test_a_recordings_arrays_are_as_the_contract_says(demo, trial):
    assert trial.frames.shape[1:] == (16, 24)
    assert trial.joints is not None
    assert trial.joints.shape == (len(trial.t), 5)
    assert_allclose(np.diff(trial.t), 0.01)
    touched = trial.t[np.argmax(trial.frames.max(axis=(1, 2)) > demo.skin.onset)]
    assert touched > 0.1
    assert trial.t[-1] >= touched + 2.0


def test_a_second_run_writes_the_same_bytes(demo, demo_files, tmp_path):
    steps = []
    write(demo, tmp_path, progress=steps.append)
    assert digests(tmp_path) == digests(demo_files[0])
    assert sum(steps) == 16


def test_long_trials_are_simulated_fewer_side_by_side():
    """As many as ordinary ones would take 20 GB of memory."""
    batches = batches_of(make(one_object(), count=50, rate_hz=1000.0, after_s=59.8))
    assert {len(specs) for specs in batches} <= {5, 6}
    assert sum(map(len, batches)) == 50


def test_another_seed_gives_other_trials_and_fewer_trials_are_the_first(
    demo_files, tmp_path
):
    write(scenes.load(DEMO, seed=99, count=1), tmp_path / "seed")
    write(scenes.load(DEMO, count=1), tmp_path / "fewer")
    first_seed = digests(demo_files[0])
    second_seed = digests(tmp_path / "seed")
    fewer = digests(tmp_path / "fewer")
    assert all(first_seed[name] != digest for name, digest in second_seed.items())
    assert all(first_seed[name] == digest for name, digest in fewer.items())


def recorded(**effects):
    """A recording of a narrow post, by sensors of these effects."""
    trials = {"count": 1, "after_s": 0.6}
    post = scene(one_object(width_m=0.03), trials=trials, effects=effects)
    ((_, recording),) = simulate(post)
    return recording


@pytest.fixture(scope="module")
def plain():
    return recorded()


class TestSensors:
    def test_saturation_cuts_the_counts(self):
        assert recorded(saturation={"newton": 0.5}).frames.max() == 500

    def test_quantisation_leaves_whole_steps(self):
        frames = recorded(quantisation={"counts": 64}).frames
        assert set(np.unique(frames % 64)) == {0}

    def test_a_dead_band_leaves_no_small_counts(self):
        frames = recorded(dead_band={"counts": 300}).frames
        assert frames[frames > 0].min() >= 300

    def test_known_dead_taxels_are_invalid_and_read_zero(self):
        dead = recorded(dead_taxels={"part": 0.3, "known": 1})
        assert 0.6 < dead.valid.mean() < 0.8
        assert not dead.frames[:, ~dead.valid].any()

    def test_jitter_shifts_the_times(self):
        between = np.diff(recorded(jitter={"s": 0.002}).t)
        assert len(np.unique(between.round(6))) > 10
        assert (between > 0.0).all()

    def test_dropped_frames_are_missing_and_the_others_stay(self, plain):
        fewer = recorded(dropped_frames={"part": 0.4})
        assert 0.45 < len(fewer.t) / len(plain.t) < 0.75
        where = np.searchsorted(plain.t, fewer.t)
        assert_array_equal(fewer.frames, plain.frames[where])

    def test_crosstalk_reaches_further_taxels(self, plain):
        leak = recorded(crosstalk={"part": 0.05})
        assert (leak.frames > 0).sum() > (plain.frames > 0).sum()

    def test_hysteresis_lags_by_half_its_loop(self, plain):
        lag = recorded(hysteresis={"counts": 100}).frames.astype(int)
        assert lag.max() == pytest.approx(int(plain.frames.max()) - 100, abs=1)

    def test_the_mean_of_noise_is_that_of_half_a_normal_law(self):
        rest = recorded(noise={"counts": 6}).frames[:10].astype(float)
        assert 6 * 0.35 < rest.mean() < 6 * 0.45  # 0.4 deviations

    def test_a_baseline_drifts(self):
        frames = recorded(drift={"counts_per_s": 50}).frames
        assert frames[-1].mean() > frames[5].mean() > 0.0


class TestCommand:
    def test_simulate_writes_and_says_how_many(self, tmp_path, capsys):
        (tmp_path / "former.npz").touch()
        main(["simulate", str(DEMO), "--trials", "1", "--out", str(tmp_path)])
        err = capsys.readouterr().err
        assert f"recordings written to {tmp_path}: 8" in err
        assert "holds other recordings too: 1, such as former.npz" in err

    def test_explain_lists_effects_with_reasons(self, tmp_path, capsys):
        path = tmp_path / "one.toml"
        path.write_text(
            "[trials]\ncount = 1\nafter_s = 0.3\n[step_s]\nbase = 0.01\n"
            '[[object]]\nname = "foam"\nfamily = "foam"\nconditions = ["fixed"]\n'
            '[[object]]\nname = "wall"\nfamily = "rigid"\nconditions = ["fixed"]\n'
        )
        assert main(["simulate", str(path), "--explain"]) == 0
        out, err = capsys.readouterr()
        line = next(x for x in out.splitlines() if "lateral" in x)
        assert "family foam" in line
        assert "foam-fixed: 1 trials" in out
        assert out.count("  viscous") == 1
        assert "not called for, and not loaded: cover, pop" in err

    @pytest.mark.parametrize(
        ("arguments", "says"),
        [
            (["nowhere.toml", "--out", "x"], "nowhere.toml: cannot be read"),
            ([str(DEMO)], "give --out DIR, --explain or both"),
            (
                [str(DEMO), "--trials", "1", "--out", f"{DEMO}/folder"],
                "cannot be written",
            ),
        ],
    )
    def test_bad_usage_is_one_sentence(
        self,
        arguments,
        says,
        refusal,
        tmp_path,
        monkeypatch,
    ):
        monkeypatch.chdir(tmp_path)
        assert says in refusal("simulate", *arguments)


def test_simulate_warns_of_touches_that_are_not_felt(tmp_path, capsys):
    path = tmp_path / "scene.toml"
    path.write_text(
        "trials.count = 1\ntrials.after_s = 0.3\neffects.dead_band.counts = 65000\n"
        '[[object]]\nname = "wall"\nfamily = "rigid"\nconditions = ["fixed"]\n'
    )
    assert main(["simulate", str(path), "--out", str(tmp_path / "out")]) == 0
    assert "in 1 of them no taxel rises above skin.onset" in capsys.readouterr().err
