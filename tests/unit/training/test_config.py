from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamclone.errors import UsageError
from teamclone.models.config import EgocentricConfig, EgocentricPointConfig, PaperConfig
from teamclone.training.config import (
    RENAMED,
    Config,
    config_from,
    differences,
    load_config,
    override,
    preset_names,
    preset_text,
    setting_names,
    to_table,
    to_toml,
)


def test_the_paper_preset_is_table_three() -> None:
    config = load_config("paper")
    assert config.train.epochs == 400
    assert config.data.batches_per_epoch == 300
    assert config.data.validation_batches == 200
    assert config.data.batch_size == 4096
    assert config.train.optimiser == "adam"
    assert config.train.learning_rate == 0.001
    assert config.train.betas == (0.9, 0.999)
    assert config.train.epsilon == 1e-7
    assert config.model.parameter_loss == "paper"
    assert config.model.hidden == (512, 256, 128)
    assert config.model.activation == "relu"
    assert config == Config()


def test_presets_have_the_networks_of_their_families() -> None:
    assert load_config("small").model == load_config("paper").model == PaperConfig()
    assert load_config("best").model == EgocentricConfig()


@pytest.mark.parametrize("name", preset_names())
def test_presets_say_every_setting_and_survive_a_round_trip(name: str) -> None:
    table = tomllib.loads(preset_text(name))
    config = load_config(name)
    assert {key: set(of) for key, of in table.items()} == {key: set(of) for key, of in to_table(config).items()}
    assert config_from(tomllib.loads(to_toml(config)), where="x") == config


@given(
    rate=st.floats(1e-12, 1e3),
    seed=st.integers(0, 2**62),
    hidden=st.lists(st.integers(1, 4096), min_size=1, max_size=5),
    own=st.booleans(),
)
def test_any_config_survives_a_round_trip(rate: float, seed: int, hidden: list[int], own: bool) -> None:
    config = load_config(
        "small",
        [
            f"train.learning_rate={rate}",
            f"train.seed={seed}",
            f"model.hidden={hidden}",
            f"model.own_type={own}".lower(),
        ],
    )
    assert config.train.learning_rate == rate
    assert config.model.hidden == tuple(hidden)
    assert config_from(tomllib.loads(to_toml(config)), where="x") == config


def test_overrides_are_read_as_their_setting_wants() -> None:
    config = load_config(
        "small",
        [
            "train.learning_rate=3e-4",
            "train.max_minutes=30",
            "train.optimiser=rmsprop",
            'train.precision="fp32"',
            "model.all_types=kick, stamina",
            "model.hidden=64",
            "model.own_type=true",
        ],
    )
    assert config.train.learning_rate == 3e-4
    assert config.train.max_minutes == 30.0
    assert isinstance(config.train.max_minutes, float)
    assert (config.train.optimiser, config.train.precision) == ("rmsprop", "fp32")
    assert config.model.all_types == ("kick", "stamina")
    assert config.model.hidden == (64,)
    assert config.model.own_type
    assert override(config, ["model.all_types=[]"]).model.all_types == ()


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        ("train.learning_rat=1", "no setting 'train.learning_rat'; did you mean train.learning_rate"),
        ("epochs=3", "no setting 'epochs'; did you mean train.epochs?"),
        ("zzz=1", "no setting 'zzz'; choose from model.family"),
        ("train.epochs", "expected KEY=VALUE, got 'train.epochs'"),
        ("train.epochs=many", "train.epochs: expected a whole number, got 'many'"),
        ("train.epochs=1.5", "train.epochs: expected a whole number, got 1.5"),
        ("train.epochs=true", "train.epochs: expected a whole number, got True"),
        ("train.epochs=0", "train.epochs: expected at least 1, got 0"),
        ("train.learning_rate=-1", "train.learning_rate: expected a number above 0"),
        ("train.learning_rate=nan", "train.learning_rate: expected a number above 0"),
        ("train.learning_rate=inf", "train.learning_rate: expected at most 1000, got inf"),
        ("train.max_minutes=inf", "train.max_minutes: expected a finite number"),
        ("train.max_minutes=nan", "train.max_minutes: expected at least 0"),
        ("train.optimiser=adm", "train.optimiser: no 'adm'; did you mean adam"),
        ("train.betas=[0.9]", "train.betas: expected 2 values, got [0.9]"),
        ("train.betas=[0.9, 1.0]", "train.betas: expected a number below 1, got 1.0"),
        ("model.own_type=1", "model.own_type: expected true or false, got 1"),
        ("model.all_types=[1]", "model.all_types: expected a word, got 1"),
        ("model.all_types=kik", "model.all_types: no 'kik'; did you mean kick?"),
        ("model.all_types=kick,kick", "model.all_types: names one more than once"),
        ("model.hidden=[]", "model.hidden: expected at least one value, got none"),
        ("model.hidden=512,,3", "model.hidden: expected a value on both sides of each comma, got '512,,3'"),
        ("model.hidden=[0]", "model.hidden: expected at least 1, got 0"),
        ("model.family=papr", "model.family: no 'papr'; did you mean paper?"),
        ("model.kick_dropout=0.1", "no setting 'model.kick_dropout'; it is of the family egocentric, this is paper"),
        ("model.blocks=self", "it is of the family egocentric or egocentric-point, this is paper"),
    ],
)
def test_mistakes_are_named(text: str, answer: str) -> None:
    with pytest.raises(UsageError) as error:
        load_config("small", [text])
    assert answer in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("former", RENAMED)
