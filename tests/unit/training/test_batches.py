"""Batches on the quick way are those of the plain way: raw states, and the model's own features of them."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from tests.synthetic import make_dataset

from teamclone.dataset.build import DatasetConfig, build_dataset
from teamclone.dataset.layout import CATEGORICAL_INDEX, MISSING
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import DatasetError
from teamclone.logs import read_match
from teamclone.models.clone import Clone
from teamclone.models.config import EgocentricPointConfig, ModelConfig, PaperConfig
from teamclone.models.inputs.paper import PaperFeatures
from teamclone.store import create_store
from teamclone.training.batches import Batches, counterparts
from teamclone.training.gather import Gather
from teamclone.training.group import ALONE, Group
from teamclone.training.loop import answer
from teamclone.world.mirror import mirror_state, mirror_target

CPU = torch.device("cpu")
CONFIGS = (
    PaperConfig(),
    PaperConfig(own_type=True),
    PaperConfig(all_types=("stamina", "movement")),
    PaperConfig(own_type=True, all_types=("movement", "kick", "stamina")),
)


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory, samples_dir: Path) -> Dataset:
    """Two real matches."""
    folder = tmp_path_factory.mktemp("real")
    store = create_store(folder / "store")
    for log in sorted(samples_dir.glob("*YuShan2024*.rcg.xz")):
        store.add(read_match(log))
    build_dataset(DatasetConfig(teams=("HELIOS_base",)), store=store, out=folder / "ds", jobs=1)
    return open_dataset(folder / "ds")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return open_dataset(make_dataset(tmp_path_factory.mktemp("data") / "ds", frames_per_match=30))


def fitted(dataset: Dataset, config: ModelConfig) -> Clone:
    torch.manual_seed(0)
    model = Clone(config)
    state = dataset.state(np.arange(len(dataset)), history=model.inputs.history)
    model.inputs.fit([model.inputs.project(state)])
    return model


@pytest.mark.parametrize("config", CONFIGS)
def test_gathered_inputs_of_real_matches_are_the_features_bit_for_bit(real: Dataset, config: ModelConfig) -> None:
    model = fitted(real, config)
    rows = np.random.default_rng(0).permutation(len(real))
    assert len(rows) > 20_000
    assert torch.equal(Gather(real, model.features)(rows), model.features(real.state(rows)))


@pytest.mark.parametrize("config", CONFIGS)
def test_what_a_log_lacks_is_not_a_number_in_the_same_places(
    made: Dataset, tmp_path: Path, config: ModelConfig
) -> None:
    rng = np.random.default_rng(0)
    detail, ball = (made.frames[name].numpy().copy() for name in ("measured", "ball"))
    detail[rng.random(detail.shape) < 0.1] = MISSING
    ball[rng.random(ball.shape) < 0.1] = np.nan
    lacking = open_dataset(
        make_dataset(tmp_path / "ds", frames_per_match=30, **{"frames/measured": detail, "frames/ball": ball})
    )
    model = fitted(made, config)
    rows = np.arange(len(lacking))
    inputs = Gather(lacking, model.features)(rows)
    assert 0.02 < float(inputs.isnan().float().mean()) < 0.2
    assert torch.equal(inputs.nan_to_num(9), model.features(lacking.state(rows)).nan_to_num(9))


@pytest.mark.parametrize(
    ("array", "value", "row"),
    [("samples/frame", 120, 7), ("samples/frame", -1, 7), ("samples/player", 22, 7), ("frames/match", 4, 0)],
)
def test_an_index_that_points_at_nothing_is_told(
    made: Dataset, tmp_path: Path, array: str, value: int, row: int
) -> None:
    """Writer and reader refuse such arrays; a disk may be damaged after they were opened."""
    shutil.copytree(made.path, tmp_path / "ds")
    damaged = open_dataset(tmp_path / "ds")
    values = np.load(tmp_path / "ds" / f"{array}.npy", mmap_mode="r+")
    values[row] = value
    values.flush()
    with pytest.raises(DatasetError, match=r"sample \d points at nothing; make the dataset again"):
        Gather(damaged, Clone(PaperConfig()).features)(np.arange(20))


def test_rows_beyond_the_dataset_are_told(made: Dataset) -> None:
    gather = Gather(made, Clone(PaperConfig()).features)
    for row in (-1, len(made)):
        with pytest.raises(DatasetError, match=f"sample {row} points at nothing"):
            gather(np.array([0, row]))
    assert gather(np.empty(0, np.int64)).shape == (0, 119)


class OtherFeatures(PaperFeatures):
    """Inputs that `Gather` does not know."""

    def normalise(self, columns: torch.Tensor) -> torch.Tensor:
        return super().normalise(columns) * 2


def as_on_a_card(feed: Batches) -> None:
    feed.on_card, feed.quick, feed.ahead = True, False, False


def with_other_features(feed: Batches) -> None:
    feed.quick = False


@pytest.mark.parametrize("way", [lambda feed: None, as_on_a_card, with_other_features])
@pytest.mark.parametrize("size", [1, 2, 3])
def test_shares_make_up_the_batches_in_order(made: Dataset, way: Callable[[Batches], None], size: int) -> None:
    model = fitted(made, CONFIGS[0])
    rows = np.random.default_rng(0).permutation(len(made))[:101]
    feeds = [Batches(made, model, CPU, Group(rank=rank, size=size)) for rank in range(size)]
    for feed in feeds:
        way(feed)
    ready = [list(feed.batches(rows, 25)) for feed in feeds]
    assert {len(batches) for batches in ready} == {5}
    for number, shares in enumerate(zip(*ready, strict=True)):
        part = rows[25 * number : 25 * number + 25]
        for rank, share in enumerate(shares):
            assert torch.equal(share.inputs, model.features(made.state(part[rank::size])))
            assert torch.equal(share.target.kind, made.target(part[rank::size]).kind)
            assert torch.equal(share.target.parameters, made.target(part[rank::size]).parameters)
            assert torch.equal(share.whole, made.target(part).kind)
            assert not share.inputs.requires_grad


def test_other_features_are_asked_themselves(made: Dataset) -> None:
    model = fitted(made, CONFIGS[0])
    rows = np.arange(9)
    plain = model.features(made.state(rows))
    model.features = OtherFeatures()
    model.features.load_state_dict(fitted(made, CONFIGS[0]).features.state_dict())
    (batch,) = Batches(made, model, CPU, ALONE).batches(rows, 9)
    assert torch.equal(batch.inputs, 2 * plain)


RELATIVE = EgocentricPointConfig(
    blocks=("self", "role", "ball", "mates", "past"),
    target_points=0,
)


@pytest.mark.parametrize("config", [CONFIGS[0], RELATIVE])
@pytest.mark.parametrize("kept", [False, True])
@pytest.mark.parametrize("size", [1, 2])
def test_mirrored_samples_among_others(made: Dataset, config: ModelConfig, kept: bool, size: int) -> None:
    model = fitted(made, config)
    rows = np.random.default_rng(0).permutation(len(made))
    training, order = rows[:700], rows[:101]
    turned = np.random.default_rng(1).random(101) < 0.4
    table = 4 * len(model.inputs.names)
    told: list[tuple[int, int]] = []
    feeds = [
        Batches(
            made,
            model,
            CPU,
            Group(rank=rank, size=size),
            cache_bytes=kept * table * 800,
            rows=rows[:800],
            mirrored=training,
            on_progress=lambda *done: told.append(done),
        )
        for rank in range(size)
    ]
    assert {feed.ahead for feed in feeds} == {not kept}
    assert (told[-1] if told else None) == ((800, 800) if kept else None)
    places = counterparts(made, training)
    for number, shares in enumerate(
        zip(*(list(feed.batches(order, 25, mirrored=turned)) for feed in feeds), strict=True)
    ):
        part = slice(25 * number, 25 * number + 25)
        for rank, share in enumerate(shares):
            mine, mirrored = order[part][rank::size], torch.from_numpy(turned[part][rank::size])
            plain, other = made.state(mine, history=model.inputs.history), made.target(mine)
            expected = torch.where(
                mirrored[:, None], model.features(mirror_state(plain, places)), model.features(plain)
            )
            assert torch.allclose(share.inputs, expected, rtol=1e-5, atol=1e-6)
            parameters = torch.where(mirrored[:, None], mirror_target(other).parameters, other.parameters)
            assert torch.equal(share.target.parameters, parameters)
            assert torch.equal(share.target.kind, other.kind)
            assert torch.equal(share.whole, made.target(order[part]).kind)


def test_kept_inputs_are_those_made_anew(made: Dataset) -> None:
    """But for rounding, which hangs on how many are made at once."""
    model = fitted(made, RELATIVE)
    rows = np.random.default_rng(0).permutation(len(made))
    kept = Batches(made, model, CPU, ALONE, cache_bytes=1e9, rows=rows[:500])
    anew = Batches(made, model, CPU, ALONE, cache_bytes=0, rows=rows[:500])
    assert (kept.ahead, anew.ahead) == (False, True)
    for one, other in zip(kept.batches(rows[:300], 77), anew.batches(rows[:300], 77), strict=True):
        assert torch.allclose(one.inputs, other.inputs, rtol=1e-5, atol=1e-6)
    one, other = (torch.cat(list(feed.columns(rows[:300]))) for feed in (kept, anew))
    assert torch.allclose(one, other, rtol=1e-5, atol=1e-6)


def test_counterparts_follow_from_where_players_stand(made: Dataset, tmp_path: Path) -> None:
    """Players off the field do not count; the made team stands anywhere, so it is put in its places."""
    position = made.frames["position"].numpy().copy()
    code = made.frames["categorical"].numpy().copy()
    aside = np.array([0, -20, 20, -8, 8, 0, 0, 0, 0, 0, 0], np.float32)
    position[:, :11] = np.stack([np.linspace(-50, 20, 11) // 10 * 10 * (aside == 0), aside], -1)
    # Number 2 is carried off for half of the frames, to the bench of number 5's side.
    position[60:, 1] = (0, 40)
    code[60:, 1, CATEGORICAL_INDEX["flags"]] = 0
    placed = open_dataset(
        make_dataset(tmp_path / "ds", frames_per_match=30, **{"frames/position": position, "frames/categorical": code})
    )
    assert counterparts(placed, np.arange(len(placed)))[:5].tolist() == [0, 2, 1, 4, 3]


@pytest.mark.parametrize("activation", ["relu", "gelu", "silu", "tanh"])
@pytest.mark.parametrize("n", [1, 257])
def test_a_step_on_the_quick_way_is_a_plain_step_but_for_rounding(real: Dataset, activation: str, n: int) -> None:
    model = fitted(real, replace(CONFIGS[0], activation=activation, hidden=(64, 32)))
    rows = np.random.default_rng(1).permutation(len(real))[:n]
    gradients = []
    for plain in (True, False):
        (batch,) = Batches(real, model, CPU, ALONE).batches(rows, n)
        output = model.answer(real.state(rows)) if plain else answer(model, batch.inputs, precision="fp32")
        loss = model.loss(output, real.target(rows) if plain else batch.target)
        model.zero_grad()
        loss.total.backward()
        gradients.append([loss.total.detach(), *(weights.grad.clone() for weights in model.parameters())])
    for one, other in zip(*gradients, strict=True):
        assert torch.allclose(one, other, rtol=1e-4, atol=1e-6)
