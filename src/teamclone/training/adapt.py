"""Adapting a trained clone to another team: the network goes on from the weights of one that knows other teams."""

from __future__ import annotations

import math
from collections.abc import Sequence

from teamclone.dataset.layout import Split
from teamclone.errors import UsageError
from teamclone.models.clone import model_id
from teamclone.models.config import LOSS_SETTINGS, EgocentricConfig
from teamclone.system.settings import assignment, table_of
from teamclone.training.config import Config, override
from teamclone.training.run import Base, Run

CHECKPOINT = "best-loss"
"""Of the base, what is gone on from."""
SETTINGS = (
    "data.batch_size=1024",
    "data.batches_per_epoch=300",
    "data.repeat=false",
    "train.epochs=8",
    "train.learning_rate=5e-4",
    "train.schedule=cosine",
    "train.max_minutes=0",
)
"""What adapting does otherwise than its base: three matches make 120 batches of 1024 an epoch, enough steps for a rate
that is low, so that the base is not forgotten before the new team is learned."""


def adaptation(base: Run, overrides: Sequence[str] = ()) -> tuple[Config, Base]:
    """What `loop.train` needs to adapt a run: the settings and where to begin.

    The network is that of the base, and so is the normalisation of its inputs, so that each input keeps its meaning.
    The settings are those of the base but for SETTINGS, extra kicks in proportion to the batch, and ``overrides``, each
    ``section.key=value``.

    Raises:
        UsageError: a setting is unknown or wrong, or would change the network.
        RunError: the base has no CHECKPOINT, or it is damaged.
    """
    keys = [assignment(text)[0] for text in overrides]
    network = {"family", *table_of(base.config.model)} - {*LOSS_SETTINGS}
    fixed = [key for key in keys if key.startswith("model.") and key.removeprefix("model.") in network]
    if fixed:
        raise UsageError(
            f"--set: {', '.join(fixed)} cannot be changed, an adapted clone has the network of its base; "
            "expected settings of data, train or the loss, or train a new clone with `teamclone train`"
        )
    config = override(base.config, [*SETTINGS, *overrides])
    if isinstance(base.config.model, EgocentricConfig) and "model.extra_kicks" not in keys:
        share = config.data.batch_size / base.config.data.batch_size
        config = override(config, [f"model.extra_kicks={math.ceil(share * base.config.model.extra_kicks)}"])
    model = base.load_model(CHECKPOINT)
    trained_on = base.learned_from(Split.TRAIN)
    origin = {
        "path": str(base.path),
        "checkpoint": CHECKPOINT,
        "model_id": model_id(model),
        "team": base.team,
        "trained_on": None if trained_on is None else sorted(trained_on),
    }
    return config, Base(model=model, origin=origin)