def test_a_former_name_is_answered_with_the_present_one(former: str) -> None:
    present, (section, _, name) = RENAMED[former], former.partition(".")
    assert former not in setting_names()
    assert present in setting_names()
    with pytest.raises(UsageError) as error:
        load_config("best", [f"{former}=1"])
    assert str(error.value) == f"--set: no setting {former!r}; {former} is now {present}"
    with pytest.raises(UsageError) as error:
        config_from({section: {name: 1}}, where="config.toml")
    assert str(error.value) == f"config.toml: no setting {former}; {former} is now {present}"


def test_former_names_are_those_of_the_changelog() -> None:
    text = (Path(__file__).parents[3] / "CHANGELOG.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1:3] for line in text.splitlines() if line.startswith("  | `")]
    listed = {old: new for before, now in rows for old, new in _pairs(before, now)}
    assert listed == RENAMED


def _pairs(before: str, now: str) -> list[tuple[str, str]]:
    """Former and present names of a row; several former ones may have become one."""
    old, new = (re.findall(r"`([a-z]+\.[a-z_]+)", cell) for cell in (before, now))
    return list(zip(old, new * len(old) if len(new) == 1 else new, strict=True))


def test_all_mistakes_are_told_at_once() -> None:
    with pytest.raises(UsageError) as error:
        load_config("small", ["train.epochs=x", "data.batch_size=0", "modell.hidden=3"])
    for part in ("train.epochs", "data.batch_size", "modell.hidden"):
        assert part in str(error.value)


def test_a_setting_without_effect_is_refused() -> None:
    with pytest.raises(UsageError, match=r"train\.betas has no effect with train\.optimiser = rmsprop"):
        load_config("small", ["train.optimiser=rmsprop", "train.betas=[0.8, 0.9]"])


@pytest.mark.parametrize("text", ["dash,turn", "turn,dash,kick,tackle", "dash,turn,kick,tackle,none,move"])
def test_commands_have_their_order(text: str) -> None:
    with pytest.raises(
        UsageError, match="expected dash, turn, kick, tackle and then, in this order, some of catch, mo"
    ):
        load_config("paper", [f"model.commands={text}"])


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        ("model.own_type=true", "no setting 'model.own_type'; it is of the family paper, this is egocentric"),
        ("model.parameter_loss=masked", "it is of the family paper or egocentric-point, this is egocentric"),
        ("model.parameter_hidden=[0]", "model.parameter_hidden: expected at least 1, got 0"),
        ("model.parameter_hidden=[]", "model.parameter_hidden: expected at least one value, got none"),
        ("model.kick_hidden=[]", "model.kick_hidden: expected at least one value, got none"),
        ("model.kick_dropout=1", "model.kick_dropout: expected at most 0.9, got 1"),
        ("model.kick_attention=6", "model.kick_attention: expected a multiple of 4, got 6"),
        ("model.target_weight=-1", "model.target_weight: expected at least 0, got -1"),
        ("model.blocks=self,bal", "model.blocks: no 'bal'; did you mean ball?"),
    ],
)
def test_mistakes_of_the_egocentric_family_are_named(text: str, answer: str) -> None:
    with pytest.raises(UsageError) as error:
        load_config("best", [text])
    assert answer in str(error.value)


