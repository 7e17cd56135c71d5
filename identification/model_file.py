"""Reading of the JSON files of identified models, local or parameter-varying."""

from __future__ import annotations

import json
from pathlib import Path

from identification.errors import ModelError
from identification.local.models import LinearModel
from identification.lpv.model import LpvModel
from rotorsim.base.errors import DataError
from rotorsim.base.input_files import instead, parse_json
from rotorsim.base.mat import is_mat, read_mat


def load_model(path: str | Path) -> LinearModel | LpvModel:
    """Model of a JSON file that `save` or `rotorsim identify` wrote, or of a .mat file with A, B, C, D, Ts.

    Raises
    ------
    ModelError
        For any other file.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.load_model("model.json").order
    2
    """
    path = Path(path)
    if is_mat(path) and path.is_file():
        return _of_mat(path)
    try:
        data = parse_json(path.read_text(encoding="utf-8-sig"))
        kind = data["kind"]
        return LpvModel.from_dict(data) if kind == "lpv" else LinearModel.from_dict(data)
    except FileNotFoundError as error:
        raise ModelError(f"{path}: is not there; give a file that 'rotorsim identify' wrote") from error
    except (UnicodeDecodeError, json.JSONDecodeError, IsADirectoryError, KeyError, ValueError, TypeError) as error:
        plain = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        reason = instead(path, "a model", "a model of 'rotorsim identify'") or f"is not a model ({plain})"
        raise ModelError(f"{path}: {reason}; give a JSON file that 'rotorsim identify' wrote") from error


def _of_mat(path: Path) -> LinearModel | LpvModel:
    try:
        content = read_mat(path)
        return LpvModel.from_mat(content) if content.get("kind") == "lpv" else LinearModel.from_mat(content)
    except (DataError, ModelError) as error:
        raise ModelError(f"{path}: {error}") from error
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise ModelError(f"{path}: is not a model ({error}); save one by 'model.save' or A, B, C, D, Ts") from error
