"""What a training run is made of: presets in TOML, single values overridden, every mistake reported at once."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, fields
from importlib import resources
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from teamclone.errors import UsageError, choose
from teamclone.models.config import ACTIVATIONS, ATTENTION_HEADS, BLOCKS, FEATURE_SETS, HEADS, ModelConfig
from teamclone.rcss.commands import REPERTOIRE, not_of_repertoire
from teamclone.rcss.player_types import GROUPS
from teamclone.system.settings import value_of


@dataclass(frozen=True, slots=True, kw_only=True)
class DataConfig:
    """Which samples an epoch and a validation see.

    Attributes:
        batch_size: samples in a batch.
        batches_per_epoch: about how long a slice of the training samples an epoch takes, in batches.
        repeat: an epoch of fewer samples goes through them more than once, see `dataset.order`.
        validation_batches: validation samples that are looked at after each epoch, in batches; 0 takes all.
        keep_gb: memory for inputs that cost more to make than a training step, the relative ones, so that they are made
            once; where they do not fit they are made anew for each batch.
        mirror: share of the training samples that are shown reflected at the long axis, see `models.mirror`.
    """

    batch_size: int = 4096
    batches_per_epoch: int = 300
    repeat: bool = False
    validation_batches: int = 200
    keep_gb: float = 8.0
    mirror: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainConfig:
    """How the weights are found.

    Attributes:
        epochs: slices of the training samples to go through.
        optimiser: adam, rmsprop, adagrad; or muon: Muon of the hidden layers' matrices, Adam of all other weights.
        learning_rate: the highest.
        schedule: constant; or cosine, which rises over the first WARM_UP batches and falls to zero over all epochs.
        weight_decay: decoupled from the gradient (AdamW); adam and muon only.
        betas: Adam's two decay rates; adam and muon only.
        epsilon: added to the optimiser's denominator.
        parameter_loss: "paper": all six parameters, zero where not issued; "masked": issued ones only.
        parameter_weight: of the parameters' error beside that of the command.
        aim_weight: of the error by which turns teach the aims; mixture head only.
        kicks: kicks and tackles shown beside each batch, to the layers that find their parameters; mixture head only.
        balance: how rare commands are made up for: none; oversample: rows of rarer commands are drawn more often, in
            an epoch of the same length; undersample: those of frequent ones less often; weights: of the cross-entropy.
        balance_strength: 1 makes all commands equally frequent, 0.5 goes half the way in the logarithm, 0 none of it.
        prior_correction: probabilities are those of the commands as they are, not as balanced.
        calibrate: after each epoch find the temperature of the command probabilities that suits the validation
            samples best.
        precision: fp32, bf16 (autocast), or auto: bf16 where the processor computes in it.
        device: cpu, cuda, or auto: cuda where there is one.
        threads: of the processor; 0 takes all.
        seed: of the first weights and of the order of the samples.
        max_minutes: begin no epoch that would end later than this; 0 is no limit. A resumed run counts afresh.
    """

    epochs: int = 400
    optimiser: str = "adam"
    learning_rate: float = 0.001
    schedule: str = "constant"
    weight_decay: float = 0.0
    betas: tuple[float, ...] = (0.9, 0.999)
    epsilon: float = 1e-7
    parameter_loss: str = "paper"
    parameter_weight: float = 1.0
    aim_weight: float = 0.0
    kicks: int = 0
    balance: str = "none"
    balance_strength: float = 1.0
    prior_correction: bool = True
    calibrate: bool = False
    precision: str = "auto"
    device: str = "auto"
    threads: int = 0
    seed: int = 0
    max_minutes: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """All settings of a run, in the sections of its ``config.toml``."""

    model: ModelConfig = field(default_factory=ModelConfig)
    data: DataConfig = field(default_factory=DataConfig)
    train: TrainConfig = field(default_factory=TrainConfig)


MAY_CHANGE = ("train.epochs", "train.max_minutes")
"""Settings that a resumed run may have otherwise than before: they do not change what an epoch does."""

WITH_ADAM = ("adam", "muon")
"""Optimisers that have Adam's settings."""
_CHOICES: dict[str, tuple[str, ...]] = {
    "model.commands": REPERTOIRE,
    "model.features": FEATURE_SETS,
    "model.activation": ACTIVATIONS,
    "model.all_types": tuple(GROUPS),
    "model.blocks": BLOCKS,
    "model.kick_blocks": BLOCKS,
    "model.head": HEADS,
    "train.schedule": ("constant", "cosine"),
    "train.optimiser": ("adam", "rmsprop", "adagrad", "muon"),
    "train.parameter_loss": ("paper", "masked"),
    "train.balance": ("none", "oversample", "undersample", "weights"),
    "train.precision": ("auto", "fp32", "bf16"),
    "train.device": ("auto", "cpu", "cuda"),
}
_AT_LEAST: dict[str, float] = {
    "model.hidden": 1,
    "data.batch_size": 1,
    "data.batches_per_epoch": 1,
    "data.validation_batches": 0,
    "model.aims": 0,
    "model.aim_hidden": 1,
    "model.kick_hidden": 1,
    "model.dropout": 0,
    "model.members": 1,
    "data.keep_gb": 0,
    "data.mirror": 0,
    "train.weight_decay": 0,
    "train.parameter_weight": 0,
    "train.aim_weight": 0,
    "model.parameter_hidden": 1,
    "model.kick_dropout": 0,
    "model.kick_attention": 0,
    "train.kicks": 0,
    "train.balance_strength": 0,
    "train.epochs": 1,
    "train.threads": 0,
    "train.seed": 0,
    "train.max_minutes": 0,
}
_ABOVE_ZERO = ("train.learning_rate", "train.epsilon")
_AT_MOST: dict[str, float] = {
    "model.dropout": 0.9,
    "model.kick_dropout": 0.9,
    "data.mirror": 1,
    "train.balance_strength": 1,
    "train.learning_rate": 1000,
    "train.epsilon": 1000,
    "train.seed": 2**63 - 1,
}
"""Beyond these a share is none, or PyTorch itself overflows."""