@pytest.mark.parametrize(
    ("preset", "settings", "answer"),
    [
        (
            "paper",
            ["train.optimiser=adagrad", "train.weight_decay=0.1"],
            "weight_decay has no effect with train.opt",
        ),
        ("paper", ["train.balance_strength=0.5"], "train.balance_strength has no effect with train.balance = none"),
        (
            "best",
            ["model.target_points=0", "model.target_weight=0.2"],
            "--set: model.target_weight has no effect with model.target_points = 0; leave it out, or set it to 0.1",
        ),
        (
            "best",
            ["model.family=egocentric-point", "model.target_points=0", "model.target_hidden=8"],
            "model.target_hidden has no effect with model.target_points = 0; leave it out, or set it to [512, 256]",
        ),
    ],
)
def test_settings_that_would_have_no_effect_are_refused(preset: str, settings: list[str], answer: str) -> None:
    with pytest.raises(UsageError) as error:
        load_config(preset, settings)
    assert answer in str(error.value)


def test_target_points_are_left_out_by_one_setting() -> None:
    assert load_config("best", ["model.target_points=0"]).model == EgocentricConfig(target_points=0)
    found = load_config("best", ["model.target_points=1", "model.target_weight=0.2", "model.target_hidden=8"]).model
    assert found == EgocentricConfig(target_points=1, target_weight=0.2, target_hidden=(8,))


def test_another_family_keeps_what_both_have_and_has_its_own_defaults() -> None:
    model = load_config("paper", ["model.family=egocentric", "model.hidden=[8]", "model.kick_dropout=0.5"]).model
    assert model == EgocentricConfig(hidden=(8,), kick_dropout=0.5)
    config = load_config("best", ["model.blocks=self,ball", "model.target_points=2"])
    other = override(config, ["model.family=egocentric-point"])
    assert other.model == EgocentricPointConfig(blocks=("self", "ball"), target_points=2)
    assert "model.kick_dropout: 0.3 became nothing" in differences(config, other)
    assert "model.parameter_loss: nothing became masked" in differences(config, other)


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("model.hidden=[1000000000]", "model.hidden: expected at most 16384"),
        (f"model.hidden={[8] * 100}", "model.hidden: expected at most 32 values, got 100"),
        ("model.hidden=[16384,16384,16384]", "model: expected layers of at most 268,435,456 weights, got 537,1"),
        ("model.ensemble_size=100000000", "model.ensemble_size: expected at most 1000"),
        ("model.target_points=100000000", "model.target_points: expected at most 1000"),
        ("model.kick_attention=400000000", "model.kick_attention: expected at most 4096"),
        ("train.threads=1000000000000", "train.threads: expected at most 4096"),
        ("model.dropout=" + "[" * 100_000, "model.dropout: expected a number"),
    ],
)
def test_what_no_machine_has_room_for_is_refused(setting: str, words: str) -> None:
    with pytest.raises(UsageError, match=re.escape(words)):
        load_config("best", [setting])


def test_unknown_presets_and_sections() -> None:
    with pytest.raises(UsageError, match=r"no preset 'papr'; did you mean paper\?"):
        load_config("papr")
    with pytest.raises(UsageError, match="no section 'other'; there are model, data, train"):
        config_from({"other": {}}, where="config.toml")


def test_differences_name_the_settings() -> None:
    before = load_config("small")
    after = override(before, ["train.seed=4", "model.own_type=true"])
    assert differences(before, after) == ["model.own_type: False became True", "train.seed: 0 became 4"]
    assert differences(before, before) == []
