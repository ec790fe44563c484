import sys

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.labellers import NetworkLabeller, has_torch
from mimique.models.labellers.network_training import NetworkPlan, _loss, score_sequences, train_network

needs_torch = pytest.mark.skipif(not has_torch(), reason="PyTorch is not installed")


def plan(**changes):
    settings = {
        "kind": "tcn",
        "n_features": 3,
        "n_classes": 2,
        "n_hidden": 8,
        "n_layers": 2,
        "dropout": 0.1,
        "window": 20,
        "batch": 4,
        "learning_rate": 0.02,
        "weight_decay": 0.01,
        "flicker": 0.1,
        "gain": 0.1,
        "noise": 0.1,
        "max_epochs": 30,
        "patience": 3,
        "device": "cpu",
    }
    return NetworkPlan(**{**settings, **changes})


def sequences(n=6, seed=0, shuffle=False):
    rng = np.random.default_rng(seed)
    made = []
    for length in rng.integers(15, 50, size=n):
        codes = (np.arange(length) // 8) % 2
        values = rng.standard_normal((length, 3)).astype(np.float32) * 0.5 + codes[:, None]
        made.append((values, rng.permutation(codes) if shuffle else codes))
    return made


def test_without_torch_one_line_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    X, y = np.random.default_rng(0).standard_normal((60, 2)), np.repeat(["a", "b"], 30)
    with pytest.raises(InputError, match="PyTorch is not installed; install"):
        NetworkLabeller(25.0, single_take=True).fit(X, y)


@needs_torch
@pytest.mark.parametrize("kind", ["lstm", "gru", "tcn"])
def test_what_is_beyond_the_end_changes_nothing(kind):
    settings = plan(kind=kind, max_epochs=1)
    data = sequences()
    arrays = train_network(settings, data, [], rng=np.random.default_rng(0)).arrays
    together = score_sequences(settings, arrays, [values for values, _ in data])
    for (values, _), scores in zip(data, together, strict=True):
        np.testing.assert_allclose(score_sequences(settings, arrays, [values])[0], scores, atol=1e-6)
        assert scores.shape == (len(values), 2)


@needs_torch
def test_training_stops_and_keeps_the_best_epoch():
    epochs = []
    trained = train_network(
        plan(max_epochs=60),
        sequences(),
        sequences(3, 5, shuffle=True),
        rng=np.random.default_rng(0),
        callback=epochs.append,
    )
    assert len(epochs) == len(trained.losses) < 60  # labels that nothing explains: holding out stops it early
    assert trained.best == 1 + int(trained.losses[:, 1].argmin()) == len(epochs) - 3
    assert [epoch.number for epoch in epochs] == list(range(1, len(epochs) + 1))
    checkpoint = [epoch.arrays for epoch in epochs if epoch.arrays is not None][-1]
    for name, values in trained.arrays.items():
        np.testing.assert_array_equal(values, checkpoint[name])


@needs_torch
def test_torch_is_left_as_it_was():
    import torch

    torch.manual_seed(3)
    before = torch.random.get_rng_state()
    train_network(plan(max_epochs=1), sequences(), [], rng=np.random.default_rng(0))
    assert torch.equal(before, torch.random.get_rng_state())


@needs_torch
def test_loss_against_a_count_frame_by_frame():
    import torch

    rng = np.random.default_rng(0)
    scores, codes, lengths = (
        rng.standard_normal((2, 5, 3)) * 4,
        np.array([[0, 2, -1, 1, 1], [2, 0, -1, -1, -1]]),
        [5, 2],
    )
    log_likely = scores - np.log(np.exp(scores).sum(axis=2, keepdims=True))
    known = [-log_likely[s, f, codes[s, f]] for s in range(2) for f in range(5) if codes[s, f] >= 0]
    change = [
        min(abs(log_likely[s, f, k] - log_likely[s, f - 1, k]), 4.0) ** 2
        for s in range(2)
        for f in range(1, lengths[s])
        for k in range(3)
    ]
    found = _loss(torch.from_numpy(scores), torch.from_numpy(codes), torch.tensor(lengths), 0.3)
    np.testing.assert_allclose(float(found), np.mean(known) + 0.3 * np.mean(change))


@needs_torch
@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"network": "mlp"}, "network"),
        ({"n_hidden": 0}, "n_hidden"),
        ({"window": -1.0}, "window"),
        ({"dropout": 1.0}, "dropout"),
        ({"device": "cuda:99"}, "device"),
        ({"held_out": 1.5}, "held out share"),
    ],
)
def test_bad_parameters(parameters, words):
    X, y = np.random.default_rng(0).standard_normal((60, 2)), np.repeat(["a", "b"], 30)
    with pytest.raises(InputError, match=f"^{words}"):
        NetworkLabeller(25.0, **{"single_take": True, "device": "cpu", **parameters}).fit(X, y)
