"""A training that was interrupted and goes on ends as one that was not."""

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.labellers import NetworkLabeller, has_torch

pytestmark = pytest.mark.skipif(not has_torch(), reason="PyTorch is not installed")


def frames():
    rng = np.random.default_rng(0)
    y = np.repeat(rng.choice(["joy", "neutral"], 60), 20).astype(object)
    return rng.standard_normal((1200, 3)) + (y == "joy")[:, None], y, np.repeat(["a", "b", "c", "d"], 300)


def make(kind, **more):
    small = {"n_hidden": 8, "n_layers": 2, "max_epochs": 6, "patience": 3, "window": 2.0, "device": "cpu"}
    return NetworkLabeller(25.0, network=kind, random_state=0, **{**small, **more})


@pytest.mark.parametrize("kind", ["lstm", "gru", "tcn"])
@pytest.mark.parametrize("stopped_after", [1, 4])
def test_resumed_as_if_never_stopped(kind, stopped_after):
    whole = make(kind).fit(*frames())
    states = []

    def interrupt(epoch):
        states.append(epoch.state())
        if epoch.number == stopped_after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(kind, callback=interrupt).fit(*frames())
    resumed = make(kind, checkpoint=states[-1]).fit(*frames())
    np.testing.assert_array_equal(resumed.losses_, whole.losses_)
    assert resumed.best_epoch_ == whole.best_epoch_
    for name, values in whole.arrays_.items():
        np.testing.assert_array_equal(resumed.arrays_[name], values)
    assert all(value.dtype != object for value in states[-1].values())


def test_a_finished_training_stays_finished():
    states = []
    whole = make("tcn", callback=lambda epoch: states.append(epoch.state())).fit(*frames())
    again = make("tcn", checkpoint=states[-1]).fit(*frames())
    np.testing.assert_array_equal(again.losses_, whole.losses_)


def test_a_checkpoint_of_another_network_is_refused():
    states = []
    make("tcn", max_epochs=1, callback=lambda epoch: states.append(epoch.state())).fit(*frames())
    with pytest.raises(InputError, match="checkpoint: expected one of the same network") as caught:
        make("gru", checkpoint=states[-1]).fit(*frames())
    assert "\n" not in str(caught.value)
