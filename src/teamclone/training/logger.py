"""The files that each epoch writes into a run's folder."""

from __future__ import annotations

import json
from typing import Any

from teamclone.models.clone import Clone
from teamclone.system.files import write_atomic
from teamclone.training.checkpoint import save_progress, save_weights
from teamclone.training.optimiser import Optimiser
from teamclone.training.run import BEST, LAST, RESUME, Run


class RunLogger:
    """Writes the record, the checkpoints and the TensorBoard figures of every epoch after epoch ``done``."""

    def __init__(self, run: Run, done: int) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self.run, self.history = run, run.history()[:done]
        write_atomic(run.metrics_path, "".join(json.dumps(record) + "\n" for record in self.history).encode())
        self.board = SummaryWriter(str(run.path / "tensorboard"), purge_step=done + 1)

    def __enter__(self) -> RunLogger:
        return self

    def __exit__(self, *_: object) -> None:
        self.board.close()

    def write(self, record: dict[str, Any], model: Clone, optimiser: Optimiser) -> None:
        """Write an epoch. A kill before the last file repeats the epoch, which writes the same again."""
        epoch, run = record["epoch"], self.run
        with run.metrics_path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
        for name, (figure, better) in BEST.items():
            before = [past[figure] for past in self.history if figure in past]
            if figure in record and all(better(float(record[figure]), float(value)) for value in before):
                save_weights(run.checkpoint_path(name), model, epoch=epoch)
        save_weights(run.checkpoint_path(LAST), model, epoch=epoch)
        self.history.append(record)
        save_progress(run.checkpoint_path(RESUME), model, optimiser, epoch=epoch)
        for name, value in record.items():
            part, _, figure = name.partition("_")
            self.board.add_scalar(f"{part}/{figure}" if part in {"train", "validation"} else name, value, epoch)