def preset_names() -> list[str]:
    """The presets that come with the package."""
    folder = resources.files("teamclone.training") / "presets"
    return sorted(Path(entry.name).stem for entry in folder.iterdir() if entry.name.endswith(".toml"))


def preset_text(name: str) -> str:
    """A preset's TOML, comments included.

    Raises:
        UsageError: there is no such preset.
    """
    if name not in preset_names():
        raise UsageError(f"no preset {name!r}; {_choose(name, preset_names())}")
    return (resources.files("teamclone.training") / "presets" / f"{name}.toml").read_text(encoding="utf-8")


def load_config(preset: str = "best", overrides: Sequence[str] = ()) -> Config:
    """A preset with single values overridden, each as ``section.key=value``.

    Raises:
        UsageError: naming all that is wrong, in one line.
    """
    return override(config_from(tomllib.loads(preset_text(preset)), where=f"preset {preset}"), overrides)


def override(config: Config, overrides: Sequence[str]) -> Config:
    """A config with single values replaced, see `load_config`."""
    table = to_table(config)
    errors: list[str] = []
    for text in overrides:
        key, equals, value = text.partition("=")
        section, _, name = key.strip().partition(".")
        if not equals:
            errors.append(f"expected section.key=value, got {text!r}")
        elif name not in table.get(section, {}):
            errors.append(f"no setting {key.strip()!r}; {_choose(key.strip(), list(_keys(table)))}")
        else:
            table[section][name] = value_of(value.strip())
    return config_from(table, where="--set", errors=errors)


def config_from(table: dict[str, Any], *, where: str, errors: Iterable[str] = ()) -> Config:
    """A config from the tables of a TOML file; what it leaves out is as in the paper.

    Raises:
        UsageError: naming all that is wrong, in one line.
    """
    problems = list(errors)
    sections: dict[str, Any] = {}
    known = to_table(Config())
    for section, cls in get_type_hints(Config).items():
        hints = get_type_hints(cls)
        given = table.get(section, {})
        kept: dict[str, Any] = {}
        for name, value in given.items():
            key = f"{section}.{name}"
            if name not in hints:
                problems.append(f"no setting {key!r}; {_choose(key, list(_keys(known)))}")
                continue
            try:
                kept[name] = _converted(key, value, hints[name])
            except UsageError as error:
                problems.append(str(error))
        sections[section] = cls(**kept)
    problems += [f"no section {name!r}; there are {', '.join(sections)}" for name in table if name not in sections]
    config = Config(**sections)
    problems = problems or _idle(config)
    if problems:
        raise UsageError(f"{where}: {'; '.join(problems)}")
    return config


