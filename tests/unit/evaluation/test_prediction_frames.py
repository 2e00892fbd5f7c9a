"""A prediction table as data frames of other libraries."""

from __future__ import annotations

import sys

import pyarrow as pa
import pytest

from teamclone.errors import TeamcloneError
from teamclone.evaluation.prediction_table import PredictionTable

TABLE = PredictionTable(
    pa.table({"cycle": [1, 2], "done": pa.array(["dash", None]).dictionary_encode(), "log_loss": [0.5, None]})
)


def test_pandas_and_polars_have_the_same_values() -> None:
    pandas, polars = TABLE.to_pandas(), TABLE.to_polars()
    assert pandas["cycle"].tolist() == polars["cycle"].to_list() == [1, 2]
    assert polars["done"].to_list() == ["dash", None]
    assert pandas["done"].isna().tolist() == [False, True]
    assert polars["log_loss"].to_list() == [0.5, None]


@pytest.mark.parametrize("package", ["pandas", "polars"])
def test_a_missing_library_is_named_with_its_remedy(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(TeamcloneError, match=rf"{package} is not installed; pip install 'teamclone\[frames\]'"):
        getattr(TABLE, f"to_{package}")()
