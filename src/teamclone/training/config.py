"""Settings of a training run: presets in TOML, single values overridden, every mistake reported at once."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from importlib import resources
from pathlib import Path
from typing import Any

from teamclone.errors import UsageError, choose
from teamclone.models.config import FAMILIES, ModelConfig, PaperConfig
from teamclone.system import settings
from teamclone.system.settings import assignment, from_table, renaming, setting, table_of, without_effect

WITH_ADAM = ("adam", "muon")
"""Optimisers that have Adam's settings."""
MAY_CHANGE = ("train.epochs", "train.max_minutes")
"""Settings that may differ in a resumed run: they do not change what an epoch does."""
RENAMED = {
    "model.features": "model.family",
    "model.head": "model.family",
    "model.aims": "model.target_points",
    "model.aim_hidden": "model.target_hidden",
    "model.members": "model.ensemble_size",
    "train.aim_weight": "model.target_weight",
    "train.kicks": "model.extra_kicks",
    "train.parameter_loss": "model.parameter_loss",
    "train.parameter_weight": "model.parameter_weight",
    "data.keep_gb": "data.cache_gb",
}
"""Present names of settings by former ones."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DataConfig:
    """Which samples an epoch and a validation see.

    Attributes:
        batch_size: samples in a batch.
        batches_per_epoch: about how long a slice of the training samples an epoch takes, in batches.
        repeat: an epoch of fewer samples goes through them more than once, see `dataset.order`.
        validation_batches: validation samples that are looked at after each epoch, in batches; 0 takes all.
        cache_gb: memory for inputs that cost more to make than a training step, the egocentric ones, so that they are
            made once; where they do not fit they are made anew for each batch.
        mirror: share of the training samples that are shown reflected at the long axis, see `world.mirror`.
    """

    batch_size: int = setting(4096, at_least=1, at_most=1 << 24)
    batches_per_epoch: int = setting(300, at_least=1, at_most=1 << 24)
    repeat: bool = setting(False)
    validation_batches: int = setting(200, at_least=0, at_most=1 << 24)
    cache_gb: float = setting(8.0, at_least=0)
    mirror: float = setting(0.0, at_least=0, at_most=1)


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
        balance: how rare commands are made up for: none; oversample: rows of rarer commands are drawn more often, in
            an epoch of the same length; undersample: those of frequent ones less often; weights: of the cross-entropy.
        balance_strength: 1 makes all commands equally frequent, 0.5 goes half the way in the logarithm, 0 none of it.
        prior_correction: probabilities are those of the commands' own frequencies, not of the balanced ones.
        calibrate: after each epoch find the temperature of the command probabilities that suits the validation
            samples best.
        precision: fp32, bf16 (autocast), or auto: bf16 where the processor computes in it.
        device: cpu, cuda, or auto: cuda where there is one.
        threads: of the processor; 0 takes all.
        seed: of the first weights and of the order of the samples.
        max_minutes: begin no epoch that would end later than this; 0 is no limit. A resumed run counts afresh.
    """

    # Beyond the upper bounds a share is none, or PyTorch itself overflows.
    epochs: int = setting(400, at_least=1, at_most=1 << 24)
    optimiser: str = setting("adam", choices=("adam", "rmsprop", "adagrad", "muon"))
    learning_rate: float = setting(0.001, above=0, at_most=1000)
    schedule: str = setting("constant", choices=("constant", "cosine"))
    weight_decay: float = setting(0.0, at_least=0)
    betas: tuple[float, ...] = setting((0.9, 0.999), items=2, at_least=0, below=1)
    epsilon: float = setting(1e-7, above=0, at_most=1000)
    balance: str = setting("none", choices=("none", "oversample", "undersample", "weights"))
    balance_strength: float = setting(1.0, at_least=0, at_most=1)
    prior_correction: bool = setting(True)
    calibrate: bool = setting(False)
    precision: str = setting("auto", choices=("auto", "fp32", "bf16"))
    device: str = setting("auto", choices=("auto", "cpu", "cuda"))
    threads: int = setting(0, at_least=0, at_most=4096)
    seed: int = setting(0, at_least=0, at_most=2**63 - 1)
    max_minutes: float = setting(0.0, at_least=0)

    def problems(self, key: str) -> list[str]:
        """Return settings that would have no effect; see `system.settings.from_table`."""
        found: list[str] = []
        if self.optimiser not in WITH_ADAM:
            found += without_effect(self, key, ("betas", "weight_decay"), f"{key}.optimiser = {self.optimiser}")
        if self.balance == "none":
            found += without_effect(self, key, ("balance_strength", "prior_correction"), f"{key}.balance = none")
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """All settings of a run, in the sections of its ``config.toml``.

    Attributes:
        model: settings of one of the FAMILIES, which ``model.family`` names.
        data: see `DataConfig`. train: see `TrainConfig`.
    """

    model: ModelConfig = field(default_factory=PaperConfig)
    data: DataConfig = field(default_factory=DataConfig)
    train: TrainConfig = field(default_factory=TrainConfig)


def setting_names() -> set[str]:
    """Return the names of all settings, ``section.key``, of every model family."""
    models = {f"model.{item.name}" for family in FAMILIES.values() for item in fields(family)}
    return {"model.family", *models, *(name for name, _ in _flat(to_table(Config())))}


def preset_names() -> list[str]:
    """Return the names of the presets that come with the package."""
    folder = resources.files("teamclone.training") / "presets"
    return sorted(Path(entry.name).stem for entry in folder.iterdir() if entry.name.endswith(".toml"))