def _idle(config: Config) -> list[str]:
    """Settings that would have no effect beside the others, and those that others need."""
    model, train = config.model, config.train
    of_kicks = tuple(f"model.kick_{name}" for name in ("blocks", "hidden", "dropout", "attention"))
    of_mixture = ("model.parameter_hidden", *of_kicks, "train.kicks")
    of_relative = ("model.blocks", "model.aims", "model.aim_hidden", *of_mixture)
    tables = (("model", model, ModelConfig()), ("train", train, TrainConfig()))
    changed = {
        f"{section}.{item.name}"
        for section, of, usual in tables
        for item in fields(of)
        if getattr(of, item.name) != getattr(usual, item.name)
    }
    problems: list[str] = []

    def idle(names: Iterable[str], beside: str) -> None:
        problems.extend(f"{name} has no effect with {beside}; leave it out" for name in names if name in changed)

    if train.optimiser not in WITH_ADAM:
        idle(("train.betas", "train.weight_decay"), f"train.optimiser = {train.optimiser}")
    if train.balance == "none":
        idle(("train.balance_strength", "train.prior_correction"), "train.balance = none")
    if model.features == "paper":
        idle(of_relative, "model.features = paper")
        if model.head == "mixture":
            problems.append("model.head = mixture needs model.features = relative")
    else:
        idle(("model.own_type", "model.all_types"), "model.features = relative")
        if bool(model.aims) != bool(model.aim_hidden):
            problems.append("model.aims and model.aim_hidden need each other")
        if model.head == "point":
            idle(of_mixture, "model.head = point")
        else:
            lacking = [name for name in ("parameter_hidden", "kick_hidden") if not getattr(model, name)]
            problems += [f"model.head = mixture needs model.{name}" for name in lacking]
    if model.kick_attention % ATTENTION_HEADS:
        problems.append(f"model.kick_attention: expected a multiple of {ATTENTION_HEADS}, got {model.kick_attention}")
    if model.head == "mixture":
        idle(("train.parameter_loss",), "model.head = mixture")
    if model.head == "point" or not model.aims:
        idle(("train.aim_weight",), "model.head = point" if model.head == "point" else "model.aims = 0")
    return problems


def to_table(config: Config) -> dict[str, dict[str, Any]]:
    """The sections of a config as plain dictionaries."""
    return {
        section.name: {
            key: list(value) if isinstance(value, tuple) else value
            for key, value in asdict(getattr(config, section.name)).items()
        }
        for section in fields(config)
    }


def to_toml(config: Config) -> str:
    """A config as TOML; `config_from` of it is the same config."""
    lines = []
    for section, table in to_table(config).items():
        lines += [f"[{section}]", *(f"{key} = {_toml(value)}" for key, value in table.items()), ""]
    return "\n".join(lines)


def differences(before: Config, after: Config) -> list[str]:
    """Settings that differ: ``train.seed: 0 became 1``."""
    old, new = to_table(before), to_table(after)
    return [
        f"{key}: {old[section][name]} became {new[section][name]}"
        for key in _keys(old)
        for section, name in [key.split(".")]
        if old[section][name] != new[section][name]
    ]


def _keys(table: dict[str, dict[str, Any]]) -> Iterable[str]:
    return (f"{section}.{name}" for section, values in table.items() for name in values)


def _choose(wrong: str, choices: list[str]) -> str:
    """As `errors.choose`, which also knows `epochs` for `train.epochs`."""
    same = [choice for choice in choices if choice.partition(".")[2] == wrong]
    return f"did you mean {' or '.join(same)}?" if same else choose(wrong, choices)


def _converted(key: str, value: Any, hint: Any) -> Any:
    """The value as its setting's type, within its bounds."""
    if get_origin(hint) is tuple:
        item = get_args(hint)[0]
        if isinstance(value, str):  # --set model.all_types=kick,stamina
            value = [value_of(part.strip()) for part in value.split(",") if part.strip()]
        values = value if isinstance(value, list) else [value]
        converted = tuple(_scalar(key, part, item) for part in values)
        if key == "train.betas" and not (len(converted) == 2 and all(0 <= beta < 1 for beta in converted)):
            raise UsageError(f"{key}: expected two numbers from 0 to below 1, got {list(converted)}")
        if len(set(converted)) != len(converted) and item is str:
            raise UsageError(f"{key}: names one more than once: {', '.join(converted)}")
        if key == "model.hidden" and not converted:
            raise UsageError(f"{key}: expected at least one width")
        if key == "model.commands" and (wrong := not_of_repertoire(converted)):
            raise UsageError(f"{key}: expected {wrong}")
        return converted
    return _scalar(key, value, hint)


def _scalar(key: str, value: Any, hint: Any) -> Any:
    if hint is float and type(value) is int:
        value = float(value)
    if type(value) is not hint:
        words = {int: "a whole number", float: "a number", bool: "true or false", str: "a word"}
        raise UsageError(f"{key}: expected {words[hint]}, got {value!r}")
    if key in _CHOICES and value not in _CHOICES[key]:
        raise UsageError(f"{key}: no {value!r}; {_choose(value, list(_CHOICES[key]))}")
    if key in _AT_LEAST and not value >= _AT_LEAST[key]:
        raise UsageError(f"{key}: expected at least {_AT_LEAST[key]}, got {value}")
    if key in _ABOVE_ZERO and not value > 0:
        raise UsageError(f"{key}: expected a number above 0, got {value}")
    if not value <= _AT_MOST.get(key, value):
        raise UsageError(f"{key}: expected at most {_AT_MOST[key]}, got {value}")
    if value == float("inf"):
        raise UsageError(f"{key}: expected a finite number, got {value}")
    return value


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(_toml(item) for item in value)}]"
    return f'"{value}"' if isinstance(value, str) else repr(value)
