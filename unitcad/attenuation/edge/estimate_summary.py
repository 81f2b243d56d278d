"""The part of an estimate for tables and manifests. It loads no solver."""

from __future__ import annotations

from typing import Any


def summary(estimated: dict[str, Any]) -> dict[str, Any]:
    """Return an estimate for a table or a manifest: edge level and its geometric-mean error by model, measured.

    `measured` is that of this very unit. `model` is the one that leads, `lines` the two lines of the answer.
    """
    measured = estimated["measured"] or {}
    models = {
        name: {
            "edge": block["edge_level"].get("value"),
            "table_error": block["table_error"]["levels"]["geometric_mean"],
        }
        for name, block in estimated["models"].items()
    }
    return {
        "models": models,
        "model": estimated["answer"]["model"],
        "lines": estimated["answer"]["lines"],
        "measured": measured.get("level") if measured.get("same_size") else None,
        "frequency_hz": estimated["variant"]["frequency_hz"]["value"],
    }