def preset_text(name: str) -> str:
    """Return a preset's TOML, comments included.

    Raises:
        UsageError: there is no such preset.
    """
    if name not in preset_names():
        raise UsageError(f"no preset {name!r}; {choose(name, preset_names())}")
    return (resources.files("teamclone.training") / "presets" / f"{name}.toml").read_text(encoding="utf-8")


def load_config(preset: str = "best", overrides: Sequence[str] = (), *, where: str = "--set") -> Config:
    """Return a preset with single values overridden, each as ``section.key=value``; see `override`.

    Raises:
        UsageError: naming all that is wrong, in one line.
    """
    return override(config_from(tomllib.loads(preset_text(preset)), where=f"preset {preset}"), overrides, where=where)


def override(config: Config, overrides: Sequence[str], *, where: str = "--set") -> Config:
    """Return a config with single values replaced, each as ``section.key=value``; see `replaced`.

    ``where`` begins the message of an error: the option or the setting that holds the values.
    """
    problems: list[str] = []
    values: dict[str, Any] = {}
    for text in overrides:
        try:
            key, value = assignment(text)
        except UsageError as error:
            problems.append(str(error).removeprefix("--set: "))
        else:
            values[key] = value
    return replaced(config, values, where=where, problems=problems)


def replaced(config: Config, values: Mapping[str, Any], *, where: str, problems: Iterable[str] = ()) -> Config:
    """Return a config with single values replaced.

    With another ``model.family`` the settings that both families have keep their values, the others have the defaults
    of the new one.

    Args:
        values: new values by ``section.key``.
        where: begins the message of an error. problems: what else was wrong.

    Raises:
        UsageError: naming all that is wrong, in one line.
    """
    found, table = list(problems), to_table(config)
    family = values.get("model.family", table["model"]["family"])
    if family != table["model"]["family"] and family in list(FAMILIES):
        known = {item.name for item in fields(FAMILIES[family])}
        shared = {name: value for name, value in table["model"].items() if name in known}
        table["model"] = {"family": family, **table_of(FAMILIES[family]()), **shared}
    for key, value in values.items():
        section, _, name = key.partition(".")
        if name in table.get(section, {}):
            table[section][name] = value
        else:
            found.append(_unknown(key, table))
    return config_from(table, where=where, problems=found)


def config_from(table: dict[str, Any], *, where: str, problems: Iterable[str] = ()) -> Config:
    """Return a config from the tables of a TOML file; what they leave out has its default.

    Args:
        where: begins the message of an error. problems: what else was wrong.

    Raises:
        UsageError: naming all that is wrong, in one line.
    """
    found = list(problems)
    sections = [section.name for section in fields(Config)]
    found += [f"no section {name!r}; there are {', '.join(sections)}" for name in table if name not in sections]
    config = Config(
        model=_model(table.get("model", {}), found),
        data=from_table(DataConfig, table.get("data", {}), "data", found, renamed=RENAMED),
        train=from_table(TrainConfig, table.get("train", {}), "train", found, renamed=RENAMED),
    )
    if found:
        raise UsageError(f"{where}: {'; '.join(found)}")
    return config


def _model(table: Any, problems: list[str]) -> ModelConfig:
    """Return the settings of the family that the table names, the paper's if it names none."""
    family, rest = PaperConfig.family, table
    if isinstance(table, dict):
        family, rest = str(table.get("family", family)), {key: table[key] for key in table if key != "family"}
    if family not in FAMILIES:
        problems.append(f"model.family: no {family!r}; {choose(family, list(FAMILIES))}")
        return PaperConfig()
    model: ModelConfig = from_table(FAMILIES[family], rest, "model", problems, renamed=RENAMED)
    return model


def to_table(config: Config) -> dict[str, dict[str, Any]]:
    """Return the sections of a config as TOML tables."""
    tables = {section.name: table_of(getattr(config, section.name)) for section in fields(config)}
    return tables | {"model": {"family": config.model.family, **tables["model"]}}


def to_toml(config: Config) -> str:
    """Return a config as TOML; `config_from` of it is the same config."""
    return settings.to_toml(to_table(config))


def differences(before: Config, after: Config) -> list[str]:
    """Return the settings that differ: ``train.seed: 0 became 1``."""
    old, new = (dict(_flat(to_table(config))) for config in (before, after))
    return [
        f"{key}: {old.get(key, 'nothing')} became {new.get(key, 'nothing')}"
        for key in {**old, **new}
        if old.get(key) != new.get(key)
    ]


def _flat(table: Mapping[str, Mapping[str, Any]]) -> Iterable[tuple[str, Any]]:
    return ((f"{section}.{name}", value) for section, values in table.items() for name, value in values.items())


def _unknown(key: str, table: Mapping[str, Mapping[str, Any]]) -> str:
    """Return what to say of a key that no section has; `choose` would not find `train.epochs` for `epochs`."""
    if now := renaming(key, RENAMED):
        return f"no setting {key!r}; {now}"
    known = [name for name, _ in _flat(table)]
    same = [name for name in known if name.partition(".")[2] == key.rpartition(".")[2]]
    remedy = f"did you mean {' or '.join(same)}?" if same else choose(key, known)
    of = [name for name, one in FAMILIES.items() if key.removeprefix("model.") in {item.name for item in fields(one)}]
    if key.startswith("model.") and of:
        remedy = f"it is of the family {' or '.join(of)}, this is {table['model']['family']}"
    return f"no setting {key!r}; {remedy}"
