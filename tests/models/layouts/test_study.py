"""The study of layouts on a small face: what goes in, what comes out, and that its numbers are what they say."""

from dataclasses import replace

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.layouts import (
    Actor,
    StudyPlan,
    find_moving_vertices,
    measure_weight_errors,
    run_study,
)
from mimique.models.layouts.study_plan import CHOSEN
from mimique.models.layouts.study_trials import SCORES, Trials
from mimique.synthesis import Rig, WeightPrior, WeightSolver
from mimique.synthesis.adaptation import Adaptation

from tests.workbench.small_face import make_rig

SMALL = {
    "sizes": (6, 10),
    "n_seeds": 3,
    "n_frames": 12,
    "n_loss_frames": 3,
    "n_rom_frames": 60,
    "n_cluster_frames": 20,
    "n_checked": 100,
    "n_pairs": 4,
    "n_candidates": 100,
    "budget": 30,
    "sets": (),
    "noises": (0.0, 1.0),
    "offs": (0.0, 3.0),
    "min_distance": 5.0,
}


class Store(dict):
    """A store that counts what is made."""

    made = 0

    def put(self, name, arrays):
        self.made += 1
        self[name] = arrays


def perform(n, seed):
    t = np.linspace(0, 6, n)
    phases = np.random.default_rng(seed).uniform(0, 6, 4)
    return np.clip(np.sin(t[:, None] * [1.0, 1.7, 2.3, 3.1] + phases), 0, 1)


def make_actors(base):
    out = []
    for number, name in enumerate("ABC"):
        grown = Rig(
            base.neutral * [1 + 0.03 * number, 1 - 0.02 * number, 1],
            base.triangles,
            base.deltas * (1 + 0.1 * number),
            base.shapes,
        )
        out.append(Actor(name, grown, perform(80, number), {"talk": perform(40, 10 + number)}))
    return out


@pytest.fixture(scope="module")
def base():
    return make_rig()


@pytest.fixture(scope="module")
def study(base):
    *training, unseen = make_actors(base)
    seen = []
    found = run_study(
        base,
        training,
        [unseen],
        StudyPlan(**SMALL),
        rng=np.random.default_rng(1),
        progress=lambda name, share: seen.append(share),
    )
    assert 0.5 < sum(seen) <= 1.0001
    return found


def test_every_table_has_its_rows(study):
    errors = study.tables["errors"]
    assert set(errors["reconstruction"]) == {"sogp", "solver", "thin shell"}
    counted = errors.groupby(["method", "K", "reconstruction"]).size()
    assert (counted.drop("k-means one actor") == 3).all()  # three actors, one take each
    assert (counted["k-means one actor"] == 6).all()  # two actors that are clustered alone
    assert not errors[errors["tested_on"] == "C"]["same_actor"].any()
    assert errors[errors["tested_on"] == "A"]["same_actor"].all()
    assert np.isfinite(errors[["rmse_printed", "rmse_mm", "mean_mm", "p95_mm"]]).all().all()
    assert (errors["mean_mm"] <= errors["rmse_mm"] * (1 + 1e-9)).all()
    assert study.recommended in set(study.layouts["layout"])
    assert study.recommended.startswith(CHOSEN)
    noise = study.tables["noise"].set_index(["layout", "noise_mm"])["mean_mm"].unstack()
    assert noise[1.0].mean() > noise[0.0].mean()
    off = study.tables["misplacement"].set_index(["layout", "off_mm"])["mean_mm"].unstack()
    assert np.isfinite(off).all().all()
    losses = study.tables["losses"]
    assert set(losses["lost"]) == {1, 2}
    assert (losses["worst_mm"] >= losses["mean_mm"] - 1e-12).all()
    assert any("not known on this rig" in note for note in study.notes)
    assert study.head_markers == {}


def test_layouts_of_the_asked_size(study):
    sizes = study.layouts.groupby(["layout", "method", "K"]).size().reset_index(name="n")
    chosen = sizes[sizes["method"].isin(CHOSEN)]
    assert (chosen["n"] == chosen["K"]).all() and len(chosen) == 8
    assert (sizes["n"] <= sizes["K"]).all()
    assert not study.layouts.duplicated(["layout", "vertex"]).any()
    mirrored = study.tables["symmetry"].set_index("method").loc["greedy, mirrored", "asymmetry_mm"]
    np.testing.assert_allclose(mirrored, 0, atol=1e-9)


def test_solver_errors_agree_with_doing_it_by_hand(base, study):
    unseen = make_actors(base)[2]
    vertices = study.layout("greedy 10")["vertex"].to_numpy()
    plan = StudyPlan(**(SMALL | {"noise": 0.0}))
    trials = Trials(base, make_actors(base)[:2], [unseen], plan, find_moving_vertices(base), {}, 5)
    truth = unseen.tests["talk"][np.linspace(0, 39, 12).round().astype(int)]
    adapt = Adaptation.fit(unseen.face.neutral[vertices], base.neutral[vertices])
    prior = WeightPrior.fit(make_actors(base)[0].range_of_motion)
    made = WeightSolver(base, vertices, prior=prior).solve(adapt(unseen.face.pose(truth, vertices)))
    found = trials.score_layout(vertices)[2]
    expected = measure_weight_errors(unseen.face, truth, made, vertices=trials.checked)["all"]
    got = dict(zip(SCORES, found, strict=True))
    assert got["mean_mm"] == pytest.approx(expected.mean_mm, rel=1e-9)
    assert got["rmse_mm"] == pytest.approx(expected.rmse_mm, rel=1e-9)
    n_skin = len(find_moving_vertices(base))
    assert got["rmse_printed"] == pytest.approx(expected.rmse_published * np.sqrt(n_skin / len(trials.checked)))


def test_loss_of_a_marker_agrees_with_a_layout_without_it(base):
    training = make_actors(base)[:2]
    plan = StudyPlan(**(SMALL | {"noise": 0.0, "n_loss_frames": 12}))
    trials = Trials(base, training, [], plan, find_moving_vertices(base), {}, 5)
    vertices = np.linspace(100, 250, 8).astype(np.int64)
    lost = trials.lose(vertices)
    assert lost["one"].shape == (8,) and len(lost["pairs"]) == len(lost["two"]) == 10 + 4
    errors = []
    for case in trials.cases:
        face = trials.actors[case.actor].face
        adapt = Adaptation.fit(face.neutral[vertices], base.neutral[vertices])
        seen = adapt(face.pose(case.weights, vertices))
        seen[:, 2] = np.nan
        prior = WeightPrior.fit(training[case.actor].range_of_motion)
        made = WeightSolver(base, vertices, prior=prior).solve(seen)
        away = (made - case.weights) @ face.deltas[:, trials.checked].reshape(4, -1)
        errors.append(np.linalg.norm(away.reshape(len(made), -1, 3), axis=2).mean())
    assert lost["one"][2] == pytest.approx(np.mean(errors))


def test_an_interrupted_study_goes_on_and_gives_the_same(base, study):
    store = Store()
    *training, unseen = make_actors(base)
    stop = 20

    def interrupt(name, share):
        nonlocal stop
        stop -= 1
        if stop == 0:
            raise KeyboardInterrupt

    arguments = (base, training, [unseen], StudyPlan(**SMALL))
    with pytest.raises(KeyboardInterrupt):
        run_study(*arguments, rng=np.random.default_rng(1), done=store, progress=interrupt)
    before = store.made
    assert before > 5
    again = run_study(*arguments, rng=np.random.default_rng(1), done=store)
    assert len(store) == store.made  # nothing was made twice
    for title, table in study.tables.items():
        assert again.tables[title].equals(table), title
    assert again.layouts.equals(study.layouts) and again.recommended == study.recommended


def test_bad_input(base):
    first, second, _ = make_actors(base)
    plan = StudyPlan(**SMALL)

    def run(training, unseen=(), plan=plan):
        run_study(base, training, unseen, plan, rng=np.random.default_rng(0))

    n_moving = len(find_moving_vertices(base))
    with pytest.raises(InputError, match=f"{n_moving + 1} markers are asked for, but only {n_moving}"):
        run([first], plan=replace(plan, sizes=(6, n_moving + 1)))
    with pytest.raises(InputError, match="at least one actor"):
        run([])
    with pytest.raises(InputError, match="different names"):
        run([first, first])
    cut = Rig(base.neutral, base.triangles[:-4], base.deltas, base.shapes)
    with pytest.raises(InputError, match="actor B: expected the base rig's mesh"):
        run([first, replace(second, face=cut)])
    with pytest.raises(InputError, match="actor B: the range of motion hardly moves"):
        run([first, replace(second, range_of_motion=second.range_of_motion * 1e-4)])
    with pytest.raises(InputError, match="to test on"):
        run([replace(first, tests={"still": first.range_of_motion * 1e-4})])
    with pytest.raises(InputError, match="MAN 15"):
        run([first], plan=replace(plan, named=("MAN 15",)))
    with pytest.raises(InputError, match="sets: expected some of"):
        StudyPlan(sets=("Vicon",))
    with pytest.raises(InputError, match="finite"):
        Actor("X", base, np.full((5, 4), np.nan), {})


def test_one_actor_and_a_still_take(base):
    first = make_actors(base)[0]
    actor = replace(first, tests={**first.tests, "still": np.zeros((9, 4))})
    plan = StudyPlan(**(SMALL | {"sizes": (8,), "sets": ("MAN 15",), "reconstructions": ("solver",)}))
    found = run_study(base, [actor], [], plan, rng=np.random.default_rng(0))
    notes = " ".join(found.notes)
    assert "A, still: it hardly moves" in notes and "no unseen actor" in notes and "MAN 15 was left out" in notes
    assert set(found.tables["errors"]["take"]) == {"talk"}
    assert "k-means several actors" not in set(found.tables["errors"]["method"])
